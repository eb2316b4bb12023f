"""Contact of arms with solid objects: bounces, energy, friction, shapes, and what is refused."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.analysis.nearest import nearest
from tests.refusals import refused
from tests.sections.strains import flying, rod

RADIUS = 0.006
REACH = 0.5
STIFFNESS = 1e5


def standing(**section: Any) -> ca.Vehicle:
    """Return a vehicle with an arm in the middle below it."""
    return flying(rod(**section), mount=[0.0, 0.0, -0.05])


def dropped(
    vehicle: ca.Vehicle, speed: float = 1.0, above: float = 1e-4, **scene: Any
) -> ca.Scenario:
    """Return a flight whose tip comes down on z = 0, in weightlessness."""
    q = np.zeros(vehicle.layout.coordinates)
    q[2] = REACH + 0.05 + RADIUS + above
    rates = np.zeros_like(q)
    rates[2] = -speed
    given: dict[str, Any] = {"gravity": 0.0, "duration": 0.1} | scene
    return ca.Scenario("dropped", q, rates, **given)


def energy_of(flight: xr.Dataset) -> Any:
    names = ("kinetic", "gravity", "elastic", "term")
    return np.sum([flight[f"{name}_energy"].to_numpy() for name in names], axis=0)


@pytest.mark.parametrize("damping", [0.0, 0.3, 2.0])
def test_a_bounce_is_that_of_the_closed_form(damping: float) -> None:
    """m v dv/dd = -k d^1.5 (1 + c v): v/c - log(1 + c v)/c² is the same before and after. The arm
    stands upright on the plane and does not bend."""
    vehicle = standing()
    floor = ca.Plane(stiffness=STIFFNESS, damping=damping)
    flight = ca.simulate(vehicle, dropped(vehicle, obstacles=[floor]), rtol=1e-11, sample=1e-4)
    after = float(flight["velocity"][-1, 2])
    if damping == 0.0:
        expected = 1.0
        depth = (2.5 * vehicle.mass / (2.0 * STIFFNESS)) ** 0.4
        assert float(flight["contact_force"].sel(axis="z").max()) == pytest.approx(
            STIFFNESS * depth**1.5, rel=1e-4
        )
    else:

        def kept(speed: float) -> float:
            return float(speed / damping - np.log1p(damping * speed) / damping**2)

        expected = brentq(lambda v: kept(-v) - kept(1.0), 0.0, 0.999 / damping, xtol=1e-14)
    assert after == pytest.approx(expected, rel=1e-6)
    assert float(np.abs(flight["contact_force"][-1]).max()) == 0.0


SHAPES = [
    ca.Plane(point=[0.0, 0.0, -0.1], normal=[0.3, 0.0, 1.0]),
    ca.Sphere(centre=[0.0, 0.02, -0.3], radius=0.28),
    ca.Box(centre=[0.03, 0.0, -0.2], size=[0.5, 0.4, 0.35],
           attitude=Rotation.from_rotvec([0.1, 0.2, 0.3]).as_quat()),
    ca.Cylinder(centre=[0.0, 0.0, -0.15], radius=0.14, length=0.6,
                attitude=Rotation.from_rotvec([1.5, 0.0, 0.1]).as_quat()),
]  # fmt: skip


@pytest.mark.parametrize(
    "shape",
    [SHAPES[0], *(pytest.param(each, marks=pytest.mark.long) for each in SHAPES[1:])],
    ids=lambda shape: shape.shape,
)
def test_elastic_contact_keeps_the_energy_of_an_arm(shape: ca.Obstacle) -> None:
    """Of a soft arm that swings on each shape, pressed on several places."""
    vehicle = flying(rod(damping_ratio=0.0), rod(length=0.2, damping_ratio=0.0))
    q = np.zeros(vehicle.layout.coordinates)
    q[2], q[6] = 0.85, 0.4
    rates = np.zeros_like(q)
    rates[:3] = 0.3, 0.1, -1.0
    scenario = ca.Scenario("on it", q, rates, duration=0.3, gravity=0.0, obstacles=[shape])
    flight = ca.simulate(vehicle, scenario, rtol=1e-10, sample=1e-3)
    energy, stored = energy_of(flight), flight["term_energy"].to_numpy()
    assert stored.max() > 5e-4
    assert np.abs(energy - energy[0]).max() < 1e-6 * stored.max()
    # The force on the arm is all that changes the momentum.
    pushed = flight["contact_force"].sum("arm").to_numpy()
    momentum = flight["linear_momentum"].to_numpy()
    impulse = np.trapezoid(pushed, flight["time"].to_numpy(), axis=0)
    assert momentum[-1] - momentum[0] == pytest.approx(impulse, abs=2e-3 * np.abs(impulse).max())


@pytest.mark.long
@pytest.mark.parametrize(
    ("damping", "count"),
    [(0.0, 5_000), (0.5, 5_000), pytest.param(0.5, 100_000, marks=pytest.mark.soak)],
)
def test_no_impact_gains_energy(damping: float, count: int) -> None:
    """Random impacts on rough ground, to a hundred times the tolerance of the integration."""
    vehicle, draw = standing(damping_ratio=0.02), np.random.default_rng(7)
    q, rates = np.zeros((2, count, 8))
    q[:, 2] = REACH + 0.1 + RADIUS
    q[:, 3:5] = 0.4 * draw.normal(size=(count, 2))
    q[:, 6] = 0.5 * draw.normal(size=count)
    rates[:, 2] = -draw.uniform(0.5, 3.0, count)
    rates[:, :2] = draw.normal(size=(count, 2))
    ground = ca.Plane(stiffness=1e4, damping=damping, friction=0.5)
    scenario = ca.Scenario("impacts", q, rates, gravity=0.0, duration=0.1, obstacles=[ground])
    names = ["kinetic_energy", "gravity_energy", "elastic_energy", "term_energy"]
    flight = ca.simulate(vehicle, scenario, sample=0.02, variables=names, rtol=1e-6)
    energy = energy_of(flight)
    touched = flight["term_energy"].max("time").to_numpy() > 0.0
    assert touched.sum() > 0.3 * count
    gained = np.diff(energy, axis=1).max(axis=1) / energy[:, 0]
    assert np.nanmax(gained) < 1e-4


def test_friction_slows_a_tip_that_slides_and_holds_up_to_its_limit() -> None:
    vehicle = standing(damping_ratio=0.3)
    rough = ca.Plane(stiffness=STIFFNESS, damping=1.0, friction=0.4)
    scenario = dropped(vehicle, 0.0, -1e-4, obstacles=[rough], duration=0.05).replace(
        force=[0.0, 0.0, -5.0], qd=[0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    )
    flight = ca.simulate(vehicle, scenario, rtol=1e-8)
    force = flight["contact_force"].to_numpy()[:, 0]
    share = -force[:, 0] / force[:, 2]
    speed = flight["tip_velocity"].to_numpy()[:, 0, 0]
    pressed = force[:, 2] > 0.1
    assert pressed.sum() > 10
    expected = 0.4 * speed / np.hypot(speed, 0.01)
    assert share[pressed] == pytest.approx(expected[pressed], abs=0.02)
    assert np.abs(share[pressed]).max() <= 0.4


def test_a_cheaper_stiffness_takes_fewer_steps() -> None:
    vehicle = standing()
    steps = []
    for stiffness in (1e3, 1e7):
        scenario = dropped(vehicle, obstacles=[ca.Plane(stiffness=stiffness)])
        steps.append(int(ca.simulate(vehicle, scenario)["steps"]))
    assert steps[1] > 2 * steps[0]


@pytest.mark.long
def test_a_run_of_a_batch_is_the_same_alone_and_models_fly() -> None:
    vehicle = standing(damping_ratio=0.1)
    batch = vehicle.replace({"uav.mass": np.linspace(1.2, 1.8, 9)})
    scenario = dropped(vehicle, obstacles=[ca.Plane(stiffness=1e4), *SHAPES[1:2]])
    together = ca.simulate(batch, scenario, sample=0.01)
    alone = ca.simulate(batch.select(3), scenario, sample=0.01)
    for name in ("position", "contact_force"):
        assert alone[name].to_numpy() == pytest.approx(together[name].to_numpy()[3], rel=1e-9)
    pair = ca.run_pairs(batch, scenario)
    assert np.isfinite(pair["nrmse_t"].to_numpy()).all()
    for model in ca.MODELS:
        flight = ca.simulate(vehicle, scenario, model=model, sample=0.01)
        assert float(flight["contact_force"].sel(axis="z").max()) > 1.0
    one = ca.Simulation(vehicle, scenario, control_period=0.01, step=1e-4)
    for _ in range(10):
        one.step()
    stepped = one.trajectory()["position"][-1].to_numpy()
    exact = ca.simulate(vehicle, scenario, method="RK4", step=1e-4, sample=0.01)
    assert stepped == pytest.approx(exact["position"][-1].to_numpy(), rel=1e-9)


def test_scenes_that_cannot_be_are_refused() -> None:
    vehicle = standing()
    with refused("scenario.obstacles"):
        ca.simulate(vehicle, dropped(vehicle, obstacles=[ca.Plane(point=[0.0, 0.0, 0.1])]))
    with refused("obstacles"):
        dropped(vehicle, obstacles=[1.0])
    with refused("Sphere.radius"):
        ca.Sphere(centre=[0, 0, 0], radius=-1.0)
    with refused("Box.size"):
        ca.Box(centre=[0, 0, 0], size=[1.0, 0.0, 1.0])
    with refused("Plane.normal"):
        ca.Plane(normal=[0.0, 0.0, 0.0])
    with refused("variables"):
        ca.simulate(vehicle, dropped(vehicle), variables=["contact_force"])
    plain = ca.Vehicle(name="none", uav={"mass": 1.0, "inertia": [0.01, 0.01, 0.01]})
    with refused("scenario.obstacles"):
        ca.simulate(plain, ca.Scenario("x", np.zeros(6), obstacles=[ca.Plane()]))


def presser(*sections: dict[str, Any]) -> ca.Vehicle:
    """Return a vehicle whose attitude loop is stable while its hanging arm presses."""
    uav = {"mass": 2.2, "inertia": [0.022, 0.022, 0.038]}
    arm = {"name": "arm", "mount": [0.0, 0.0, -0.05], "section": list(sections)}
    return ca.Vehicle(name="presser", uav=uav, arm=[arm])


def part(length: float = 0.3, **changes: Any) -> dict[str, Any]:
    given = {"length": length, "radius": 0.004, "mass_per_length": 0.08, "damping_ratio": 0.2}
    return given | {"bending_stiffness": 0.2} | changes


SIDE = ca.Box(centre=[0.15, 0.0, 0.45], size=[0.2, 0.4, 0.2], damping=0.5)
TWO = presser(part(0.15, name="a"), part(0.15, name="b", bending_stiffness=0.15))


@pytest.mark.parametrize(
    ("vehicle", "obstacle", "force"),
    [
        (presser(part()), ca.Plane(point=[0.05, 0.0, 0.53], normal=[-1.0, 0.0, 1.0]), 1.0),
        *(
            pytest.param(*each, marks=pytest.mark.long)
            for each in [
                (presser(part(strain={"bending": 1})), SIDE, 2.0),
                (TWO, SIDE, 2.0),
                (presser(part()), ca.Sphere(centre=[0.35, 0.0, 0.5], radius=0.3), 0.5),
            ]
        ),
    ],
    ids=["plane", "linear strain", "two sections", "sphere"],
)
def test_an_arm_presses_with_the_force_that_was_asked_for(
    vehicle: ca.Vehicle, obstacle: ca.Obstacle, force: float
) -> None:
    held = ca.pressing(vehicle, obstacle, force, point=[0.05, 0.0, 0.535])
    _, normal = nearest(obstacle, np.array([0.05, 0.0, 0.535]))
    start = np.zeros(vehicle.layout.coordinates)
    start[:3] = np.array([0.05, 0.0, 0.885]) + 0.04 * normal
    scenario = ca.Scenario(
        "press",
        start,
        controller=ca.flight_controller(vehicle, bend_bandwidth=0.0, position_bandwidth=5.0),
        setpoints=ca.Setpoints(times=[0.0, 1.0], position=[start[:3], held.q[:3]]),
        obstacles=[obstacle],
        duration=6.0,
    )
    flight = ca.simulate(vehicle, scenario, sample=0.02)
    pressed = flight["contact_force"].isel(arm=0, time=-1).to_numpy()
    # At the controller's slowest pole, 1 rad/s, exp(-5) of the error is left after the ramp.
    assert pressed == pytest.approx(force * normal, abs=0.01 * force)
    upright = Rotation.from_quat(flight["attitude"][-1].to_numpy()).apply([0.0, 0.0, 1.0])
    weight = np.array([0.0, 0.0, 9.81 * vehicle.mass])
    assert held.thrust * upright == pytest.approx(weight - force * normal, abs=0.01 * force)


def test_a_tip_presses_only_where_it_stays() -> None:
    vehicle, top, place = presser(part()), [0.0, 0.0, 0.0], [0.05, 0.0, 0.535]
    # A ball below the tip pushes it aside with F/R per length, the arm back with about 3 EI/l³.
    ball = ca.Sphere(centre=[0.0, 0.0, -0.3], radius=0.3)
    assert ca.pressing(vehicle, ball, 1.0, point=top).q[2] == pytest.approx(0.35, abs=5e-3)
    with refused("force"):
        ca.pressing(vehicle, ca.Sphere(centre=[0.0, 0.0, -0.02], radius=0.02), 1.0, point=top)
    with refused("force"):
        ca.pressing(vehicle, ca.Plane(), 30.0, point=top)
    with refused("force"):
        ca.pressing(vehicle, SIDE, -1.0, point=place)
    # A wall up to the sky holds the whole arm.
    with refused("point"):
        ca.pressing(vehicle, ca.Plane(point=[0.05, 0.0, 0.0], normal=[-1, 0, 0]), 1.0, point=place)
    # Of an arm that presses 50 mm below the edge of a beam, the edge holds a thick one, too.
    below, thick = [0.05, 0.0, 0.5], vehicle.replace({"arm.arm.section.0.radius": 0.08})
    with refused("point"):
        ca.pressing(thick, SIDE, 1.0, point=below)
    assert ca.pressing(vehicle, SIDE, 1.0, point=below).q[2] > 0.8
    with refused("point"):
        ca.pressing(vehicle, ca.Box(centre=[0, 0, 0], size=[1e-3, 1, 1]), 10.0, point=top)
    with refused("vehicle"):
        ca.pressing(ca.load_vehicle("dual_arm"), SIDE, 1.0, point=place)


@pytest.mark.parametrize(("share", "strong"), [(0.99, False), (1.01, True)])
def test_rotors_that_carry_the_vehicle_may_be_too_weak_to_press(share: float, strong: bool) -> None:
    """Weight and 6 N from the side need √(W² + 6²), of four rotors together."""
    vehicle, place = presser(part()), [0.05, 0.0, 0.53]
    needed = math.hypot(9.81 * vehicle.mass, 6.0)
    rotors = {"layout": "quad_x", "lever": 0.2, "torque_per_thrust": 0.016, "lag": 0.02}
    limits = {"thrust_limits": [0.0, share * needed / 4.0]}
    weak = vehicle.replace({"uav.rotors": rotors | limits})
    if strong:
        assert ca.pressing(weak, SIDE, 6.0, point=place).thrust == pytest.approx(needed)
    else:
        with refused("force"):
            ca.pressing(weak, SIDE, 6.0, point=place)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.shape)
def test_the_nearest_point_is_on_the_surface_and_the_normal_is_the_slope(
    shape: ca.Obstacle,
) -> None:
    points = np.random.default_rng(3).uniform(-0.6, 0.6, (200, 3))
    distance, normal = nearest(shape, points)
    assert np.linalg.norm(normal, axis=-1) == pytest.approx(np.ones(200), rel=1e-12)
    assert (distance < 0.0).any() and (distance > 0.0).any()
    surface, _ = nearest(shape, points - distance[:, None] * normal)
    assert surface == pytest.approx(np.zeros(200), abs=1e-12)
    h = 1e-6 * np.eye(3)
    slope = np.stack(
        [nearest(shape, points + e)[0] - nearest(shape, points - e)[0] for e in h], axis=-1
    )
    assert slope / 2e-6 == pytest.approx(normal, abs=1e-4)
