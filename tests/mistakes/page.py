"""docs/when-it-goes-wrong.md, made from the collection: `python -m tests.mistakes.page`."""

from tests.mistakes import FOLDER, SOLUTIONS, Mistake, collection

PAGE = FOLDER.parents[1] / "docs" / "when-it-goes-wrong.md"
HEAD = """# When it goes wrong

Look up what your notebook or your terminal says: search this page for a few words of it. Each entry tells the mistake,
what to do, and what is shown. `...` stands for words that differ. The course's tests run every one of them.
"""
TITLES = {
    "services": "Services",
    "actions": "Actions",
    "parameters": "Parameters",
    "ai_integration": "AI and ROS",
    "calculator": "The calculator",
}


def page() -> str:
    """The page's text."""
    parts = [HEAD]
    known = list(collection())
    for exercise, title in TITLES.items():
        parts.append(f"\n## {title}\n")
        parts += [_entry(mistake) for mistake in known if mistake.exercise == exercise]
    return "".join(parts)


def _entry(mistake: Mistake) -> str:
    """What went wrong, and what is shown: no code, for it is the reference answer's but for the mistake."""
    own = {line.strip() for file in (SOLUTIONS / mistake.exercise).iterdir() for line in file.read_text().splitlines()}
    shown = [
        [f"{'':4}(your line)" if line.startswith("    ") and line.strip() in own else line for line in step.shown]
        for step in mistake.steps
        if step.shown and not _goes_well(step.shown)
    ]
    boxes = "".join("\n```text\n" + "\n".join(lines) + "\n```\n" for lines in shown)
    return f"\n### {mistake.title}\n\n{mistake.text}\n\nYou see:\n{boxes}"


def _goes_well(lines: list[str]) -> bool:
    """Whether this is only what a cell says that has worked: it is on the way to the message."""
    return all(": written" in line for line in lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
