"""Scripts of the validation pages skip where data are absent; an overview links all pages."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
OF_DATA = ("trunk", "tentacle")
"""Scripts that take a folder of measured data; the others hold published figures alone."""


def written() -> dict[Path, int]:
    """Return the files that the scripts write by default, with the times of their last change."""
    folders = ROOT / "docs" / "validation", ROOT / "docs" / "images", ROOT / "validation"
    return {
        path: path.stat().st_mtime_ns
        for folder in folders
        for path in folder.rglob("*.*")
        if path.suffix != ".pyc"
    }


@pytest.mark.parametrize("name", OF_DATA)
def test_a_script_without_its_data_says_so_and_writes_nothing(name: str, tmp_path: Path) -> None:
    before = written()
    found = subprocess.run(
        [sys.executable, "-B", ROOT / "validation" / f"{name}.py", tmp_path],
        capture_output=True, text=True, check=True, cwd=tmp_path,
    )  # fmt: skip
    assert found.stdout.startswith("Skip")
    assert not list(tmp_path.iterdir())
    assert written() == before


def test_make_validate_runs_every_script() -> None:
    rule = re.search(r"^validate:.*?\n\n", (ROOT / "Makefile").read_text("utf-8"), re.M | re.S)
    assert rule
    loops = re.findall(r"for set in ([\w ]+);", rule.group())
    scripts = {path.stem for path in (ROOT / "validation").glob("*.py")} - {"pages"}
    assert {name for names in loops for name in names.split()} == scripts
    assert set(loops[0].split()) == set(OF_DATA)


def test_the_overview_links_every_page() -> None:
    pages = {path.name for path in (ROOT / "docs" / "validation").glob("*.md")}
    overview = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert pages == set(re.findall(r"\]\(validation/(\w+\.md)\)", overview))
