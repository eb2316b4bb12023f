"""crazyflow: batches of rigid quadrotors, RK4, single precision (its only one below 10 kHz)."""

from __future__ import annotations

from measuring import Builder, Case, Setup, serve

FREQUENCY = 500


def fleet(runs: int, steps: int) -> Builder:
    def build(setup: Setup) -> Case:
        with setup.timed("import"):
            import jax
            import numpy as np
            from crazyflow.control import Control
            from crazyflow.dynamics import Dynamics
            from crazyflow.sim.integration import Integrator
            from crazyflow.sim.sim import Sim
        with setup.timed("build"):
            sim = Sim(
                n_worlds=runs,
                dynamics=Dynamics.first_principles,
                control=Control.rotor_vel,
                integrator=Integrator.rk4,
                freq=FREQUENCY,
            )
            sim.reset()
        with setup.timed("compile"):
            sim.step(steps)
            jax.block_until_ready(sim.data)

        def run() -> None:
            sim.step(steps)
            jax.block_until_ready(sim.data)
            assert np.isfinite(np.asarray(sim.data.states.pos)).all()

        what = f"rigid quadrotor without arm, {runs} worlds"
        step = 1 / FREQUENCY
        return Case(run, runs * steps, "RK4 step", what, "float32", step=step, runs=runs)

    return build


if __name__ == "__main__":
    serve(["crazyflow", "jax", "jaxlib"], {}, {"rigid vehicle, batch": fleet(4096, 100)})
