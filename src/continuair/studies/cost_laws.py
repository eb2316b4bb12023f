"""Laws that stop short of control, so that the cost of what they do can be told apart."""

from types import SimpleNamespace

import warp as wp

from continuair.controllers.controller import Controller


def _carry(code: SimpleNamespace) -> SimpleNamespace:
    Sense = code.Sense

    @wp.struct
    class Gains:
        nothing: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return sense.weight

    return SimpleNamespace(Gains=Gains, control=control)


def _look(code: SimpleNamespace) -> SimpleNamespace:
    Sense = code.Sense

    @wp.struct
    class Gains:
        nothing: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        push = sense.weight
        # The image has to be computed, but must not act.
        push[0] += gains.nothing * wp.dot(sense.sight.image, sense.desired)
        return push

    return SimpleNamespace(Gains=Gains, control=control)


CARRY = Controller("carry the weight", _carry, {"nothing": 0.0}, looks=False)
"""Carries the weight and sees nothing."""

LOOK = Controller("look", _look, {"nothing": 0.0})
"""Carries the weight and has the camera's image, which it does not use."""
