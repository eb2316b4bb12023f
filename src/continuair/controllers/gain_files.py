"""Gains of the paper's law in TOML files: settings of `design`, or the gains themselves."""

from __future__ import annotations

import inspect
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from continuair.controllers.controller import Controller
from continuair.controllers.gains import design
from continuair.controllers.servoing import servoing
from continuair.errors import InputError, nearest
from continuair.files import Presets
from continuair.vehicle.vehicle import Vehicle

_PRESETS = Presets("gains", Path(__file__).parent / "presets")
_DESIGN = {
    name for name in inspect.signature(design).parameters if name not in ("vehicle", "desired")
}
_SERVOING = set(inspect.signature(servoing).parameters) - {"arms"}
_GAINS = {"Kp", "Kd", "Cp", "Cd", "Cs", "points"}
_RECORD = "record"

Settings: TypeAlias = dict[str, Any]
"""Keyword arguments of `design` and `servoing`."""


@dataclass(frozen=True)
class Gains:
    """Settings of the paper's law by name, as a gain file holds them.

    Parameters
    ----------
    name : str
        Name of the preset, or path of the file.
    settings : dict
        Keyword arguments of `design` and `servoing`.

    Raises
    ------
    InputError
        If a name is unknown, or neither `bandwidth` nor `Kp` and `Kd` are given.
    """

    name: str
    settings: Settings

    def __post_init__(self) -> None:
        # Without Kp a file can only mean a design, and only its keys are known.
        known = sorted(_SERVOING if "Kp" in self.settings else _DESIGN | _SERVOING - _GAINS)
        for key in self.settings:
            if key not in known:
                raise InputError(key, "is not a gain here", nearest(key, known)).located(self.name)
        if not self.settings.keys() & {"bandwidth", "Kp"}:
            raise InputError(
                "bandwidth", "is missing", "give it [rad/s], or the gains Kp and Kd"
            ).located(self.name)
        if "Kp" in self.settings and "Kd" not in self.settings:
            raise InputError("Kd", "is missing", "give it beside Kp").located(self.name)

    @property
    def constant(self) -> bool:
        """Whether the gains are constant, designed for the desired image."""
        return self.settings.get("gains", "constant") == "constant"

    @property
    def as_printed(self) -> bool:
        """Whether the law is that of the paper's proof: constant gains, no integral."""
        return self.constant and not self.settings.get("integral")

    def controller(self, vehicle: Vehicle) -> Controller:
        """Return the paper's law with these gains.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle for which the gains are designed, if a bandwidth is given.

        Returns
        -------
        Controller
            The controller of one run.

        Raises
        ------
        InputError
            If `design` or `servoing` refuses a setting.
        """
        designing = {k: v for k, v in self.settings.items() if k in _DESIGN and k != "points"}
        if "bandwidth" not in designing:
            return servoing(**self.settings)
        rest = {k: v for k, v in self.settings.items() if k not in _DESIGN}
        return servoing(**design(vehicle, **designing), **rest)


def gain_presets() -> tuple[str, ...]:
    """Return the names of the gains that come with the package."""
    return _PRESETS.names()


def load_gains(name_or_path: str | os.PathLike[str]) -> Gains:
    """Load gains of a preset or a TOML file.

    Parameters
    ----------
    name_or_path : str or path-like
        Name of a preset, or path of a TOML file. Its table `record`, if any, is ignored.

    Returns
    -------
    Gains
        The settings.

    Raises
    ------
    InputError
        If there is no such preset or file, or its content is not valid.
    """
    file, settings = _PRESETS.read(name_or_path)
    settings.pop(_RECORD, None)
    return Gains(str(name_or_path) if name_or_path in gain_presets() else file, settings)
