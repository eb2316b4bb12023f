"""Only an arc's own files know that it has two coordinates."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import continuair.errors

PACKAGE = Path(continuair.errors.__file__).parent
OF_ARCS = ("sections/arc/", "vehicle/arc.py")
DEVICE = ("device", "kernels", "sections", "terms")
COUNTS = re.compile(r"\b(sections?|arcs?|coordinate|n_sections)\b")
"""What a number of sections, or the index of one or of a coordinate, is called."""


def doublings(path: Path) -> Iterator[str]:
    """Where a file multiplies or divides a number of sections by 2, or device code an index."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    device = path.relative_to(PACKAGE).parts[0] in DEVICE
    in_brackets = {
        id(node)
        for each in ast.walk(tree)
        if isinstance(each, ast.Subscript)
        for node in ast.walk(each.slice)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.FloorDiv, ast.Mod)):
            two, other = sorted((node.left, node.right), key=lambda side: not is_two(side))
            halved = device and isinstance(node.op, ast.FloorDiv) and id(node) in in_brackets
            if is_two(two) and (halved or COUNTS.search(ast.unparse(other))):
                yield f"{path.relative_to(PACKAGE)}:{node.lineno}: {ast.unparse(node)}"


def is_two(node: ast.expr) -> bool:
    """Whether it is the number 2."""
    return isinstance(node, ast.Constant) and node.value == 2 and isinstance(node.value, int)


@pytest.mark.long
def test_nothing_else_counts_two_coordinates_of_a_section() -> None:
    paths = sorted(PACKAGE.rglob("*.py"))
    wrong = [
        where
        for path in paths
        if not path.relative_to(PACKAGE).as_posix().startswith(OF_ARCS)
        for where in doublings(path)
    ]
    assert not wrong, "\n".join(wrong)
