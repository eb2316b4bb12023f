"""A payload on a tip: momenta at pick-up and release, its mass in flight, and what is refused."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.refusals import refused
from tests.sections.strains import flying, rod

MASS, CENTRE, INERTIA = 0.2, [0.01, -0.02, 0.03], [2e-4, 3e-4, 4e-4]
VELOCITY = [0.3, -0.2, 0.1]
AT = 0.1
ONE: Any = {"mass": MASS, "centre": CENTRE, "inertia": INERTIA}


def swinging(vehicle: ca.Vehicle, **scene: Any) -> ca.Scenario:
    """Return a flight in weightlessness from a moving start."""
    draw = np.random.default_rng(3)
    q, rates = draw.normal(size=(2, vehicle.layout.coordinates))
    given: dict[str, Any] = {"gravity": 0.0, "duration": 0.2} | scene
    return ca.Scenario("swinging", 0.2 * q, 0.5 * rates, **given)


def momenta_of(flight: xr.Dataset) -> Any:
    return np.hstack([flight[f"{kind}_momentum"].to_numpy() for kind in ("linear", "angular")])


@pytest.mark.parametrize("model", [
    "coupled", pytest.param("decoupled", marks=pytest.mark.long),
])  # fmt: skip
def test_a_pick_up_keeps_the_momenta_of_vehicle_and_payload(model: Any) -> None:
    """Of both together; the decoupled model, which has no momentum, jumps by its own inertia."""
    vehicle = flying(rod(damping_ratio=0.0), rod(length=0.3, damping_ratio=0.0))
    payload = ca.Payload(**ONE, attach=AT, velocity=VELOCITY)
    flight = ca.simulate(vehicle, swinging(vehicle, payload=payload), model=model, rtol=1e-12,
                         sample=1e-3)  # fmt: skip
    carried = flight["payload"].to_numpy()
    first = int(np.argmax(carried > 0.0))
    assert flight["time"].to_numpy()[first] == pytest.approx(AT)
    assert carried[-1] == 1.0 and carried[0] == 0.0
    if model != "coupled":
        assert np.isfinite(momenta_of(flight)).all()
        return
    before, after = momenta_of(flight)[[first - 1, -1]]
    tip, turn = (flight[f"tip_{name}"].to_numpy()[first, 0] for name in ("position", "attitude"))
    from scipy.spatial.transform import Rotation

    place = tip + Rotation.from_quat(turn).apply(CENTRE)
    momentum = MASS * np.array(VELOCITY)
    gained = np.concatenate([momentum, np.cross(place, momentum)])
    size = np.abs(after).max()
    assert np.abs(after - before - gained).max() < 1e-11 * size
    # All of it passes through the tip.
    impulse = flight["payload_impulse"].to_numpy()[-1]
    moved = flight["linear_momentum"].to_numpy()[first]
    assert np.linalg.norm(impulse) > 0.01 * np.linalg.norm(moved)
    energy = flight["kinetic_energy"].to_numpy() + flight["elastic_energy"].to_numpy()
    waited = 0.5 * MASS * np.dot(VELOCITY, VELOCITY)
    assert energy[-1] < energy[first - 1] + waited
    assert np.ptp(energy[:first]) < 1e-9 * energy[0]
    assert np.ptp(energy[first:]) < 1e-9 * energy[0]


def test_a_carried_payload_is_a_body_on_the_tip_until_its_release() -> None:
    vehicle = flying(rod(), rod(length=0.3))
    heavier = vehicle.replace({"arm.0.tip": {"mass": MASS, "centre": CENTRE, "inertia": INERTIA}})
    loaded = swinging(vehicle, payload=ca.Payload(**ONE, release=AT), gravity=9.81)
    plain = swinging(vehicle, gravity=9.81)
    found = ca.simulate(vehicle, loaded, rtol=1e-10, sample=0.01)
    same = ca.simulate(heavier, plain, rtol=1e-10, sample=0.01)
    until = slice(0, 10)
    for name in ("position", "bend", "base_force", "kinetic_energy", "gravity_energy"):
        one, other = (each[name].to_numpy()[until] for each in (found, same))
        assert np.abs(one - other).max() < 1e-8 * np.abs(other).max(), name
    assert found["payload"].to_numpy()[until].tolist() == [1.0] * 10
    # Nothing jumps at the release; then the vehicle flies on without it.
    released, carried = (each["velocity"].to_numpy()[10] for each in (found, same))
    assert released == pytest.approx(carried, rel=1e-8)
    assert float(np.abs(found["bend"][-1] - same["bend"][-1]).max()) > 1e-3
    assert float(found["payload"][-1]) == 0.0


@pytest.mark.long
@pytest.mark.parametrize("method", ["Tsit5", "RK4"])
def test_runs_of_a_batch_pick_up_their_own_mass_and_models_fly(method: Any) -> None:
    vehicle = flying(rod())
    masses = np.linspace(0.05, 0.3, 9)
    options: Any = {"rtol": 1e-9} if method == "Tsit5" else {"step": 1e-4}
    scenario = swinging(vehicle, payload=ca.Payload(mass=masses, attach=AT))
    together = ca.simulate(vehicle, scenario, method=method, sample=0.01, **options)
    for run in (0, 8):
        own = swinging(vehicle, payload=ca.Payload(mass=masses[run], attach=AT))
        alone = ca.simulate(vehicle, own, method=method, sample=0.01, **options)
        one, same = alone["position"].to_numpy(), together["position"].to_numpy()[run]
        assert np.abs(one - same).max() < 1e-9
    for model in ca.MODELS:
        flight = ca.simulate(vehicle, scenario, model=model, sample=0.01)
        assert np.isfinite(flight["position"].to_numpy()).all()
    steps = ca.Simulation(vehicle, swinging(vehicle, payload=ca.Payload(mass=0.3, attach=AT)),
                          control_period=0.02, step=1e-4)  # fmt: skip
    for _ in range(10):
        steps.step()
    last = steps.trajectory()["position"][-1].to_numpy()
    assert last == pytest.approx(together["position"].to_numpy()[8, -1], abs=1e-6)


def test_a_tip_picks_up_what_it_touches() -> None:
    vehicle = flying(rod(damping_ratio=0.1), mount=[0.0, 0.0, -0.05])
    q, rates = np.zeros((2, 8))
    q[2], rates[2] = 1.0, -0.5
    # The tip starts 0.45 m above the floor and comes to 0.25 m in 0.4 s.
    payload = ca.Payload(mass=0.1, place=[0.0, 0.0, 0.25], reach=0.01, release=0.6)
    scenario = ca.Scenario("down", q, rates, gravity=0.0, duration=0.8, payload=payload)
    flight = ca.simulate(vehicle, scenario, sample=0.01, max_step=1e-3)
    carried, height = flight["payload"].to_numpy(), flight["tip_position"].to_numpy()[:, 0, 2]
    first = int(np.argmax(carried > 0.0))
    assert height[first] == pytest.approx(0.26, abs=0.01)
    assert carried[-1] == 0.0 and carried[first:60].min() == 1.0
    after = float(flight["velocity"][-1, 2])
    assert after == pytest.approx(-0.5 * vehicle.mass / (vehicle.mass + 0.1), rel=1e-9)


def test_payloads_that_cannot_be_are_refused() -> None:
    vehicle = flying(rod())
    wrong: Any
    told = ca.Payload(**ONE, attach=AT)
    assert ca.Payload(**told.describe()) == told  # type: ignore[arg-type]
    for wrong, field in (
        ({"mass": -1.0}, "mass"),
        ({"mass": 0.1, "attach": 0.5, "release": 0.4}, "release"),
        ({"mass": 0.1, "attach": 0.5, "place": [0, 0, 0]}, "place"),
        ({"mass": 0.1, "inertia": [-1.0, 0.0, 0.0]}, "inertia"),
    ):
        with refused(f"payload.{field}"):
            ca.Payload(**wrong)
    with refused("payload"):
        twice: Any = [ca.Payload(mass=0.1), ca.Payload(mass=0.1)]
        swinging(vehicle, payload=twice)
    with refused("scenario.payload.arm"):
        ca.simulate(vehicle, swinging(vehicle, payload=ca.Payload(mass=0.1, arm="left")))
    with refused("variables"):
        ca.simulate(vehicle, swinging(vehicle), variables=["payload"])
