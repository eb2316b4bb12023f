"""Public docstrings pass numpydoc's validation, and public signatures name their types."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from typing import Any, get_args, get_origin

from numpydoc.validate import Validator, validate
from pydantic import BaseModel

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


def test_public_docstrings_are_valid_numpydoc() -> None:
    faults = [
        f"{name}: {code}: {message}"
        for name in NAMES
        for code, message in validate(name)["errors"]
        if code[:2] in CHECKED and code not in LEFT_OUT
    ]
    assert len(NAMES) > 300 and not faults


def names_any(annotation: object) -> bool:
    """Return whether an annotation, as text or as a type, contains `Any`."""
    if isinstance(annotation, str):
        return re.search(r"\bAny\b", annotation) is not None
    if isinstance(annotation, list):
        return any(map(names_any, annotation))
    origin = get_origin(annotation)
    # NumPy's own types of arrays leave open what shapes they have.
    if getattr(origin, "__module__", "").partition(".")[0] == "numpy":
        return False
    return annotation is Any or any(map(names_any, get_args(annotation)))


def annotations_of(value: Any) -> dict[str, object]:
    """Return the annotations of a function, a property, or what makes an instance of a class."""
    if isinstance(value, property):
        value = value.fget
    if isinstance(value, type) and issubclass(value, BaseModel):
        return {name: field.annotation for name, field in value.model_fields.items()}
    signature = inspect.signature(value)
    found = {name: each.annotation for name, each in signature.parameters.items()}
    return found | {"return": signature.return_annotation}


def test_public_signatures_name_their_types() -> None:
    untold = []
    for name in NAMES:
        value = Validator._load_obj(name)
        if isinstance(value, type) and issubclass(value, Warning):
            continue  # made by Python, which has no signature for it
        untold += [
            f"{name}: {each}"
            for each, annotation in annotations_of(value).items()
            if names_any(annotation)
        ]
    assert not untold
