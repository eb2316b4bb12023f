"""A law that always pushes the same, so that a run shows what the rotors make of it."""

# Device code: its annotations are Warp types made at run time, which mypy cannot follow.
# mypy: ignore-errors

from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from continuair.controllers.controller import Controller


def _law(code: Any) -> SimpleNamespace:
    Sense, push, vec3, Bends = code.Sense, code.push, code.vec3, code.Bends

    @wp.struct
    class Gains:
        force: vec3
        moment: vec3

    @wp.func
    def control(sense: Sense, gains: Gains):
        return push(gains.force, gains.moment, Bends())

    return SimpleNamespace(Gains=Gains, control=control)


def constant_push(force: Any, moment: Any, asks: int = 4) -> Controller:
    """Push with a force in world axes [N] and a moment in body axes [N m]."""
    gains = {"force": np.asarray(force, float), "moment": np.asarray(moment, float)}
    return Controller("constant push", _law, gains, looks=False, asks=asks)
