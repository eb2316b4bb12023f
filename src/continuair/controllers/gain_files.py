"""Gains of the paper's law in TOML files: what `design` makes them of, or the gains themselves."""

from __future__ import annotations

import inspect
import os
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from continuair.controllers.controller import Controller
from continuair.controllers.gains import design
from continuair.controllers.servoing import servoing
from continuair.errors import InputError, nearest, shown
from continuair.vehicle import Vehicle

_PRESETS = Path(__file__).parent / "presets"
_DESIGN = {
    name for name in inspect.signature(design).parameters if name not in ("vehicle", "desired")
}
_SERVOING = set(inspect.signature(servoing).parameters)
_RECORD = "record"


@dataclass(frozen=True)
class Gains:
    """Settings of `design` and `servoing` by name, and where they are from."""

    name: str
    settings: dict[str, Any]

    def __post_init__(self) -> None:
        designed = "bandwidth" in self.settings
        known = sorted((_DESIGN | _SERVOING - {"Kp", "Kd", "Cp", "Cd", "Cs", "points"}) if designed
                       else _SERVOING)  # fmt: skip
        for key in self.settings:
            if key not in known:
                raise InputError(f"{self.name}: {key} is not a gain here; {nearest(key, known)}.")
        if not designed and not {"Kp", "Kd"} <= set(self.settings):
            raise InputError(
                f"{self.name}: bandwidth is missing; give it [rad/s], or the gains Kp and Kd."
            )

    def controller(self, vehicle: Vehicle) -> Controller:
        """The paper's law with these gains, designed for the vehicle if they give a bandwidth."""
        designing = {k: v for k, v in self.settings.items() if k in _DESIGN and k != "points"}
        if "bandwidth" not in designing:
            return servoing(**self.settings)
        rest = {k: v for k, v in self.settings.items() if k not in _DESIGN}
        return servoing(**design(vehicle, **designing), **rest)


def gain_presets() -> tuple[str, ...]:
    """Names of the gains that come with the package."""
    return tuple(sorted(path.stem for path in _PRESETS.glob("*.toml")))


def load_gains(name_or_path: str | os.PathLike[str]) -> Gains:
    """Gains of a preset or a TOML file; a table `record` in it is for its reader alone.

    Raises InputError.
    """
    path = Path(name_or_path)
    if str(name_or_path) in gain_presets():
        path = _PRESETS / f"{name_or_path}.toml"
    try:
        settings = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        problem = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"gains is {shown(str(name_or_path))}, which cannot be read ({problem}); use "
            f"{', '.join(gain_presets())}, or give the path of a .toml file."
        ) from None
    settings.pop(_RECORD, None)
    return Gains(str(name_or_path), settings)
