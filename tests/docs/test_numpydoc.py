"""Public docstrings have numpydoc's sections, as numpydoc's own validation finds them."""

import importlib
import inspect
import pkgutil
from collections.abc import Iterator

import pytest
from numpydoc.validate import validate

import continuair

PACKAGES = [
    "continuair",
    *(f"continuair.{module.name}" for module in pkgutil.iter_modules(continuair.__path__)
      if module.ispkg),
    "continuair.figures.curves",
    "continuair.figures.style",
    "amiri2026",
]  # fmt: skip
CHECKED = ("GL", "SS", "PR", "RT")
# Text begins on the line of the quotes and may end on it.
LEFT_OUT = {"GL01", "GL02"}


def public_names() -> Iterator[str]:
    """Yield the defining path of every public function and class, and of their methods."""
    found: set[str] = set()
    for package in PACKAGES:
        module = importlib.import_module(package)
        for name in getattr(module, "__all__", ()):
            value = getattr(module, name)
            if not (inspect.isfunction(value) or inspect.isclass(value)):
                continue
            if value.__module__.split(".")[0] not in ("continuair", "amiri2026"):
                continue
            path = f"{value.__module__}.{value.__qualname__}"
            found.add(path)
            if inspect.isclass(value):
                for attribute, member in vars(value).items():
                    kinds = (property, classmethod, staticmethod)
                    if attribute.startswith("_"):
                        continue
                    if inspect.isfunction(member) or isinstance(member, kinds):
                        found.add(f"{path}.{attribute}")
    yield from sorted(found)


NAMES = list(public_names())


@pytest.mark.parametrize("name", NAMES)
def test_a_public_docstring_is_valid_numpydoc(name: str) -> None:
    faults = [
        f"{code}: {message}"
        for code, message in validate(name)["errors"]
        if code[:2] in CHECKED and code not in LEFT_OUT
    ]
    assert not faults
