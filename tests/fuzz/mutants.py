"""Changes one operation of the code at a time and asks whether the short tests notice.

python -m tests.fuzz.mutants --count 60 --seed 1 --out mutants.jsonl

Each mutant is tried in a copy of the tracked files. A line per mutant is added to the file; those
that are there already are not tried again.
"""

from __future__ import annotations

import argparse
import ast
import copy
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PLACES = ("kernels", "flight", "terms", "sections", "analysis/metrics.py", "analysis/balance.py")
"""Folders and files that mutants change, below src/continuair."""

FIRST = ("physics", "equations", "terms", "sections", "kernels", "test_metrics.py")
"""Tests that run first, as they are likely to notice."""

SHORT = "not (long or slow or soak)"
OTHER: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}
REVERSED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.Gt,
    ast.Gt: ast.Lt,
    ast.LtE: ast.GtE,
    ast.GtE: ast.LtE,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}


@dataclass(frozen=True)
class Mutant:
    """A change of a file: the text from one position to another is replaced."""

    file: str
    line: int
    before: str
    after: str
    start: int
    end: int

    def applied(self, source: str) -> str:
        return source[: self.start] + self.after + source[self.end :]


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield every mutant of a file: an operator, a comparison, a sign or a number."""
    source = path.read_text(encoding="utf-8")
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line.encode()))
    raw = source.encode()
    for node in _of_functions(ast.parse(source)):
        for changed in _changes(node):
            assert isinstance(node, ast.expr) and node.end_lineno and node.end_col_offset
            first = starts[node.lineno - 1] + node.col_offset
            last = starts[node.end_lineno - 1] + node.end_col_offset
            begin = len(raw[:first].decode())
            before = raw[first:last].decode()
            yield Mutant(
                str(path.relative_to(ROOT)), node.lineno, before, f"({ast.unparse(changed)})",
                begin, begin + len(before),
            )  # fmt: skip


def _of_functions(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the nodes in bodies of functions, but for messages and annotations."""
    inside: list[ast.AST] = [
        statement
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for statement in function.body
        if not isinstance(statement, ast.FunctionDef)
    ]
    while inside:
        node = inside.pop()
        if isinstance(node, (ast.Raise, ast.JoinedStr, ast.FunctionDef, ast.ClassDef)):
            continue
        yield node
        held = [value for name, value in ast.iter_fields(node) if name != "annotation"]
        for value in held:
            each = value if isinstance(value, list) else [value]
            inside += [child for child in each if isinstance(child, ast.AST)]


def _changes(node: ast.AST) -> Iterator[ast.expr]:
    if isinstance(node, ast.BinOp) and type(node.op) in OTHER:
        changed = copy.copy(node)
        changed.op = OTHER[type(node.op)]()
        yield changed
    elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in REVERSED:
        reversed_ = copy.copy(node)
        reversed_.ops = [REVERSED[type(node.ops[0])]()]
        yield reversed_
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield node.operand
    elif isinstance(node, ast.Constant) and type(node.value) is float and node.value:
        yield ast.Constant(1.1 * node.value)


def tried(mutant: Mutant, folder: Path, workers: int) -> dict[str, object]:
    """Return whether the short tests notice a mutant, and the first one that does."""
    target = folder / mutant.file
    whole = target.read_text(encoding="utf-8")
    target.write_text(mutant.applied(whole), encoding="utf-8")
    began, noticed = time.monotonic(), ""
    try:
        for tests in ([f"tests/{each}" for each in FIRST], ["tests"]):
            noticed = _failing(tests, folder, workers)
            if noticed:
                break
    finally:
        target.write_text(whole, encoding="utf-8")
    return {"noticed": noticed, "seconds": round(time.monotonic() - began)}


def _failing(tests: list[str], folder: Path, workers: int) -> str:
    """Return the first test that fails, or nothing."""
    command = [
        sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider", "-n",
        str(workers), "--dist", "loadfile", "-m", SHORT, *tests,
    ]  # fmt: skip
    around = os.environ | {"PYTHONPATH": str(folder / "src"), "OMP_NUM_THREADS": "1"}
    ended = subprocess.run(
        command, cwd=folder, env=around, capture_output=True, text=True, check=False
    )
    if ended.returncode == 0:
        return ""
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", ended.stdout, re.MULTILINE)
    return found.group(1) if found else f"exit code {ended.returncode}"


def main() -> None:
    parser = argparse.ArgumentParser(description="Do the short tests notice changes of the code?")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    asked = parser.parse_args()
    package = ROOT / "src" / "continuair"
    files = [path for place in PLACES for path in
             (sorted((package / place).rglob("*.py")) or [package / place])]  # fmt: skip
    everything = [mutant for path in files for mutant in mutants_of(path)]
    chosen = random.Random(asked.seed).sample(everything, asked.count)
    known = asked.out.read_text(encoding="utf-8").splitlines() if asked.out.exists() else []
    results = [json.loads(line) for line in known]
    done = {(each["file"], each["line"], each["after"]) for each in results}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        listed = subprocess.run(
            ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
        )
        for each in listed.stdout.splitlines():
            (folder / each).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / each, folder / each)
        for number, mutant in enumerate(chosen, 1):
            told = {"file": mutant.file, "line": mutant.line, "before": mutant.before,
                    "after": mutant.after}  # fmt: skip
            if (mutant.file, mutant.line, mutant.after) in done:
                continue
            found = told | tried(mutant, folder, asked.workers)
            results.append(found)
            with asked.out.open("a", encoding="utf-8") as out:
                out.write(json.dumps(found) + "\n")
            print(f"{number} of {len(chosen)}: {mutant.file}:{mutant.line} {mutant.before!r} -> "
                  f"{mutant.after!r}: {found['noticed'] or 'SURVIVED'}", flush=True)  # fmt: skip
    noticed = sum(bool(each["noticed"]) for each in results)
    print(f"{noticed} of {len(results)} mutants were noticed.")


if __name__ == "__main__":
    main()
