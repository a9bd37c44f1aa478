"""docs/when-it-goes-wrong.md and the folder beside it, made from the collection: `python -m tests.mistakes.page`.

The first page lists all mistakes with the words that they show, so one search finds the entry; the entries of each
section are on a page of their own. Both are sorted by title.
"""

from pathlib import Path

from tests.mistakes import FOLDER, SOLUTIONS, Mistake, collection

DOCS = FOLDER.parents[1] / "docs"
CONTENTS = "when-it-goes-wrong.md"
HEAD = """# When it goes wrong

Search this page for a few words of what your notebook or your terminal says, and follow the link: the entry explains
the mistake and what to do. `...` stands for words that vary. The course's tests make every one of these mistakes.
"""
SECTION = """# When it goes wrong: {title}

Each entry explains the mistake, what to do, and what is shown. [All sections](../when-it-goes-wrong.md).
"""
TITLES = {
    "services": "Services",
    "actions": "Actions",
    "parameters": "Parameters",
    "ai_integration": "AI and ROS",
    "calculator": "The calculator",
}
WORDS = 110  # characters of a message in the list


def pages() -> dict[Path, str]:
    """Return the text of each page, by its path below docs/."""
    known = list(collection())
    folder = Path(CONTENTS).stem
    contents, made = [HEAD], {}
    for exercise, title in TITLES.items():
        mistakes = sorted((mistake for mistake in known if mistake.exercise == exercise), key=_by_title)
        contents.append(f"\n## {title}\n\n")
        contents += [_line(mistake, f"{folder}/{exercise}.md") for mistake in mistakes]
        made[Path(folder, f"{exercise}.md")] = SECTION.format(title=title) + "".join(map(_entry, mistakes))
    return {Path(CONTENTS): "".join(contents), **made}


def _by_title(mistake: Mistake) -> str:
    """Return the key by which the mistakes of a section are sorted: the title's words, as a reader looks for them."""
    return mistake.title.replace("`", "").casefold()


def _line(mistake: Mistake, page: str) -> str:
    """Return a mistake's line in the list: its title, and the words by which somebody finds it."""
    anchor = mistake.title.replace("`", "").replace(" ", "-")
    shown = [line.strip() for lines in _shown(mistake) for line in lines if line.strip().strip(".")]
    telling = next((line for line in shown if "Error: " in line or line.startswith("Hint: ")), shown[0])
    words = telling if len(telling) <= WORDS else telling[:WORDS].rpartition(" ")[0] + " ..."
    return f"- [{mistake.title}]({page}#{anchor}): `{words.replace('`', chr(39))}`\n"


def _entry(mistake: Mistake) -> str:
    """Return a mistake's entry: no code, because it would be the reference answer's but for the mistake."""
    boxes = "".join("\n```text\n" + "\n".join(lines) + "\n```\n" for lines in _shown(mistake))
    return f"\n## {mistake.title}\n\n{mistake.text}\n\nYou see:\n{boxes}"


def _shown(mistake: Mistake) -> list[list[str]]:
    """Return the lines that each step shows, without those of the reference answer and of cells that work."""
    own = {line.strip() for file in (SOLUTIONS / mistake.exercise).iterdir() for line in file.read_text().splitlines()}
    return [
        [f"{'':4}(your line)" if line.startswith("    ") and line.strip() in own else line for line in step.shown]
        for step in mistake.steps
        if step.shown and not _goes_well(step.shown)
    ]


def _goes_well(lines: list[str]) -> bool:
    """Return True if a cell says only that it has worked: it is on the way to the message."""
    return all(": written" in line for line in lines)


if __name__ == "__main__":
    for path, text in pages().items():
        (DOCS / path).parent.mkdir(exist_ok=True)
        (DOCS / path).write_text(text, encoding="utf-8")
        print(DOCS / path)
