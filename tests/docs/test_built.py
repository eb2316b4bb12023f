"""The documentation builds without a warning, gallery and all, and needs nothing from outside."""

import json
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

import continuair as ca

pytest.importorskip("sphinx_gallery")
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
GALLERY = sorted(path.stem for path in (ROOT / "examples" / "gallery").glob("*.py"))
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built pages; what the gallery writes beside its sources is written to a copy."""
    root = tmp_path_factory.mktemp("docs")
    left_out = shutil.ignore_patterns("_build", "gallery")
    shutil.copytree(ROOT / "docs", root / "docs", ignore=left_out)
    for name in ("examples", "src", "research"):
        (root / name).symlink_to(ROOT / name)
    for path in ROOT.iterdir():
        if path.is_file():
            shutil.copy(path, root)
    built = root / "built"
    source = str(ROOT / "src")
    subprocess.run(
        [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", root / "docs", built],
        env={**os.environ, "PYTHONPATH": source, "MPLBACKEND": "Agg"},
        check=True,
        timeout=1200,
    )
    return built


class Loaded(HTMLParser):
    """What a page loads by itself: everything but where its links lead."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag != "a":
            self.addresses += [v for k, v in attrs if k in ("src", "href", "data", "srcset") and v]


def test_a_page_loads_nothing_from_outside(pages: Path) -> None:
    outside = {
        address
        for page in pages.rglob("*.html")
        for address in Loaded(page.read_text(encoding="utf-8")).addresses
        if re.match(r"(\w+:)?//", address)
    }
    for style in pages.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        outside |= set(re.findall(r"""(?:url\(|@import )["']?((?:\w+:)?//[^"')\s]+)""", text))
    assert not outside


def test_formulas_are_drawn_by_the_browser(pages: Path) -> None:
    texts = [page.read_text(encoding="utf-8") for page in (pages / "explanation").glob("*.html")]
    assert sum(text.count("<math ") for text in texts) > 100
    assert not any("\\kappa" in text for text in texts)


def test_every_public_name_has_an_entry_that_can_be_linked_to(pages: Path) -> None:
    from sphinx.util.inventory import InventoryFile

    entries = InventoryFile.loads((pages / "objects.inv").read_bytes(), uri="")
    linked = {name for domain in entries.data.values() for name in domain}
    assert {f"continuair.{name}" for name in ca.__all__} <= linked


@pytest.mark.parametrize("name", GALLERY)
def test_an_example_of_the_gallery_drew_its_figure_and_warned_of_nothing(
    pages: Path, name: str
) -> None:
    text = (pages / "gallery" / f"{name}.html").read_text(encoding="utf-8")
    assert f"sphx_glr_{name}_001.png" in text
    assert "Warning" not in text.replace("ContinuairWarning", "")
    assert str(ROOT) not in text


@pytest.mark.parametrize(
    ("word", "page"),
    [
        ("aerodynamic", "explanation/not_modelled"),
        ("contact", "explanation/not_modelled"),
        ("GPU", "howto/gpu"),
        ("units", "explanation/conventions"),
    ],
)
def test_the_index_of_the_search_leads_from_a_word_to_its_page(
    pages: Path, word: str, page: str
) -> None:
    from sphinx.search.en import SearchEnglish

    text = (pages / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(text.removeprefix("Search.setIndex(").rstrip(";\n").removesuffix(")"))
    stem = SearchEnglish({}).stem(word.lower())
    found: set[str] = set()
    for part in ("terms", "titleterms"):  # of the text and of headings
        numbers = index[part].get(stem, [])
        for number in numbers if isinstance(numbers, list) else [numbers]:
            found.add(index["docnames"][number])
    assert page in found


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_a_search_finds_a_page_that_is_opened_as_a_file(pages: Path) -> None:
    run = subprocess.run(
        [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         "--virtual-time-budget=5000", f"{(pages / 'search.html').as_uri()}?q=gust"],
        capture_output=True,
        text=True,
        timeout=120,
    )  # fmt: skip
    assert "gallery/gust.html" in run.stdout


@pytest.mark.parametrize("name", GALLERY)
def test_an_example_of_the_gallery_is_of_at_most_fifty_lines(name: str) -> None:
    path = ROOT / "examples" / "gallery" / f"{name}.py"
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 50
