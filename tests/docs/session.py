"""Does what a reader of a page does, block by block: python session.py PAGE."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

_STEP = re.compile(r"^```(python|toml|console)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_TOLERANCE = 0.02
"""Share by which a printed number may differ from that on the page."""


def main(page: str) -> None:
    names: dict[str, Any] = {"__name__": "__main__"}
    for number, (kind, block) in enumerate(_STEP.findall(Path(page).read_text(encoding="utf-8"))):
        if kind == "python":
            source = Path(f"block_{number}.py")  # device code is read from its file
            source.write_text(block, encoding="utf-8")
            exec(compile(block, source, "exec"), names)
        elif kind == "toml":
            write(block)
        else:
            run(*block.splitlines())


def write(block: str) -> None:
    """Write a file, whose first line says its name."""
    name = re.match(r"# (\S+\.toml)\n", block)
    assert name, f"no name in {block.splitlines()[0]}"
    Path(name[1]).write_text(block, encoding="utf-8")


def run(command: str, *shown: str) -> None:
    """Run a command, and look for the lines that the page shows of its output, in turn."""
    arguments = command.removeprefix("$ continuair ").split()
    told = subprocess.run(
        [sys.executable, "-m", "continuair", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=True,
    ).stdout
    lines = iter([words(line) for line in told.splitlines()])
    for line in shown:
        if words(line) and line != "..." and not any(alike(words(line), each) for each in lines):
            sys.exit(f"{command}: {line!r} is not what was printed:\n{told}")


def words(line: str) -> list[str]:
    return [word for word in line.split() if set(word) - set("─│")]


def alike(shown: list[str], told: list[str]) -> bool:
    return len(shown) == len(told) and all(map(same, shown, told))


def same(shown: str, told: str) -> bool:
    a, b = number(shown), number(told)
    return shown == told if a is None or b is None else abs(a - b) <= _TOLERANCE * abs(b)


def number(word: str) -> float | None:
    """The number that a word is, with what may stand behind it."""
    found = re.fullmatch(r"\(?(-?\d+(?:\.\d+)?(?:e-?\d+)?)[%,.)]*", word)
    return float(found[1]) if found else None


if __name__ == "__main__":
    main(sys.argv[1])
