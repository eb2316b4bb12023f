"""Laws that do only part of the control, to separate the costs of the parts."""

from types import SimpleNamespace

import warp as wp

from continuair.kernels import LawCode


def carry(code: LawCode) -> SimpleNamespace:
    """Return a law that compensates the weight and uses no image."""
    Sense = code.Sense

    @wp.struct
    class Gains:
        nothing: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return sense.weight

    return SimpleNamespace(Gains=Gains, control=control)


def look(code: LawCode) -> SimpleNamespace:
    """Return a law that compensates the weight and computes the image, without using it."""
    Sense, push, Bends, vec3 = code.Sense, code.push, code.Bends, code.vec3

    @wp.struct
    class Gains:
        nothing: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        # The image has to be computed, but must not act.
        nothing = gains.nothing * wp.dot(sense.sight.image, sense.desired)
        return sense.weight + nothing * push(vec3(), vec3(), Bends())

    return SimpleNamespace(Gains=Gains, control=control)
