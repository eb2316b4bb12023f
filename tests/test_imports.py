"""What is public, and what device code may not do; import-linter keeps the order of imports."""

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

import continuair.errors

PACKAGE = Path(continuair.errors.__file__).parent


def files() -> Iterator[tuple[str, Path]]:
    """Every file with its dotted name."""
    for path in PACKAGE.rglob("*.py"):
        if path.stem not in ("__init__", "__main__"):
            yield ".".join(path.relative_to(PACKAGE).with_suffix("").parts), path


@pytest.mark.parametrize(
    "package",
    ["continuair", "amiri2026"]
    + [f"continuair.{path.parent.name}" for path in PACKAGE.glob("*/__init__.py")],
)
def test_every_public_name_can_be_reached(package: str) -> None:
    module = import_module(package)
    names = getattr(module, "__all__", [])
    assert not [name for name in names if not hasattr(module, name)]
    assert set(names) <= set(dir(module))
    with pytest.raises(AttributeError):
        module.no_such_name  # noqa: B018


def test_one_module_uses_what_is_private_in_warp() -> None:
    using = [name for name, path in files() if "warp._src" in path.read_text(encoding="utf-8")]
    assert using == ["engine.law_reading"]


def test_what_is_static_in_device_code_is_so_when_it_is_defined() -> None:
    """Warp takes the value of wp.static(…) into a module's name in the cache only where it is known
    at once: one of a loop's variable is not, so that another process would compile the module anew,
    and a changed value might not be noticed."""
    late = []
    device = (PACKAGE / room for room in ("device", "kernels", "sections", "terms"))
    for path in sorted(path for room in device for path in room.rglob("*.py")):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                loops = set(names_of_loops(function))
                late += [
                    f"{path.name}:{call.lineno}"
                    for call in static_calls(function)
                    if any(isinstance(n, ast.Name) and n.id in loops for n in ast.walk(call))
                ]
    assert not late, f"wp.static of a loop's variable in {', '.join(late)}"


def names_of_loops(function: ast.FunctionDef) -> Iterator[str]:
    """Variables of the loops of a function of the device."""
    decorated = {ast.unparse(each) for each in function.decorator_list}
    if any(name.startswith(("wp.func", "wp.kernel")) for name in decorated):
        for node in ast.walk(function):
            if isinstance(node, ast.For):
                yield from (name.id for name in ast.walk(node.target) if isinstance(name, ast.Name))


def static_calls(function: ast.FunctionDef) -> Iterator[ast.Call]:
    """Calls wp.static(…) in it."""
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "wp.static":
            yield node
