"""Laws that push with one thing each, so that a run's first command shows what the device does."""

# Device code: its annotations are Warp types made at run time, which mypy cannot follow.
# mypy: ignore-errors

import math
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from continuair.controllers.controller import Controller


def _wrench_law(code: Any) -> SimpleNamespace:
    Twist, Sense, camera_push = code.Twist, code.Sense, code.camera_push

    @wp.struct
    class Gains:
        wrench: Twist

    @wp.func
    def control(sense: Sense, gains: Gains):
        return camera_push(sense, gains.wrench)

    return SimpleNamespace(Gains=Gains, control=control)


def _image_law(code: Any) -> SimpleNamespace:
    Image, Sense = code.Image, code.Sense
    camera_push, interaction = code.camera_push, code.interaction

    @wp.struct
    class Gains:
        weights: Image

    @wp.func
    def control(sense: Sense, gains: Gains):
        return camera_push(sense, wp.transpose(interaction(sense.sight)) * gains.weights)

    return SimpleNamespace(Gains=Gains, control=control)


def _weight_law(code: Any) -> SimpleNamespace:
    Real, Sense = code.Real, code.Sense

    @wp.struct
    class Gains:
        weight: Real
        spring: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return gains.weight * sense.weight + gains.spring * sense.spring

    return SimpleNamespace(Gains=Gains, control=control)


def _failing_law(code: Any) -> SimpleNamespace:
    Real, Sense, push, vec3, Bends = code.Real, code.Sense, code.push, code.vec3, code.Bends

    @wp.struct
    class Gains:
        end: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        force = vec3(wp.sqrt(gains.end - sense.time), Real(0.0), Real(0.0))
        return sense.weight + push(force, vec3(), Bends())

    return SimpleNamespace(Gains=Gains, control=control)


TENTH = 0.1


def rounding_law(kind: str) -> Any:
    """A law with a number that loses digits: of its own, in a function, named, reckoned, of a
    fraction, a default, or in a vector."""

    def law(code: Any) -> SimpleNamespace:
        Real, Push, Sense = code.Real, code.Push, code.Sense

        @wp.func
        def written(push: Push):
            return Real(0.3) * push

        @wp.func
        def named(push: Push):
            return Real(TENTH) * push

        @wp.func
        def of_module(push: Push):
            return Real(math.pi) * push

        @wp.func
        def reckoned(push: Push):
            return Real(1.0 / 10.0) * push

        @wp.func
        def whole(push: Push):
            return Real(1 / 10) * push

        tenths = 3

        @wp.func
        def whole_name(push: Push):
            return Real(tenths / 10) * push

        @wp.func
        def counted(push: Push):
            share = Real(0)
            for i in range(3):
                share = share + Real(i / 10)
            return share * push

        @wp.func
        def cast(push: Push):
            return Real(float(1) / float(3)) * push

        single = wp.float32(TENTH)

        @wp.func
        def of_type(push: Push):
            return Real(single) * push

        fraction = Real(Fraction(1, 3))

        @wp.func
        def of_fraction(push: Push):
            return fraction * push

        @wp.func
        def added(push: Push):
            return Real((1 + 2) / 2) * push

        @wp.func
        def shortened(push: Push):
            share = 1
            share /= 2
            return Real(share) * push

        @wp.func
        def quarter(i: int):
            return Real((i + 1) / 4)

        @wp.func
        def helped(push: Push):
            return quarter(2) * push

        listed = [Real(TENTH), Real(0.7)]

        @wp.func
        def looped(push: Push):
            share = Real(0)
            for i in range(2):
                share = share + wp.static(listed[i])
            return share * push

        @wp.func
        def large(push: Push):
            return Real(5000000000) * push

        @wp.func
        def scaled(push: Push, by: Real = fraction):
            return by * push

        goal = code.vec3(TENTH, 0.0, 0.0)

        @wp.func
        def vector(push: Push):
            return goal[0] * push

        @wp.func
        def static(push: Push):
            return wp.static(code.vec3(TENTH, 0.0, 0.0))[0] * push

        third, up = Real(np.float64(0.3)), code.vec3(0.0, 0.0, 1.0)

        @wp.func
        def fine(push: Push):
            made = code.vec3(third, Real(-0.25), third)
            TENTH = made[0] + made[1]
            return TENTH * up[2] * push

        kinds = (
            *(written, named, of_module, reckoned, whole, whole_name, counted, cast, of_type),
            *(of_fraction, added, shortened, helped, looped, large, scaled, vector, static, fine),
        )
        changed = {each.func.__name__: each for each in kinds}[kind]

        @wp.struct
        class Gains:
            idle: Real

        @wp.func
        def control(sense: Sense, gains: Gains):
            return Real(0.5) * changed(sense.weight)

        return SimpleNamespace(Gains=Gains, control=control)

    return law


def _recording_law(code: Any) -> SimpleNamespace:
    Push, Sense = code.Push, code.Sense

    @wp.struct
    class Gains:
        idle: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        push = Push()
        for i in range(8):
            push[i] = sense.sight.image[i]
        return push

    return SimpleNamespace(Gains=Gains, control=control)


def wrench_on_camera(wrench: Any) -> Controller:
    """Push as J_cᵀ wrench."""
    return Controller("wrench", _wrench_law, {"wrench": np.asarray(wrench, float)})


def along_image(weights: Any) -> Controller:
    """Push as J_Lᵀ weights."""
    return Controller("image", _image_law, {"weights": np.asarray(weights, float)})


def carried(weight: float, spring: float) -> Controller:
    """Push as the parts of G."""
    return Controller("G", _weight_law, {"weight": weight, "spring": spring}, looks=False)


def _braking_law(code: Any) -> SimpleNamespace:
    Sense, camera_push = code.Sense, code.camera_push

    @wp.struct
    class Gains:
        damping: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return sense.weight + camera_push(sense, -gains.damping * sense.camera_twist)

    return SimpleNamespace(Gains=Gains, control=control)


def braking(damping: float) -> Controller:
    """Push the camera against its own twist."""
    return Controller("brake", _braking_law, {"damping": damping}, looks=False)


def undefined_from(end: float) -> Controller:
    """Push by the root of the time that is left [s] in newtons, no number once none is."""
    return Controller("root", _failing_law, {"end": end}, looks=False)


def recorded_image() -> Controller:
    """Log what the camera reports of four points in place of a push (N as normalised image)."""
    return Controller("recorder", _recording_law, {"idle": 0.0})
