"""Completions of the Tab key; where there are none, shells complete paths themselves.

Every key press starts a process, so that nothing heavy is imported here.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]


def preset_vehicles(incomplete: str) -> list[str]:
    """Return names of the vehicles that come with the package."""
    return _presets(_PACKAGE, incomplete)


def vehicles(incomplete: str) -> list[str]:
    """Return names of the vehicles that come with the package, and .toml files of this folder."""
    return preset_vehicles(incomplete) + _files(incomplete)


def flights(incomplete: str) -> list[str]:
    """Return results and folders of this folder, and vehicles."""
    folders = sorted(f"{path.name}/" for path in Path().iterdir() if path.is_dir())
    found = [name for name in folders if name.startswith(incomplete)]
    return _files(incomplete, ".nc") + found + vehicles(incomplete)


def complete_gains(incomplete: str) -> list[str]:
    """Return completions of --gains.

    Parameters
    ----------
    incomplete : str
        The text typed so far.

    Returns
    -------
    list of str
        Names of the gains that come with the package, and .toml files of the current folder.
    """
    return _presets(_PACKAGE / "controllers", incomplete) + _files(incomplete)


def _presets(room: Path, start: str) -> list[str]:
    names = sorted(path.stem for path in (room / "presets").glob("*.toml"))
    return [name for name in names if name.startswith(start)]


def _files(start: str, suffix: str = ".toml") -> list[str]:
    return sorted(path.name for path in Path().glob(f"*{suffix}") if path.name.startswith(start))
