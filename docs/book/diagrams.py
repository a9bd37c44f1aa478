"""The notebooks' mermaid diagrams as SVG, drawn at build time by the mermaid that JupyterLab ships.

The page then needs no script and no internet.  JupyterLab's files are packed by webpack: the loader in its `main` file
is asked for the shared module `@jupyterlab/mermaid`, in a Chromium, and JupyterLab itself is never started.
"""

import re
import shutil
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

FENCE = re.compile(r"^```mermaid\n(.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)
STATIC = Path(sys.prefix) / "share/jupyter/lab/static"
ADDRESS = "http://jupyterlab.invalid/"  # never looked up: every request is answered from STATIC
THEMES = {"light": "default", "dark": "dark"}
# A telephone gets a drawing of its own: a chart from top to bottom, the lines of a conversation closer together.
LAYOUTS: dict[str, dict[str, object]] = {
    "wide": {},
    "narrow": {
        "sequence": {
            "wrap": True,
            "width": 182,  # of a box (pixels); its longest word is "calculator_server.py"
            "actorMargin": 48,
            "wrapPadding": 2,
            "diagramMarginX": 2,
            "messageFontSize": 12,
            "actorFontSize": 12,
            "noteFontSize": 12,
        },
        "flowchart": {"subGraphTitleMargin": {"top": 2, "bottom": 14}, "nodeSpacing": 70, "rankSpacing": 30},
    },
}
ACROSS = re.compile(r"^flowchart LR$", re.MULTILINE)
CALL = re.compile(r"^(.*>>.*\w{12,})(?=\()", re.MULTILINE)  # too long for one line of a narrow conversation
BROWSERS = ("chromium-headless-shell", "chromium", "google-chrome")
QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
START = """<!doctype html><body>
<script id="jupyter-config-data" type="application/json">{"baseUrl": "/", "fullStaticUrl": "http://jupyterlab.invalid"}</script>
<script>window.addEventListener = () => 0  // JupyterLab would start when the page has loaded</script>
<script src="/%s"></script>
"""
LOAD = """async () => {
  const packed = Object.keys(self).find(name => /^(web|rs)packChunk/.test(name));
  let load;
  self[packed].push([["diagrams"], {}, loader => { load = loader; }]);
  await load.I("default");
  const found = Object.values(load.S.default["@jupyterlab/mermaid"])[0];
  const { MermaidManager } = (await found.get())();
  self.mermaid = await new MermaidManager({}).getMermaid();
}"""
DRAW = """async ([text, theme, layout, id]) => {
  mermaid.initialize({ startOnLoad: false, theme, fontFamily: "Arial, Helvetica, sans-serif", ...layout });
  return (await mermaid.render(id, text)).svg;
}"""


def drawn(texts: Iterable[str]) -> dict[str, str]:
    """Each diagram's text with its HTML: light and dark, wide and narrow; nothing when there is no Chromium."""
    wanted = sorted({diagram for text in texts for diagram in FENCE.findall(text)})
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if not wanted or not program:
        return {}
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(QUIET))
        page = browser.new_page()
        page.route("**", _answer)
        page.goto(ADDRESS)
        page.evaluate(LOAD)
        found = {text: _figure(page.evaluate, text, number) for number, text in enumerate(wanted)}
        browser.close()
    return found


def replaced(text: str, figures: dict[str, str]) -> str:
    """The Markdown `text` with each diagram as a drawing; one that was not drawn stays as it is."""
    return FENCE.sub(lambda fence: figures.get(fence[1], fence[0]), text)


def _answer(route: Any) -> None:
    name = route.request.url.removeprefix(ADDRESS).partition("?")[0]
    file = STATIC / name
    if not name:
        route.fulfill(body=START % next(STATIC.glob("main.*.js")).name, content_type="text/html")
    elif name == Path(name).name and file.is_file():
        route.fulfill(path=file)
    else:
        route.fulfill(status=404)


def _figure(evaluate: Callable[..., str], text: str, number: int) -> str:
    """On one line: Markdown ends a block of HTML at an empty one."""
    forms = (
        f'<div class="only-{name} {layout}">'
        + evaluate(
            DRAW,
            [
                ACROSS.sub("flowchart TB", CALL.sub(r"\1<br/>", text)) if layout == "narrow" else text,
                theme,
                options,
                f"diagram-{number}-{name}-{layout}",
            ],
        )
        + "</div>"
        for name, theme in THEMES.items()
        for layout, options in LAYOUTS.items()
    )
    return '<figure class="diagram">' + " ".join("".join(forms).split("\n")) + "</figure>"
