"""The arm as MuJoCo sees it: rigid links of a round rod in series, with springs in between.

N joints sit in the middles of N equal parts of the backbone, so that the first and the last link
are half as long as the others and errors go with 1/N². Every joint bends with the stiffness
E I N / l about two axes and does not twist. Links have mass and inertia of a solid round rod.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from scipy.linalg import eigvalsh

from continuair.vehicle.vehicle import Vehicle

SOURCE = f"MuJoCo {mujoco.__version__}"


def chain(
    vehicle: Vehicle,
    joints: int,
    *,
    base: str = "free",
    bending: str = "hinges",
    gravity: float = 9.81,
    step: float = 1e-3,
) -> mujoco.MjModel:
    """A compiled chain on a "free" or "clamped" base.

    bending: "hinges", two with springs per joint; "plane", one about y; "balls" without springs.
    """
    arm, part = vehicle.arm, vehicle.arm.length / joints
    spring = arm.bending_stiffness / part
    about_x, about_y = (
        f'<joint type="hinge" axis="{axis}" stiffness="{spring!r}"/>' for axis in ("1 0 0", "0 1 0")
    )
    joint_kinds = {"hinges": about_x + about_y, "plane": about_y, "balls": '<joint type="ball"/>'}
    at_joint = joint_kinds[bending]

    def link(start: float, length: float, inside: str, joint: str = at_joint) -> str:
        mass = arm.mass_per_length * length
        across, along = mass * (length**2 / 12 + arm.radius**2 / 4), mass * arm.radius**2 / 2
        return (
            f'<body pos="0 0 {-start!r}">{joint}<inertial pos="0 0 {-length / 2!r}" '
            f'mass="{mass!r}" diaginertia="{across!r} {across!r} {along!r}"/>{inside}</body>'
        )

    inside = f'<site name="tip" pos="0 0 {-part / 2!r}"/>'
    for i in reversed(range(joints)):
        length = part / 2 if i == joints - 1 else part
        inside = link(part / 2 if i == 0 else part, length, inside)
    mount = " ".join(map(repr, vehicle.uav.mount))
    moments = " ".join(repr(float(row[i])) for i, row in enumerate(vehicle.uav.inertia))
    first = link(0.0, part / 2, "", joint="")
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco>
          <option gravity="0 0 {-gravity!r}" integrator="RK4" timestep="{step!r}">
            <flag contact="disable" constraint="disable"/>
          </option>
          <worldbody><body name="uav">{"<freejoint/>" if base == "free" else ""}
            <inertial pos="0 0 0" mass="{vehicle.uav.mass!r}" diaginertia="{moments}"/>
            <body pos="{mount}"><inertial pos="0 0 0" mass="1e-12" diaginertia="1e-12 1e-12 1e-12"/>
              {first}{inside}</body>
          </body></worldbody></mujoco>"""
    )


def first_frequency(vehicle: Vehicle, joints: int, base: str) -> float:
    """First bending frequency [rad/s] of the straight chain, "clamped" or "free", no gravity."""
    model = chain(vehicle, joints, base=base, bending="plane", gravity=0.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    K = np.diag(model.jnt_stiffness[model.dof_jntid])
    squares = eigvalsh(K, inertia(model, data))
    return float(np.sqrt(squares[6 if base == "free" else 0]))


def inertia(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """MuJoCo's mass matrix at the pose of `data`, whose kinematics are up to date."""
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, M, data.qM)
    return M


@dataclass(frozen=True)
class Path:
    """What a chain does over time: base position (n, 3), tip (n, 3), base turn about y (n,)."""

    times: np.ndarray
    base: np.ndarray
    tip: np.ndarray
    turn: np.ndarray


def fly(
    vehicle: Vehicle,
    joints: int,
    duration: float,
    *,
    height: float = 0.0,
    curvature: float = 0.0,
    loads: Callable[[float], dict[str, Any]] = lambda t: {},
    base: str = "free",
    gravity: float = 9.81,
    samples: int = 100,
) -> Path:
    """Step MuJoCo's RK4 from rest in the plane y = 0, the arm bent to a curvature in x [1/m].

    loads(t) gives any of "force" (3,) [N, world] and "moment" [N m, about y] on a free UAV, "tip"
    (3,) [N, world] on the tip, and "bend", the moment about -y in every joint [N m]. The step
    resolves the fastest mode of the chain (ω h = 1.4 at most); loads act at the middle of a step.
    """
    model = chain(vehicle, joints, base=base, bending="plane", gravity=gravity)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    K = np.diag(model.jnt_stiffness[model.dof_jntid])
    fastest = np.sqrt(eigvalsh(K, inertia(model, data))[-1])
    per_sample = int(np.ceil(duration / samples * fastest / 1.4))
    step = model.opt.timestep = duration / samples / per_sample
    free = base == "free"
    if free:
        data.qpos[2] = height
    data.qpos[-joints:] = -curvature * vehicle.arm.length / joints
    mujoco.mj_forward(model, data)
    last, half_link = model.nbody - 1, np.array([0.0, 0.0, -vehicle.arm.length / joints / 4])
    seen = []
    for sample in range(samples + 1):
        mujoco.mj_kinematics(model, data)
        q = data.qpos[:7] if free else np.eye(7)[3]
        seen.append([*q[:3], *data.site_xpos[0], 2.0 * np.arctan2(q[5], q[3])])
        for i in range(per_sample if sample < samples else 0):
            acting = loads((sample * per_sample + i + 0.5) * step)
            if free:
                data.qfrc_applied[:3] = acting.get("force", 0.0)
                data.qfrc_applied[4] = acting.get("moment", 0.0)
            data.qfrc_applied[-joints:] = -acting.get("bend", 0.0)
            if "tip" in acting:
                data.xfrc_applied[last, :3] = acting["tip"]
                arm = data.xmat[last].reshape(3, 3) @ half_link
                data.xfrc_applied[last, 3:] = np.cross(arm, acting["tip"])
            mujoco.mj_step(model, data)
    rows = np.array(seen)
    times = np.linspace(0.0, duration, samples + 1)
    return Path(times, rows[:, :3], rows[:, 3:6], rows[:, 6])


@dataclass
class CircularChain:
    """A chain of ball joints held in a circular arc: MuJoCo's equations in (base, k).

    All joints turn by the same rotation vector θ = h k × ẑ, so their velocities follow from k̇;
    MuJoCo's mass matrix and bias forces are projected on these velocities (d'Alembert). As N
    grows this tends to an arm of constant curvature, whoever wrote that down.
    """

    vehicle: Vehicle
    joints: int
    gravity: float = 9.81

    def __post_init__(self) -> None:
        self.model = chain(self.vehicle, self.joints, bending="balls", gravity=self.gravity)
        self.data = mujoco.MjData(self.model)

    def terms(
        self, attitude_xyzw: Any, bend: Any, omega: Any, bend_rate: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """M (8, 8) and bias (8,), springs apart, for (v̇ world, ω̇ body, k̈)."""
        model, data = self.model, self.data
        part = self.vehicle.arm.length / self.joints
        turn = part * np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]])  # θ = turn @ k
        θ, θd = turn @ bend, turn @ bend_rate
        J = np.zeros((model.nv, 8))
        J[:6, :6] = np.eye(6)
        J[6:, 6:] = np.tile(_right_jacobian(θ).real @ turn, (self.joints, 1))
        shifted = _right_jacobian(θ + 1e-30j * θd).imag / 1e-30
        extra = np.concatenate([np.zeros(6), np.tile(shifted @ θd, self.joints)])
        data.qpos[:3] = 0.0
        data.qpos[3:7] = np.roll(attitude_xyzw, 1)
        data.qpos[7:] = np.tile(_quaternion_wxyz(θ), self.joints)
        data.qvel[:] = J @ np.concatenate([np.zeros(3), omega, bend_rate])
        mujoco.mj_forward(model, data)
        M = inertia(model, data)
        return J.T @ M @ J, J.T @ (data.qfrc_bias + M @ extra)

    def push(self, force: Any, moment: Any, bend: Any) -> np.ndarray:
        """Generalised force (8,) of a force and moment at the tip, world axes; after `terms`."""
        model, data = self.model, self.data
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, linear, angular, 0)
        turn = self.vehicle.arm.length / self.joints * np.array([[0.0, 1.0], [-1.0, 0.0], [0, 0]])
        J = np.zeros((model.nv, 8))
        J[:6, :6] = np.eye(6)
        J[6:, 6:] = np.tile(_right_jacobian(turn @ bend).real @ turn, (self.joints, 1))
        return J.T @ (linear.T @ np.asarray(force) + angular.T @ np.asarray(moment))

    def accelerations(
        self,
        attitude_xyzw: Any,
        bend: Any,
        omega: Any,
        bend_rate: Any,
        tip_force: Any = (0.0, 0.0, 0.0),
        tip_moment: Any = (0.0, 0.0, 0.0),
        force: Any = (0.0, 0.0, 0.0),
    ) -> np.ndarray:
        """(v̇ world, ω̇ body, k̈) with the spring E I l; force acts on B, all in world axes."""
        M, bias = self.terms(attitude_xyzw, bend, omega, bend_rate)
        arm = self.vehicle.arm
        load = self.push(tip_force, tip_moment, bend) - bias
        load[:3] += force
        load[6:] -= arm.bending_stiffness * arm.length * np.asarray(bend)
        return np.linalg.solve(M, load)

    @property
    def tip(self) -> np.ndarray:
        """The tip relative to B's origin, world axes, at the last pose evaluated."""
        return np.array(self.data.site_xpos[0])


def extrapolated(coarse: Any, middle: Any, fine: Any) -> Any:
    """The limit of N, 2N, 4N under errors in 1/N² and 1/N⁴."""
    first = [(4 * b - a) / 3 for a, b in ((coarse, middle), (middle, fine))]
    return (16 * first[1] - first[0]) / 15


def _quaternion_wxyz(θ: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(θ)
    return np.concatenate([[np.cos(angle / 2)], 0.5 * np.sinc(angle / (2 * np.pi)) * θ])


def _right_jacobian(θ: np.ndarray) -> np.ndarray:
    """Angular velocity in the turned frame per rate of the rotation vector; |θ| < 1."""
    X = np.array([[0, -θ[2], θ[1]], [θ[2], 0, -θ[0]], [-θ[1], θ[0], 0]])
    result, term = np.eye(3, dtype=complex), np.eye(3, dtype=complex)
    for n in range(2, 20):
        term = term @ -X / n
        result = result + term
    return result
