"""Names of a package that load on first use: importing the package itself stays light."""

from collections.abc import Callable, Iterable
from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def names(
    package: str, homes: "dict[str, Iterable[str]]"
) -> "tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]":
    """Return `__getattr__`, `__dir__` and `__all__` of a package whose names its modules define.

    homes: the names of each module, by the module's name within the package.
    """
    home = {name: module for module, defined in homes.items() for name in defined}

    def get(name: str) -> "Any":
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f"{package}.{home[name]}"), name)

    return get, lambda: sorted(home), sorted(home)
