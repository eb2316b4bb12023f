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
ALONE, SESSION = (Path(__file__).parent / "docs" / name for name in ("alone.py", "session.py"))
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
EXAMPLES = [page for page in PAGES if page not in SESSIONS and page.name != "README.md"]


@pytest.mark.slow
def test_the_readmes_examples_run_on_their_own(tmp_path: Path) -> None:
    # A fresh interpreter for each, as a reader has it: no imports or warning filters of others.
    blocks = _BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    assert blocks
    for block in blocks:
        _run(["-c", block], tmp_path, timeout=300)


@pytest.mark.slow
def test_every_example_of_a_page_runs_without_those_before_it(tmp_path: Path) -> None:
    assert any(_BLOCK.search(page.read_text(encoding="utf-8")) for page in EXAMPLES)
    _run([str(ALONE), *map(str, EXAMPLES)], tmp_path, timeout=600)


@pytest.mark.slow
@pytest.mark.parametrize("page", SESSIONS, ids=lambda page: page.stem)
def test_a_page_whose_blocks_go_on_runs_as_one_session(page: Path, tmp_path: Path) -> None:
    _run([str(SESSION), str(page)], tmp_path, timeout=1200)


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
