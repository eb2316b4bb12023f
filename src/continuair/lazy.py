"""Names of a package that load on first use, which keeps the import of the package fast."""

from collections.abc import Callable, Iterable
from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def names(
    package: str, homes: "dict[str, Iterable[str]]"
) -> "tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]":
    """Return `__getattr__`, `__dir__` and `__all__` of a package.

    homes: module within the package -> public names that it defines.
    """
    home = {name: module for module, defined in homes.items() for name in defined}

    def get(name: str) -> "Any":
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f"{package}.{home[name]}"), name)

    return get, lambda: sorted(home), sorted(home)
