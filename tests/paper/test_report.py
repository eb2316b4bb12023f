"""The page of a result folder: everything is on it, nothing is fetched, a browser can filter it."""

import base64
import hashlib
import json
import os
import re
import shutil
import subprocess
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import pytest
from typer.testing import CliRunner

import continuair.errors
from amiri2026.sentences import sentences
from amiri2026.verdicts import CLASSES
from continuair.cli.commands import app
from continuair.studies.contents import read
from continuair.studies.results import MARKER, UNFINISHED
from tests.refusals import assert_refused

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
ARGUMENTS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-quic",
)  # fmt: skip
PARTS = "III-A,III-B,IV.4,IV-A.3"


class Page(HTMLParser):
    """Ids, and what a page would load."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.sources: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id" and value:
                self.ids.append(value)
            if name in ("src", "href", "data", "action") and value:
                self.sources.append(value)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of sentences that need no long flights, and of two studies among them."""
    out = tmp_path_factory.mktemp("report") / "results"
    done = CliRunner().invoke(
        app, ["paper", "--quick", "--out", str(out), "--only", f"{PARTS},IV-A.8"]
    )
    assert done.exit_code == 0, done.output
    return out


@pytest.mark.long
def test_every_sentence_is_on_the_page_once_with_its_verdict(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    found = json.loads((folder / "paper.json").read_text(encoding="utf-8"))["sentences"]
    wanted = [n for n in sentences() if n.startswith(("III-A.", "III-B."))]
    wanted += ["IV.4", "IV-A.3", "IV-A.8"]
    assert [entry["id"] for entry in found] == wanted
    shown = Counter(Page(page).ids)
    for entry in found:
        assert shown[entry["id"]] == 1
        row = page[: page.index(f'id="{entry["id"]}"')].rpartition("<article")[2]
        assert f'data-verdict="{entry["verdict"]}"' in row
        row = page[page.index(f'id="{entry["id"]}"') :].partition("</article>")[0]
        assert f">{CLASSES[entry['verdict']]}</span>" in row
        assert f"--vehicle paper --only {entry['id']} --quick</code>" in row


@pytest.mark.long
def test_the_page_holds_all_that_it_shows(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    sources = Page(page).sources
    assert any(source.startswith("data:image/") for source in sources)
    assert all(source.startswith(("data:image/", "#")) for source in sources)
    assert "default-src 'none'" in page and "unsafe-inline" not in page and ' style="' not in page
    # What figures hold is inside them: no style sheet of theirs fetches anything either.
    assert not re.search(r"@import|url\((?!#)", page)
    figures = [path for study in ("open_loop", "table") for path in (folder / study).glob("*.png")]
    assert len([s for s in sources if s.startswith("data:image/")]) == len(figures)
    assert len(page) < 15e6


@pytest.mark.long
def test_a_studys_own_folder_becomes_a_page_too(folder: Path, tmp_path: Path) -> None:
    study = tmp_path / "open_loop"
    shutil.copytree(folder / "open_loop", study)
    for _ in range(2):  # a report that is there is replaced
        done = CliRunner().invoke(app, ["report", str(study)])
        assert done.exit_code == 0, done.output
    page = (study / "report.html").read_text(encoding="utf-8")
    assert "continuair paper --vehicle paper --quick" in page
    assert "NRMSE" in page
    assert "report.html" in json.loads((study / MARKER).read_text())["files"]


def damaged(folder: Path, at: Path, what: str) -> Path:
    """A copy of a result folder that something is wrong with."""
    copy = at / "copy"
    shutil.copytree(folder / "open_loop", copy)
    marker = copy / MARKER
    if what == "nothing of ours":
        marker.unlink()
    elif what == "interrupted":
        (copy / UNFINISHED).touch()
    elif what == "newer":
        marker.write_text(json.dumps({**json.loads(marker.read_text()), "version": "99.0"}))
    elif what == "cut":
        (copy / "open_loop.json").write_text('{"vehicle": ')
    elif what == "list":
        (copy / "open_loop.json").write_text("[1, 2]")
    elif what == "vehicle":
        (copy / "open_loop.json").write_text('{"vehicle": [3]}')
    elif what == "elsewhere":
        marker.write_text(json.dumps({**json.loads(marker.read_text()), "study": "../copy/x"}))
    elif what == "linked":
        (copy / "table.md").unlink()
        (copy / "table.md").symlink_to(folder / "table.md")
    elif what == "endless":
        (copy / "open_loop.json").unlink()
        os.mkfifo(copy / "open_loop.json")
    elif what == "foreign page":
        (copy / "report.html").write_text("mine")
    elif what == "link":
        (copy / "report.html").symlink_to(at / "victim")
    return copy


@pytest.mark.long
@pytest.mark.parametrize(
    ("what", "fact"),
    [
        ("nothing of ours", ""),
        ("interrupted", ""),
        ("newer", "continuair 99.0"),
        ("cut", ""),
        ("list", ""),
        ("vehicle", ""),
        ("elsewhere", ""),
        ("linked", "table.md"),
        ("endless", "open_loop.json"),
        ("foreign page", "report.html"),
        ("link", "report.html"),
    ],
)
def test_a_folder_that_cannot_become_a_page_is_told_in_one_sentence(
    folder: Path, tmp_path: Path, what: str, fact: str
) -> None:
    copy = damaged(folder, tmp_path, what)
    done = CliRunner().invoke(app, ["report", str(copy)])
    assert_refused(done, "folder", str(copy), fact)
    assert not (tmp_path / "victim").exists()


@pytest.mark.long
def test_a_report_shows_the_studies_of_its_own_run_alone(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "results"
    shutil.copytree(folder, out)
    mine = tmp_path / "mine.toml"
    text = (Path(continuair.errors.__file__).parent / "presets" / "paper.toml").read_text()
    mine.write_text(text.replace('name = "paper"', 'name = "mine"'))
    again = ["paper", "--only", "IV.4", "--vehicle", str(mine), "--out", str(out)]
    assert CliRunner().invoke(app, again).exit_code == 0
    assert read(out).parts == []
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "vehicle mine" in page and "data:image" not in page
    # The study of the run before is still the paper's to replace, and a user's own is not.
    (out / "tracking").mkdir()
    refused = CliRunner().invoke(app, ["paper", "--only", "IV-A.4", "--out", str(out)])
    assert_refused(refused, "out", "tracking")


@pytest.mark.long
def test_a_folder_with_a_study_of_the_users_own_is_refused(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "results"
    shutil.copytree(folder / "open_loop", out / "open_loop")
    refused = CliRunner().invoke(app, ["paper", "--only", "IV.4", "--out", str(out)])
    assert_refused(refused, "out", str(out))


def test_the_record_is_of_a_whole_run_of_the_preset() -> None:
    for options in (["--quick"], ["--vehicle", "slender"]):
        refused = CliRunner().invoke(app, ["paper", "--check", *options])
        assert_refused(refused, "check", "paper")


@pytest.mark.parametrize("only", ["III-Z", "III-A.99", ""])
def test_an_unknown_sentence_is_told(only: str) -> None:
    done = CliRunner().invoke(app, ["paper", "--only", only])
    assert_refused(done, "only")


@pytest.mark.long
def test_what_a_study_wrote_is_read_back(folder: Path) -> None:
    contents = read(folder)
    parts = {part.study: part for part in contents.parts}
    assert set(parts) == {"open_loop", "table"}
    assert parts["open_loop"].command == "continuair paper --vehicle paper --quick"
    assert set(parts["open_loop"].results["tests"]) == set("ABCD")


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_a_browser_filters_the_page_and_fetches_nothing(folder: Path, tmp_path: Path) -> None:
    """And runs no script but the page's own: that of the test has to be allowed first."""
    page = (folder / "report.html").read_text(encoding="utf-8")
    script = (
        "const box=document.querySelector('input[data-verdict=\"holds\"]');"
        "box.checked=false;box.dispatchEvent(new Event('input',{bubbles:true}));"
        "document.title=[...document.querySelectorAll('article.sentence')]"
        ".filter(row=>!row.hidden).map(row=>row.id).join(' ')+'|'"
        "+performance.getEntriesByType('resource').filter(e=>!e.name.startsWith('data:')).length;"
    )
    tried = tmp_path / "tried.html"
    injected = page.replace("</body>", f"<script>{script}</script></body>")
    tried.write_text(injected, encoding="utf-8")
    assert "<title>The paper" in browse("--dump-dom", tried, tmp_path)
    known = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = injected.replace("script-src ", f"script-src 'sha256-{known}' ")
    tried.write_text(allowed, encoding="utf-8")
    dom = browse("--dump-dom", tried, tmp_path)
    shown, _, fetched = re.search(r"<title>(.*?)</title>", dom)[1].partition("|")  # type: ignore[index]
    found = json.loads((folder / "paper.json").read_text(encoding="utf-8"))["sentences"]
    left = [entry["id"] for entry in found if entry["verdict"] != "holds"]
    assert shown.split() == left
    assert 0 < len(left) < len(found)
    assert fetched == "0"


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_the_page_prints(folder: Path, tmp_path: Path) -> None:
    paper = tmp_path / "report.pdf"
    browse(f"--print-to-pdf={paper}", folder / "report.html", tmp_path)
    assert paper.read_bytes().startswith(b"%PDF")


def browse(what: str, page: Path, tmp_path: Path) -> str:
    assert CHROMIUM is not None
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    done = subprocess.run(
        [CHROMIUM, *ARGUMENTS, profile, what, page.as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    return done.stdout
