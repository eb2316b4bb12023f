"""Pinocchio: articulated-body algorithm on a free body with a link on two crossed hinges."""

from __future__ import annotations

from typing import Any

from measuring import Case, Setup, serve

RUNS = 4096


def tree(vehicle: dict[str, Any]) -> Any:
    """A free-flyer and two revolute joints in the middle of the arm, 8 DoF."""
    import numpy as np
    import pinocchio

    SE3, Inertia = pinocchio.SE3, pinocchio.Inertia
    half = vehicle["length"] / 2
    mass = vehicle["mass_per_length"] * half
    across = mass * half**2 / 12
    link = Inertia(mass, np.array([0, 0, -half / 2]), np.diag([across, across, 1e-4]))
    body = Inertia(vehicle["uav_mass"], np.zeros(3), np.diag(vehicle["uav_inertia"])) + link
    model = pinocchio.Model()
    base = model.addJoint(0, pinocchio.JointModelFreeFlyer(), SE3.Identity(), "base")
    model.appendBodyToJoint(base, body, SE3.Identity())
    joint = SE3(np.eye(3), np.array([0, 0, -half]))
    first = model.addJoint(base, pinocchio.JointModelRX(), joint, "x")
    second = model.addJoint(first, pinocchio.JointModelRY(), SE3.Identity(), "y")
    model.appendBodyToJoint(second, link, SE3.Identity())
    assert model.nv == 8
    return model


def evaluations(setup: Setup) -> Case:
    with setup.timed("import"):
        import numpy as np
        import pinocchio
    with setup.timed("build"):
        model = tree(setup.vehicle)
    pool = pinocchio.ModelPool(model, setup.threads)
    rng = np.random.default_rng(0)
    q = np.stack([pinocchio.integrate(model, pinocchio.neutral(model), rng.normal(size=8) / 4)
                  for _ in range(RUNS)], axis=1)  # fmt: skip
    v, tau = rng.normal(size=(2, 8, RUNS))
    q, v, tau = map(np.asfortranarray, (q, v, tau))

    def run() -> None:
        for _ in range(8):
            a = pinocchio.abaInParallel(setup.threads, pool, q, v, tau)
        assert np.isfinite(a).all()

    what = f"ABA of a tree of 8 DoF, {RUNS} states in one call, no integrator"
    return Case(run, 8 * RUNS, "evaluation", what, integrator="none", runs=RUNS)


if __name__ == "__main__":
    serve(["pin", "numpy"], {}, {"ABA, batch": evaluations})
