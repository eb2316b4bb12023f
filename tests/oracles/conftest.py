"""Claims: figures that an independent source must confirm, recorded for `make verify`.

`pytest tests/oracles --verify verify.json` runs every comparison and writes the list of claims.
Without it the comparisons with other engines run only when their file is named.
"""

from __future__ import annotations

import ast
import json
import math
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest

Claim = Callable[..., None]
Entry = dict[str, Any]

_CLAIMS = pytest.StashKey[list[Entry]]()
_OURS = (
    "test_bend_vector.py",
    "test_claims.py",
    "test_kane.py",
    "test_kane_kernels.py",
    "test_kane_lagrange.py",
    "test_kane_mechanics.py",
    "test_visp.py",
)
"""Files that need no other engine, and run with all other tests."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--verify", metavar="JSON", help="run all oracles and write their claims")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_CLAIMS] = []


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    foreign = collection_path.name.startswith("test_") and collection_path.name not in _OURS
    return True if foreign and not config.getoption("verify", None) else None


@pytest.fixture
def claim(request: pytest.FixtureRequest) -> Claim:
    """Record that a figure is what an independent source says, within a tolerance.

    claim(text, source, tolerance, reached, expected=0.0, unit="", note="", table=None, miss=None):
    |reached - expected| <= tolerance must hold, else the test fails once it has made all its
    claims. tolerance None: a measured distance, without a verdict. note: the derivation behind the
    expected value or the distance. table: (columns, rows) that show how the figure came about.
    miss: the derivation of a known miss, which stays on the page without failing the test; that
    it misses no longer fails.
    """

    def record(
        text: str,
        source: str,
        tolerance: float | None,
        reached: float,
        expected: float = 0.0,
        *,
        unit: str = "",
        note: str = "",
        table: tuple[list[str], list[list[Any]]] | None = None,
        miss: str | None = None,
    ) -> None:
        reached, expected = float(reached), float(expected)
        fits = None if tolerance is None else abs(reached - expected) <= tolerance
        entry: Entry = {"claim": text, "source": source, "tolerance": tolerance}
        entry |= {"reached": reached if math.isfinite(reached) else str(reached), "pass": fits}
        entry |= {"expected": expected, "unit": unit, "note": note, "table": table}
        entry |= {"known_miss": miss, "test": request.node.nodeid}
        entry["about"] = _about(request.path)
        request.config.stash[_CLAIMS].append(entry)

    return record


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Generator[None, Any, Any]:
    result = yield
    entries = pyfuncitem.config.stash[_CLAIMS]
    of_test = [e for e in entries if e["test"] == pyfuncitem.nodeid]
    wrong = [_sentence(e) for e in of_test if _is_wrong(e)]
    if wrong:
        pytest.fail("\n".join(wrong), pytrace=False)
    return result


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, Any, Any]:
    report = yield
    entries = item.config.stash[_CLAIMS]
    of_test = [e for e in entries if e["test"] == item.nodeid]
    if report.failed and not any(_is_wrong(e) for e in of_test):
        entries.append(_not_run(item, call.excinfo.exconly() if call.excinfo else "", False))
    elif report.skipped:
        entries.append(_not_run(item, str(report.longrepr[2]), None))
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Generator[None, Any, Any]:
    report = yield
    if report.skipped and isinstance(collector, pytest.Module):
        collector.config.stash[_CLAIMS].append(_not_run(collector, str(report.longrepr[2]), None))
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if terminalreporter.verbosity >= 0:
        for entry in terminalreporter.config.stash[_CLAIMS]:
            terminalreporter.write_line(_sentence(entry))


def pytest_sessionfinish(session: pytest.Session) -> None:
    path = session.config.getoption("verify", None)
    if path and not hasattr(session.config, "workerinput"):
        text = json.dumps(session.config.stash[_CLAIMS], indent=1, ensure_ascii=False)
        Path(path).write_text(text + "\n", encoding="utf-8")


def _not_run(node: pytest.Item | pytest.Module, reason: str, verdict: bool | None) -> Entry:
    """A test or file that made no claims: skipped, or broken (verdict False)."""
    entry: Entry = {"claim": node.name.replace("_", " "), "source": "–", "tolerance": None}
    entry |= {"reached": None, "pass": verdict, "expected": 0.0, "unit": ""}
    entry |= {"note": reason.removeprefix("Skipped: "), "table": None, "known_miss": None}
    return entry | {"test": node.nodeid, "about": _about(node.path)}


def _about(path: Path) -> str:
    """The first line of a test file."""
    docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    return (docstring or path.stem).splitlines()[0].rstrip(".")


def _is_wrong(entry: Entry) -> bool:
    return (entry["pass"] is False) != bool(entry["known_miss"])


def _sentence(entry: Entry) -> str:
    reached, expected, allowed = entry["reached"], entry["expected"], entry["tolerance"]
    if reached is None:
        return f"{entry['claim']}: not run, {entry['note']}"
    against = f" instead of {expected:.9g}" if expected else ""
    bound = "" if allowed is None else f", tolerance {allowed:g}"
    known = "; its explanation says that it misses" if entry["known_miss"] else ""
    return f"{entry['claim']}: {float(reached):.9g}{against}{bound}{known}."
