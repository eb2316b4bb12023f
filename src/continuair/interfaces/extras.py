"""Packages that one interface alone needs."""

from importlib.util import find_spec

from continuair.errors import InputError


def require(package: str, extra: str) -> None:
    """Raise InputError, naming the extra that installs it, if a package is not installed."""
    if find_spec(package) is None:
        raise InputError(
            f"{package} is not installed, but this needs it; "
            f"install it with pip install 'continuair[{extra}]'."
        )
