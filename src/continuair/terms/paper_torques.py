"""The paper's generalised forces, conjugate to Euler angles, and to κ and ψa on signed branches."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import FULL_LENGTH, Tree, device_types
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.term_sum import Acting
from continuair.sections.arc.bend import bend_code
from continuair.terms.term import CasadiModel, Term
from continuair.vehicle.layout import PAPER

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class PaperTorques(Term):
    """Torques of `Scenario.tau`, conjugate to the paper's angles; zero without it."""

    differentiable: ClassVar[bool] = True
    has_power: ClassVar[bool] = False
    stiff: ClassVar[bool] = False

    def device(self, code: Device) -> Acting:
        """Return the device functions of the torques.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on UAV and bends, and the error estimate ``misdirected``.
        """
        load, misdirected = _load(code.numbers, code.tree)
        return Acting(on_uav=load, misdirected=misdirected)

    def casadi(self, model: CasadiModel) -> "SX":
        """Return no force: the model in CasADi has no such input.

        Parameters
        ----------
        model : CasadiModel
            The symbolic vehicle.

        Returns
        -------
        SX, shape (6 + 2 N, 1)
            Zeros.
        """
        return model.none


def _load(numbers: Numbers, tree: Tree) -> tuple[Any, Any]:
    types, code, flight = (
        device_types(numbers, tree),
        number_code(numbers),
        flight_code(numbers, tree),
    )
    Load, Flight = load_code(numbers, tree).Load, flight.Flight
    above, finite, of_row = code.above, code.finite, code.of_row
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    vec2, vec3, quat, layout = types.vec2, types.vec3, types.quat, types.layout
    two_of, tilt_of, attitude_of = types.two_of, types.tilt_of, types.attitude_of
    three_of, sections, arcs = types.three_of, layout.sections, bend_code(numbers, tree)
    count, section_of, first_of = arcs.count, arcs.section_of, arcs.first_of
    bend_of, angle_at, plus_pair = arcs.bend_of, arcs.angle_at, arcs.plus_pair
    euler, polar = layout.of_input["euler_torque"].start, layout.of_input["polar_torque"].start
    zero, one, two, full = Real(0.0), Real(1.0), Real(2.0), Real(FULL_LENGTH)
    # Cosine of the largest turn of a bend in a followed step, and largest sine of a planar motion.
    clear, planar = Real(0.5), Real(1e-6)
    # Steps that pass gimbal lock count as near it. RK4 then resolves 1/cos θ to 1e-3.
    near = Real(0.25)

    @wp.func
    def euler_torque_to_body(q: quat, torque: vec3, roll: vec2):
        """Return the body moment E^{-T} τ of torques τ conjugate to ZYX Euler rates.

        roll: (cos φ, sin φ) on the followed branch, which determines the sign of cos θ.
        """
        x = wp.quat_rotate_inv(q, vec3(zero, zero, one))
        cos_pitch = wp.sqrt(x[1] * x[1] + x[2] * x[2])
        cos_pitch = above(zero, x[2] * roll[0] + x[1] * roll[1], -cos_pitch, cos_pitch)
        sin_roll = x[1] / cos_pitch
        cos_roll = x[2] / cos_pitch
        # The third row of R is (-sin θ, sin φ cos θ, cos φ cos θ).
        shared = (torque[2] - x[0] * torque[0]) / cos_pitch
        return vec3(
            torque[0],
            cos_roll * torque[1] + sin_roll * shared,
            -sin_roll * torque[1] + cos_roll * shared,
        )

    @wp.func
    def polar_to_bend(b: vec2, branch: vec2, threshold: Real, along: Real, around: Real):
        """Return the force on the bend of Q_κ and Q_ψa (per λ); κ_s limits Q_ψa/κ only.

        branch: (cos ψa, sin ψa) of the followed signed branch; Q_κ acts along it. At bend 0 without
        a threshold the force of Q_ψa is not finite, and the run stops.
        """
        size = wp.length(b)
        n = one / above(size, zero, size, one)
        x = above(size, zero, n * b[0], branch[0])
        y = above(size, zero, n * b[1], branch[1])
        pushed = above(zero, x * branch[0] + y * branch[1], -along, along) * vec2(x, y)
        scaled = wp.max(size, threshold)
        turning = above(wp.abs(around), zero, around / scaled, zero)
        return pushed + turning * vec2(-y, x)

    @wp.func
    def polar_load(y: State, along: Along, flight: Flight, row: int, section: int):
        """Return the load of the paper's torques on the bend of a section."""
        unit = flight.plant.unit[first_of(section)]
        threshold = flight.plant.threshold[section]
        pushed = of_row(flight.inputs, row, flight.run, polar + first_of(section))
        around = unit * of_row(flight.inputs, row, flight.run, polar + angle_at(section))
        b = bend_of(y, section)
        return polar_to_bend(b, two_of(along, section), threshold, pushed, around) / unit

    @wp.func
    def torques(y: State, along: Along, flight: Flight, row: int):
        out = Load()
        torque = three_of(flight.inputs, row, flight.run, euler)
        size = wp.length_sq(torque)
        moment = euler_torque_to_body(attitude_of(y), torque, two_of(along, sections))
        for j in range(3):
            # Zero torque gives zero moment, also at a pitch of ±π/2.
            out.moment[j] = above(size, zero, moment[j], zero)
        for k in range(count):
            i = section_of(k)
            out.bend = plus_pair(out.bend, i, polar_load(y, along, flight, row, i))
        return out

    @wp.func
    def side_of(found: vec2, branch: vec2):
        """Return -1 where κ or cos θ is negative on the branch, else 1."""
        return above(zero, wp.dot(found, branch), -one, one)

    @wp.func
    def near_gimbal_lock(y: State, end: State, along: Along, flight: Flight, row: int):
        """Return 1 where a step passes near gimbal lock, so that Euler torques depend on its path.

        There roll and yaw change by ±π, and torques along yaw grow as 1/cos θ. A planar pass
        through a pitch of ±π/2 is not reported: torques along pitch do not change.
        """
        torque = three_of(flight.inputs, row, flight.run, euler)
        tilt = tilt_of(end)
        roll = two_of(along, sections)
        size = wp.length(tilt)
        grows = wp.abs(torque[0]) + wp.abs(torque[2])
        passed = above(wp.length(tilt - tilt_of(y)), near * size, one, zero)
        cosine = wp.dot(tilt, roll) * side_of(tilt_of(y), roll)
        aside = wp.abs(roll[0] * tilt[1] - roll[1] * tilt[0])
        turned = above(zero, cosine, above(aside, planar * size, one, zero), one)
        turned = above(cosine, clear * size, zero, turned)
        found = above(wp.abs(torque[1]), zero, turned, zero)
        return wp.max(found, above(grows, zero, passed, zero))

    @wp.func
    def leaves_straight(y: State, end: State, along: Along, flight: Flight, row: int, section: int):
        """Return a bound of the tip error from Q_ψa where a step crosses the threshold κ_s.

        In arm lengths. Q_ψa is divided by the bend above the threshold only, so that the stages of
        such a step use both sides. The bound is the static deflection of the section at that end,
        times its reach.
        """
        around = of_row(flight.inputs, row, flight.run, polar + angle_at(section))
        threshold = flight.plant.threshold[section]
        before = wp.length(bend_of(y, section))
        after = wp.length(bend_of(end, section))
        at_start = wp.length(polar_load(y, along, flight, row, section))
        at_end = wp.length(polar_load(end, along, flight, row, section))
        straight = above(before, after, at_end, at_start)
        moved = (
            flight.plant.reach[section]
            * full
            * straight
            / flight.plant.stiffness[first_of(section)]
        )
        leaves = above(wp.max(before, after), two * threshold, wp.min(one, moved), zero)
        leaves = above(wp.min(before, after), threshold, zero, leaves)
        return above(wp.abs(around), zero, leaves, zero)

    @wp.func
    def paper_load(y: State, along: Along, flight: Flight, row: int, push: Push):
        """Return the load of torques conjugate to the paper's angles and bends, Amiri et al."""
        out = Load()
        if (flight.groups & PAPER) != 0:
            out = torques(y, along, flight, row)
        return out

    @wp.func
    def misled(y: State, end: State, along: Along, flight: Flight, row: int):
        """Return a bound of the tip error from torques that a step may give the wrong sign.

        In arm lengths. If a bend passes near zero and turns far within a step, another step length
        could choose the other sign of κ, which reverses the torques. The bound is twice the static
        deflection of the section, times its reach, and at most 1. Near gimbal lock it is 1 for
        torques along roll, pitch and yaw.
        """
        worst = finite(wp.length_sq(end), near_gimbal_lock(y, end, along, flight, row), zero)
        for k in range(count):
            i = section_of(k)
            b = bend_of(end, i)
            branch = two_of(along, i)
            size = wp.length(b)
            cosine = wp.dot(b, branch) * side_of(bend_of(y, i), branch)
            aside = wp.abs(branch[0] * b[1] - branch[1] * b[0])
            pushed = polar_load(y, along, flight, row, i)
            bent = wp.length(pushed) / flight.plant.stiffness[first_of(i)]
            moved = wp.min(one, flight.plant.reach[i] * two * full * bent)
            beside = above(zero, cosine, above(aside, planar * size, moved, zero), moved)
            beside = above(cosine, clear * size, zero, beside)
            beside = wp.max(beside, leaves_straight(y, end, along, flight, row, i))
            worst = wp.max(worst, finite(cosine, beside, zero))
        return worst

    @wp.func
    def misdirected(
        y: State, end: State, along: Along, flight: Flight, row: int, push: Push, step: Real
    ):  # fmt: skip
        out = zero
        if (flight.groups & PAPER) != 0:
            out = misled(y, end, along, flight, row)
        return out

    return paper_load, misdirected
