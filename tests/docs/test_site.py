"""`environment/site`: no answer on its pages, no dead link, and nothing that is fetched when they are read."""

import html
import importlib.util
import json
import re
import subprocess
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from autograder.gradebook.leaks import TELLTALES, secrets
from course.foundation import cells
from course.foundation.cells import SOLUTION

ROOT = Path(__file__).parents[2]
BOOK = ROOT / "docs/book"
SECTIONS = {path.stem: path for path in sorted(ROOT.glob("notebooks/[!.]*/*.ipynb"))}
FLAGS = re.MULTILINE | re.DOTALL
CAPTIONS = ("How you work here", "When it goes wrong", "Questions and answers")


def load(name: str):
    """A module of docs/book, which is no package."""
    spec = importlib.util.spec_from_file_location(f"book_{name}", BOOK / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


links, diagrams = load("links"), load("diagrams")


def build(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [ROOT / "environment/site", *arguments], capture_output=True, text=True, timeout=280, stdin=subprocess.DEVNULL
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site."""
    output = tmp_path_factory.mktemp("site") / "course with a space"
    done = build(str(output))
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{output}/index.html\n"
    return output


def shown(page: Path) -> str:
    """The words of a page, as a reader sees them."""
    text = page.read_text(encoding="utf-8")
    body = re.sub(r"<(script|style)\b.*?</\1>", " ", text[text.index("<body") :], flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", "", body)).split())


def test_no_link_is_dead(site):
    assert list(links.dead(site)) == []
    assert all(urlsplit(address).netloc for address in links.elsewhere(site))


def test_every_section_and_page_is_in_the_contents(site):
    start = (site / "index.html").read_text()
    for name in SECTIONS:
        assert f'href="{name}/{name}.html"' in start
    assert all(caption in start for caption in CAPTIONS)


@pytest.mark.parametrize("name", SECTIONS)
def test_no_page_shows_an_answer(site, name):
    text = shown(site / name / f"{name}.html")
    deck = shown(site / name / "slides.html")
    stored = cells.read(SECTIONS[name])
    answers = [
        region for cell in stored if cell.mark.get("solution") for region in SOLUTION.findall(cell.source)
    ]  # fmt: skip
    assert answers and "YOUR CODE HERE" in text
    for answer in answers:
        assert " ".join(answer.split()) not in text and " ".join(answer.split()) not in deck
    whole = [kept for kept, what in secrets(name, SECTIONS[name]).items() if what.startswith("all of")]
    assert whole and not [kept for kept in whole if kept in text or kept in deck]
    assert not [word for word in TELLTALES if word.lower() in text.lower()]


@pytest.mark.parametrize("name", SECTIONS)
def test_stored_outputs_are_shown_and_figures_are_there(site, name):
    raw = json.loads(SECTIONS[name].read_text())["cells"]
    own = [cell for cell in raw if not cell["metadata"].get("nbgrader", {}).get("solution")]
    outputs = [output for cell in own for output in cell.get("outputs", [])]
    pictures = sum("image/png" in output.get("data", {}) for output in outputs)
    page = (site / name / f"{name}.html").read_text()
    assert len(re.findall(r'<img [^>]*src="\.\./_images/', page)) >= pictures
    written = [html.unescape(alt) for alt in re.findall(r'<img alt="([^"]*)"', page)]
    told = [output["metadata"]["image/png"]["alt"] for output in outputs if "image/png" in output.get("data", {})]
    assert [alt for alt in told if alt not in written] == []
    text = shown(site / name / f"{name}.html")
    said = [cells.text_of(output["text"]) for output in outputs if output["output_type"] == "stream"]
    assert said and sum(" ".join(words.split())[:60] in text for words in said) > 0.7 * len(said)


@pytest.mark.parametrize("name", SECTIONS)
def test_a_deck_has_a_slide_for_each_heading_and_none_of_an_exercise(site, name):
    deck = (site / name / "slides.html").read_text()
    titles = {html.unescape(re.sub(r"<[^>]+>", "", each)) for each in re.findall(r"<h[12]>(.*?)</h[12]>", deck)}
    texts = [re.sub(r"^```.*?^```", "", cell.source, flags=FLAGS) for cell in cells.read(SECTIONS[name])]
    headings = [
        title.replace("`", "") for text in texts for title in re.findall(r"^## +(.*)$", text, re.MULTILINE)
    ]  # fmt: skip
    left_out = ("Your turn", "Ten minutes first", "Where to go on", "Words")
    taught = {title for title in headings if not title.startswith(left_out)}
    assert len(taught) >= 4 and taught <= titles
    assert not [title for title in titles if title.startswith(left_out)]
    assert f'href="{name}/slides.html"' in (site / "index.html").read_text()


@pytest.mark.parametrize("name", SECTIONS)
def test_a_deck_folds_what_is_to_be_predicted_and_its_figures_have_alternative_texts(site, name):
    deck = (site / name / "slides.html").read_text()
    slides = re.findall(r"<section.*?</section>", deck, re.DOTALL)
    asking = [slide for slide in slides if "<strong>Predict</strong>" in slide and 'class="code"' in slide]
    assert asking
    for slide in asking:
        open_text = re.sub(r"<details>.*?</details>", "", slide, flags=re.DOTALL)
        assert 'class="output"' not in open_text and "<img" not in open_text
    pictures = re.findall(r"<img ([^>]*)>", deck)
    assert all(re.match(r'alt="[^"]{40,}" src="data:image/png;base64,', each) for each in pictures)


def test_arrows_lead_from_slide_to_slide_and_paper_shows_what_is_folded(site, chromium):
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.goto((site / "services/slides.html").as_uri())
    tops = "[...document.querySelectorAll('section')].map(each => Math.round(each.getBoundingClientRect().top))"
    for key, number in (("ArrowRight", 1), ("PageDown", 2), ("ArrowLeft", 1)):
        page.keyboard.press(key)
        page.wait_for_function(f"Math.abs({tops}[{number}]) < 10")
    assert not page.locator("details[open]").count()
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator("details[open]").count() == page.locator("details").count() > 5
    page.close()


def test_diagrams_are_drawings(site, chromium):
    for name, path in SECTIONS.items():
        count = sum(len(diagrams.FENCE.findall(cell.source)) for cell in cells.read(path) if cell.kind == "markdown")
        page = (site / name / f"{name}.html").read_text()
        assert page.count('<figure class="diagram">') == count
        assert len(re.findall(r'<div class="only-(?:light|dark) (?:wide|narrow)"><svg ', page)) == 4 * count
        assert len(re.findall(r"<title id=[^>]*>[^<]{10,}</title><desc id=[^>]*>[^<]{60,}</desc>", page)) == 4 * count
        assert "sequenceDiagram" not in page


# Each diagram that is shown: its class, and the size (pixels) and the texts of its words.
DRAWINGS = """() => [...document.querySelectorAll('figure.diagram')].map(figure => {
  const shown = [...figure.children].filter(each => each.checkVisibility());
  const svg = shown[0].querySelector('svg');
  const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
  const all = [...svg.querySelectorAll('tspan, .messageText, .nodeLabel, .edgeLabel p')];
  const words = all.filter(each => each.textContent.trim());
  return {
    classes: shown.map(each => each.className),
    size: scale * Math.min(...words.map(each => parseFloat(getComputedStyle(each).fontSize))),
    texts: words.map(each => each.textContent),
    scrolls: figure.scrollWidth > figure.clientWidth,
  };
})"""


def test_on_a_telephone_diagrams_and_figures_are_readable_and_fit(site, chromium):
    page = chromium.new_page(viewport={"width": 390, "height": 844}, color_scheme="dark")
    for name in SECTIONS:
        page.goto((site / name / f"{name}.html").as_uri())
        found = page.evaluate(DRAWINGS)
        assert found
        for drawing in found:
            assert drawing["classes"] == ["only-dark narrow"] and not drawing["scrolls"]
            assert drawing["size"] > 10, drawing
            assert [text for text in drawing["texts"] if text.endswith("-")] == []  # no word is broken
        widths = page.locator(".cell_output img").evaluate_all("all => all.map(each => each.clientWidth)")
        assert set(widths) <= {358}  # the width of the text
    page.set_viewport_size({"width": 1280, "height": 800})
    assert [drawing["classes"] for drawing in page.evaluate(DRAWINGS)] == [["only-dark wide"]]
    page.close()


@pytest.mark.matrix  # test_no_link_is_dead builds the pages
def test_pages_open_from_the_disk_in_light_and_dark(site, chromium):
    """No page asks for anything but files, none is wider than a telephone, and a folded answer unfolds."""
    grounds = {}
    for scheme in ("light", "dark"):
        page = chromium.new_page(viewport={"width": 390, "height": 800}, color_scheme=scheme)
        asked, errors = [], []
        page.on("request", lambda request, asked=asked: asked.append(request.url))
        page.on("pageerror", lambda error, errors=errors: errors.append(str(error)))
        for path in sorted(site.rglob("*.html")):
            if "_static" not in path.parts:
                page.goto(path.as_uri())
                assert page.evaluate("document.documentElement.scrollWidth") <= 390, path
        assert {urlsplit(url).scheme for url in asked} <= {"file", "data"} and errors == []
        page.goto((site / "index.html").as_uri())
        grounds[scheme] = page.evaluate("getComputedStyle(document.body).backgroundColor")
        folded = page.locator("details:has(summary:text-is('Answer'))").first
        assert not folded.locator("p").first.is_visible()
        folded.locator("summary").click()
        assert folded.locator("p").first.is_visible()
        page.close()
    assert grounds["light"] != grounds["dark"]


def test_the_search_finds_words_without_a_server(site, chromium):
    page = chromium.new_page()
    page.goto((site / "search.html").as_uri() + "?q=deadlock")
    page.locator("#search-results li a").first.wait_for(timeout=30_000)
    assert "services/services.html" in page.locator("#search-results li a").first.get_attribute("href")
    page.close()


def test_a_folder_that_is_no_site_is_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    done = build(str(tmp_path))
    assert done.returncode == 2 and "is not a site" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]
    assert build("--help").returncode == 2


PAGE = """<html><body id="here"><a href="other.html#there">1</a><a href="#here">2</a>
<a href="https://docs.ros.org/en/jazzy">3</a>%s</body></html>"""


@pytest.mark.parametrize(
    ("more", "found"),
    [
        ("", ""),
        ('<a href="gone.html">x</a>', "gone.html: there is no such file"),
        ('<a href="other.html#gone">x</a>', "other.html#gone: there is no such anchor"),
        ('<a href="#gone">x</a>', "#gone: there is no such anchor"),
        ('<img src="gone.png">', "gone.png: there is no such file"),
        ('<a href="../above.html">x</a>', "../above.html: there is no such file"),
        ('<a href="/other.html">x</a>', "/other.html: there is no such file"),
    ],
)
def test_dead_links_are_found(tmp_path, more, found):
    folder = tmp_path / "site"
    folder.mkdir()
    (tmp_path / "above.html").write_text("")
    (folder / "page.html").write_text(PAGE % more)
    (folder / "other.html").write_text('<h2 id="there">x</h2>')
    assert list(links.dead(folder)) == ([f"page.html: {found}"] if found else [])


def test_without_a_chromium_a_diagram_stays_text(monkeypatch):
    text = "Before\n\n```mermaid\nflowchart LR\n  a --> b\n```\n\nafter"
    monkeypatch.setattr(diagrams.shutil, "which", lambda program: None)
    assert diagrams.replaced(text, diagrams.drawn([text])) == text
    assert diagrams.replaced(text, {"flowchart LR\n  a --> b\n": "<figure></figure>"}) == (
        "Before\n\n<figure></figure>\n\nafter"
    )
