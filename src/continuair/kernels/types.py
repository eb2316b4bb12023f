"""Warp types of one precision and number of sections, and the parts of a state by name."""

from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import warp as wp

from continuair.vehicle.layout import Layout

MOMENTS = ("alpha", "beta", "P", "Q", "S", "KP", "KQ", "KW", "NP", "ND")
"""Moment functions of an arm (engine/moments.py), in the order in which device code reads them."""


def holding(kind: type, found: dict[str, Any]) -> Any:
    """A namespace of that kind, its fields taken from what a factory has made, by name."""
    return kind(**{field.name: found[field.name] for field in fields(kind)})


@dataclass(frozen=True)
class Types:
    """Types, and functions of a `State` y and of a `Push`, what actuators do.

    y holds, as `Layout` orders it, position, attitude, b, world velocity, ω and ḃ. A push is
    push_of(force, moment, bend): world axes [N], body axes [N m], bend moments [N m²].
    """

    layout: Layout
    Real: Any
    vec2: Any
    vec3: Any
    vec4: Any
    mat33: Any
    quat: Any
    Row: Any
    State: Any
    Push: Any
    Plant: Any
    position_of: Any
    attitude_of: Any
    bend_of: Any
    velocity_of: Any
    spin_of: Any
    bend_rate_of: Any
    state_of: Any
    load_state: Any
    three_of: Any
    push_of: Any
    force_of: Any
    moment_of: Any
    bend_moment_of: Any


@cache
def device_types(precision: str, sections: int) -> Types:
    """The types for "float64" or "float32" and one section."""
    if sections != 1:
        raise NotImplementedError(f"kernels for {sections} sections")
    layout = Layout(sections)
    Real = getattr(wp, precision)
    vec2, vec3 = wp.types.vector(2, Real), wp.types.vector(3, Real)
    vec4, mat33 = wp.types.vector(4, Real), wp.types.matrix((3, 3), Real)
    quat = wp.types.quaternion(Real)
    Row, State = wp.types.vector(len(MOMENTS), Real), wp.types.vector(layout.state, Real)
    Push = wp.types.vector(layout.push.stop, Real)
    width, bends = layout.state, layout.bends
    P, Q, B = layout.position.start, layout.attitude.start, layout.bend.start
    V, W, DB = layout.velocity.start, layout.angular_velocity.start, layout.bend_rate.start
    F, M, BM = layout.force.start, layout.moment.start, layout.bend_moment.start

    @wp.struct
    class Plant:
        """A vehicle, bends in units of the kernels; lever: of the mount, horizontal part."""

        mass: Real
        arm_mass: Real
        uav_mass: Real
        unit: Real
        stiffness: Real
        damping: Real
        threshold: Real
        mount: vec3
        lever: vec3
        inertia: mat33
        uav_inertia: mat33

    @wp.func
    def position_of(y: State):
        return vec3(y[P], y[P + 1], y[P + 2])

    @wp.func
    def attitude_of(y: State):
        return quat(y[Q], y[Q + 1], y[Q + 2], y[Q + 3])

    @wp.func
    def bend_of(y: State):
        return vec2(y[B], y[B + 1])

    @wp.func
    def velocity_of(y: State):
        return vec3(y[V], y[V + 1], y[V + 2])

    @wp.func
    def spin_of(y: State):
        return vec3(y[W], y[W + 1], y[W + 2])

    @wp.func
    def bend_rate_of(y: State):
        return vec2(y[DB], y[DB + 1])

    @wp.func
    def state_of(p: vec3, q: quat, b: vec2, v: vec3, w: vec3, db: vec2):
        """A state, or its rate, from its parts."""
        return State(
            p[0], p[1], p[2], q[0], q[1], q[2], q[3], b[0], b[1],
            v[0], v[1], v[2], w[0], w[1], w[2], db[0], db[1],
        )  # fmt: skip

    @wp.func
    def load_state(rows: wp.array2d(dtype=Real), run: int, unit: Real):
        y = State()
        for j in range(width):
            y[j] = rows[run, j]
        for j in range(bends):
            y[B + j] = y[B + j] * unit
            y[DB + j] = y[DB + j] * unit
        return y

    @wp.func
    def three_of(rows: wp.array3d(dtype=Real), row: int, run: int, first: int):
        """Three columns from the first on."""
        return vec3(rows[row, run, first], rows[row, run, first + 1], rows[row, run, first + 2])

    @wp.func
    def push_of(force: vec3, moment: vec3, bend: vec2):
        return Push(force[0], force[1], force[2], moment[0], moment[1], moment[2], bend[0], bend[1])

    @wp.func
    def force_of(push: Push):
        return vec3(push[F], push[F + 1], push[F + 2])

    @wp.func
    def moment_of(push: Push):
        return vec3(push[M], push[M + 1], push[M + 2])

    @wp.func
    def bend_moment_of(push: Push):
        return vec2(push[BM], push[BM + 1])

    return holding(Types, locals())
