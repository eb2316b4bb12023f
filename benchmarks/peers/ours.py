"""continuair itself: one run and batches of the three models, and a closed servo loop."""

from __future__ import annotations

from typing import Any

from measuring import Builder, Case, Setup, serve

STEP = 1e-4
STEPS = 200_000
RUNS, BATCH_STEPS = 1024, 1000
SERVO_SECONDS, PERIOD = 20.0, 1e-3
MODELS = ("coupled", "decoupled", "independent")


def vehicle_of(sections: int, linear: bool = False) -> Any:
    """The preset `paper`, its arm cut into equal sections; linear: their bend is, along them."""
    import continuair as ca

    paper = ca.load_vehicle("paper")
    if sections == 1 and not linear:
        return paper
    names = ("radius", "density", "youngs_modulus", "damping")
    part = {name: getattr(paper.arm, name) for name in names}
    part["length"] = paper.arm.length / sections
    part |= {"strain": {"bending": 1}, "nodes": 6} if linear else {}
    arm = {"mount": paper.uav.mount, "section": [part] * sections}
    uav = {"mass": paper.uav.mass, "inertia": paper.uav.inertia}
    return ca.Vehicle(name="equal sections", uav=uav, arm=[arm])


def turning(bends: int) -> tuple[list[float], list[float]]:
    """Slightly bent and turning slowly: all terms are at work."""
    return [0, 0, 5, 0, 0, 0, *[0.1, 0.0] * (bends // 2)], [0, 0, 0, 0.1, 0.1, 0.1, *[0.0] * bends]


def free_flight(vehicle: Any) -> Any:
    """Held up against gravity."""
    import continuair as ca

    mass = vehicle.uav.mass + sum(arm.mass for arm in vehicle.arms)
    weight = (0.0, 0.0, 9.81 * float(mass))
    q, qd = turning(2 * vehicle.sections)
    return ca.Scenario("free flight", q, qd, force=weight, duration=STEP * STEPS)


def one_run(model: str, sections: int = 1) -> Builder:
    def build(setup: Setup) -> Case:
        with setup.timed("import"):
            import continuair as ca
        vehicle = vehicle_of(sections)
        scenario = free_flight(vehicle)

        def fly() -> None:
            flight = ca.simulate(
                vehicle,
                scenario,
                model=model,
                method="RK4",
                step=STEP,
                sample=STEP * STEPS,
                variables=("tip_position",),
                threads=1,
            )
            assert int(flight["status"]) == 0

        # The first flight compiles, or finds what an earlier process left in the cache.
        with setup.timed("compile"):
            fly()
        return Case(fly, STEPS, "RK4 step", f"{model} model, {what_of(sections)}", step=STEP)

    return build


def what_of(sections: int) -> str:
    several = f"{sections} sections, " if sections > 1 else ""
    return f"{several}{6 + 2 * sections} DoF"


def batch(model: str, dtype: str = "float64", sections: int = 1, linear: bool = False) -> Builder:
    def build(setup: Setup) -> Case:
        import numpy as np

        import continuair as ca

        vehicle = vehicle_of(sections, linear).replace({"uav.mass": np.linspace(1.0, 3.0, RUNS)})
        fall = ca.Scenario("fall", *turning(2 * sections * (1 + linear)))
        seconds = STEP * BATCH_STEPS

        def fly() -> None:
            flights = ca.simulate(
                vehicle,
                fall,
                model=model,
                dtype=dtype,
                method="RK4",
                step=STEP,
                sample=seconds,
                duration=seconds,
                variables=("tip_position",),
                threads=setup.threads,
            )
            assert not flights["status"].any()

        with setup.timed("compile"):
            fly()
        arms = "linear strain of 6 nodes, 10 DoF" if linear else what_of(sections)
        what = f"{model} model, {arms}, {RUNS} vehicles"
        return Case(fly, RUNS * BATCH_STEPS, "RK4 step", what, dtype, step=STEP, runs=RUNS)

    return build


def servo(setup: Setup) -> Case:
    import continuair as ca
    from continuair.controllers.classic import classic
    from continuair.scenario.paths import circle
    from continuair.scenario.targets import Target

    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.05})
    scenario = ca.Scenario(
        "servoing",
        (0.1, 0, 3.1, 0, 0, 0, 0.1, 0),
        duration=SERVO_SECONDS,
        gravity=0.0,
        controller=classic(vehicle, 0.5, 6.0),
        control_period=PERIOD,
        target=Target(circle(radius=0.2, period=10.0)),
    )

    def fly() -> None:
        flight = ca.simulate(
            vehicle, scenario, sample=SERVO_SECONDS, variables=("position",), threads=1
        )
        assert int(flight["status"]) == 0

    with setup.timed("compile"):
        fly()
    what = "camera, interaction matrix, classic servo law, and the coupled dynamics' steps"
    return Case(fly, round(SERVO_SECONDS / PERIOD), "servo iteration", what)


SINGLE = {
    **{model: one_run(model) for model in MODELS},
    "two sections": one_run("coupled", 2),
    "servo loop": servo,
}
BATCH = {
    **{f"{model}, batch": batch(model) for model in MODELS},
    "coupled, batch, float32": batch("coupled", "float32"),
    "two sections, batch": batch("coupled", sections=2),
    "linear strain, batch": batch("coupled", linear=True),
}

if __name__ == "__main__":
    serve(["continuair", "warp-lang", "numpy"], SINGLE, BATCH)
