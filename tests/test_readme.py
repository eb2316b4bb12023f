"""The Python in README.md and in the documentation runs as it is printed."""

import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
_BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
SESSION = Path(__file__).parent / "docs" / "session.py"
_IN_TURN = "Each block goes on from the one before."
PAGES = [
    ROOT / "README.md",
    *sorted(
        page
        for page in (ROOT / "docs").rglob("*.md")
        if not {"_build", "gallery"} & set(page.relative_to(ROOT).parts)
    ),
]
SESSIONS = [page for page in PAGES if _IN_TURN in " ".join(page.read_text("utf-8").split())]
BLOCKS = [
    pytest.param(block, id=f"{page.name}-{number}")
    for page in PAGES
    if page not in SESSIONS
    for number, block in enumerate(_BLOCK.findall(page.read_text(encoding="utf-8")), start=1)
]


@pytest.mark.parametrize("block", BLOCKS)
def test_a_printed_example_runs_on_its_own(block: str, tmp_path: Path) -> None:
    # A fresh interpreter, as a reader has it: no imports or warning filters of other tests.
    _run(["-c", block], tmp_path, timeout=300)


@pytest.mark.slow
@pytest.mark.parametrize("page", SESSIONS, ids=lambda page: page.stem)
def test_a_page_whose_blocks_go_on_runs_as_one_session(page: Path, tmp_path: Path) -> None:
    _run([str(SESSION), str(page)], tmp_path, timeout=1200)


def test_the_readme_has_an_example() -> None:
    assert _BLOCK.search((ROOT / "README.md").read_text(encoding="utf-8"))


def test_every_local_link_leads_to_a_file() -> None:
    missing = []
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
            if "://" not in target and not (page.parent / target).exists():
                missing.append(f"{page.name}: {target}")
    assert not missing, missing


def test_every_name_of_the_package_on_the_pages_exists() -> None:
    missing = []
    for page in PAGES:
        for name in re.findall(r"`(continuair(?:\.\w+)+)`", page.read_text(encoding="utf-8")):
            try:
                pkgutil.resolve_name(name)
            except (ImportError, AttributeError):
                missing.append(f"{page.name}: {name}")
    assert not missing, missing


def _run(arguments: list[str], folder: Path, timeout: float) -> None:
    # Examples use the sources under test, and draw without a display.
    path = os.pathsep.join(filter(None, [str(ROOT / "src"), os.environ.get("PYTHONPATH")]))
    run = subprocess.run(
        [sys.executable, "-W", "error::UserWarning:continuair", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=timeout,
    )
    assert run.returncode == 0, run.stderr
