"""MuJoCo: a free body under which hangs a chain of rigid links on hinges with bending springs.

N joints sit in the middles of N equal parts of the arm, each bends about two axes with E I N / l.
Its tip under a tip force sinks by 1 - 1/(4 N²) of a beam's deflection: ¾ with one joint, as an arm
of constant curvature does, and the more joints, the nearer to the beam.
"""

from __future__ import annotations

from typing import Any

from measuring import Builder, Case, Setup, serve

STEP = 1e-4
WORK = 1_200_000
FASTEST_PHASE = 1.4
"""What a step may turn the fastest mode by [rad]; RK4 is stable up to 2.8."""


def chain(vehicle: dict[str, Any], joints: int) -> str:
    """The model in MuJoCo's XML; the arm's first half link is part of the free body."""
    part = vehicle["length"] / joints
    spring = vehicle["bending_stiffness"] / part

    def inertia(length: float) -> tuple[float, float, float]:
        mass = vehicle["mass_per_length"] * length
        across = mass * (length**2 / 12 + vehicle["radius"] ** 2 / 4)
        return mass, across, mass * vehicle["radius"] ** 2 / 2

    links = ""
    for i in reversed(range(joints)):
        length = part / 2 if i == joints - 1 else part
        mass, across, along = inertia(length)
        links = (
            f'<body pos="0 0 {-part / 2 if i == 0 else -part}">'
            f'<joint type="hinge" axis="1 0 0" stiffness="{spring}"/>'
            f'<joint type="hinge" axis="0 1 0" stiffness="{spring}"/>'
            f'<inertial pos="0 0 {-length / 2}" mass="{mass}" '
            f'diaginertia="{across} {across} {along}"/>{links}</body>'
        )
    mass, across, along = inertia(part / 2)
    total = mass + vehicle["uav_mass"]
    centre = -mass * part / 4 / total
    moments = [
        vehicle["uav_inertia"][i] + own + spread * vehicle["uav_mass"] * mass / total
        for i, (own, spread) in enumerate(
            ((across, part**2 / 16), (across, part**2 / 16), (along, 0))
        )
    ]
    return f"""<mujoco>
      <option integrator="RK4"><flag contact="disable" constraint="disable"/></option>
      <worldbody><body pos="0 0 5"><freejoint/>
        <inertial pos="0 0 {centre}" mass="{total}"
          diaginertia="{moments[0]} {moments[1]} {moments[2]}"/>
        {links}</body></worldbody></mujoco>"""


def one_run(joints: int) -> Builder:
    def build(setup: Setup) -> Case:
        with setup.timed("import"):
            import mujoco
            import numpy as np
        with setup.timed("build"):
            model = mujoco.MjModel.from_xml_string(chain(setup.vehicle, joints))
            data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, M, data.qM)
        stiffness = np.diag(model.jnt_stiffness[model.dof_jntid])
        fastest = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(M, stiffness))).max())
        step = model.opt.timestep = min(STEP, FASTEST_PHASE / float(fastest))
        steps = max(200, WORK // model.nv**2)

        def advance() -> None:
            mujoco.mj_resetData(model, data)
            data.qvel[3:6] = 0.1
            data.qpos[7] = 0.05
            mujoco.mj_step(model, data, nstep=steps)
            # An unstable run is reset by MuJoCo with a warning; it would time something else.
            assert not any(warning.number for warning in data.warning)

        share = 100 * (1 - 1 / (4 * joints**2))
        what = (
            f"chain of {joints} joint{'s' if joints > 1 else ''}, {model.nv} DoF, sinks "
            f"{share:.4g} % as far as a beam"
        )
        return Case(advance, steps, "RK4 step", what, step=step)

    return build


if __name__ == "__main__":
    arms = {f"{joints}-joint arm": one_run(joints) for joints in (2, 8, 32)}
    serve(["mujoco", "numpy"], {"8-DoF chain": one_run(1), **arms}, {})
