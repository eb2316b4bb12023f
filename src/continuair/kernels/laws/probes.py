"""Laws that stop short of control, so that the cost of what they do can be told apart."""

from types import SimpleNamespace

import warp as wp


def carry(code: SimpleNamespace) -> SimpleNamespace:
    Sense = code.Sense

    @wp.struct
    class Gains:
        nothing: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return sense.weight

    return SimpleNamespace(Gains=Gains, control=control)


def look(code: SimpleNamespace) -> SimpleNamespace:
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
