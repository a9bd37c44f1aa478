"""Links of built pages that lead nowhere: `python docs/book/links.py FOLDER` lists them."""

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ADDRESSES = {"a": "href", "link": "href", "img": "src", "script": "src", "iframe": "src", "source": "src"}
ELSEWHERE = ("http", "https", "mailto", "data")


def anchor(title: str) -> str:
    """A heading's anchor as JupyterLab makes it, so that one link works here and there."""
    return title.replace(" ", "-")


class _Page(HTMLParser):
    """The anchors of a page, and the addresses that it names."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = {"", "top"}
        self.addresses: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the element's anchor and its address."""
        known = dict(attrs)
        self.anchors |= {value for name in ("id", "name") if (value := known.get(name))}
        if address := known.get(ADDRESSES.get(tag, "")):
            self.addresses.append(address)


def dead(folder: Path) -> Iterator[str]:
    """Each link of the pages in `folder` to a file or an anchor that is not there, or out of the folder, in a line.

    Addresses elsewhere are not followed: see `elsewhere`.
    """
    pages = _pages(folder)
    for path, page in pages.items():
        for address in page.addresses:
            parts = urlsplit(address)
            if parts.scheme in ELSEWHERE:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_relative_to(folder.resolve()) or not target.is_file():
                yield f"{path.relative_to(folder.resolve())}: {address}: there is no such file"
            elif target in pages and unquote(parts.fragment) not in pages[target].anchors:
                yield f"{path.relative_to(folder.resolve())}: {address}: there is no such anchor"


def elsewhere(folder: Path) -> set[str]:
    """The addresses on the internet that the pages in `folder` name."""
    found = (address for page in _pages(folder).values() for address in page.addresses)
    return {address for address in found if urlsplit(address).scheme in ("http", "https")}


def _pages(folder: Path) -> dict[Path, _Page]:
    """The pages of `folder`; below `_static`, Sphinx's themes leave templates of theirs."""
    paths = (path for path in sorted(folder.resolve().rglob("*.html")) if "_static" not in path.parts)
    return {path: _Page(path.read_text(encoding="utf-8")) for path in paths}


if __name__ == "__main__":
    lines = list(dead(Path(sys.argv[1])))
    print("\n".join(lines) or "no dead links")
    sys.exit(bool(lines))
