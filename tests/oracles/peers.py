"""Pythons that have another simulator: this one, that of `make bench`, or one made on first use."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

_PEERS = Path(__file__).parents[2] / ".peers"


def python_with(package: str, bench: str, *pip: str) -> str:
    """A Python that has a package; skips the test where it cannot be installed.

    bench: its environment of `make bench`; pip: how it is installed in one of its own.
    """
    if find_spec(package):
        return sys.executable
    for name in (bench, f"{package}_oracle"):
        folder = _PEERS / name
        if (folder / "installed").exists():
            return str(folder / "bin" / "python")
    found = str(folder / "bin" / "python")
    try:
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
        subprocess.run([found, "-m", "pip", "install", "--quiet", "--quiet", *pip], check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"{package} cannot be installed: {error}")
    (folder / "installed").touch()
    return found
