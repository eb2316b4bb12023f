"""Laws that do only part of the control, to separate the costs of the parts."""

from types import SimpleNamespace

import warp as wp

from continuair.kernels import LawCode


def carry(code: LawCode) -> SimpleNamespace:
    """Return carries the weight and sees nothing."""
    Sense = code.Sense

    @wp.struct
    class Gains:
        nothing: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return sense.weight

    return SimpleNamespace(Gains=Gains, control=control)


def look(code: LawCode) -> SimpleNamespace:
    """Return carries the weight and has the camera's image, which it does not use."""
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
