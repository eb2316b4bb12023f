"""Friction of tendons: its limits, its memory, and that it never produces energy."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.sections.strains import rod
from tests.tendons.pulled import DISKS, FOUR, floating, pulled

FRICTION = 0.3
RUBBING = {"friction": FRICTION, "pretension": 3.0}


def energy_of(flight: xr.Dataset, tensions: Any) -> Any:
    """Energy of bodies, springs and guides, and of motors with constant tensions."""
    names = [f"{name}_energy" for name in ("kinetic", "gravity", "elastic")]
    bodies = np.sum([flight[name].to_numpy() for name in names], axis=0)
    tendons = flight["tendon_energy"].sum("tendon").to_numpy()
    return bodies + tendons + flight["tendon_length"].to_numpy() @ np.broadcast_to(tensions, 4)


@pytest.mark.parametrize(
    "vehicle",
    [
        pulled({"pretension": 3.0}, damping_ratio=0.0),
        pytest.param(pulled({"pretension": 3.0, "guides": "disks"}, damping_ratio=0.0,
                            bending=1, disks=DISKS), marks=pytest.mark.long),
        pytest.param(pulled({"pretension": 3.0, "offset": [0.02, 0.01]},
                            sections=[rod(bending=1, twist=0), rod()]), marks=pytest.mark.long),
    ],
)  # fmt: skip
def test_energy_and_momentum_stay_without_friction(vehicle: ca.Vehicle) -> None:
    flight = ca.simulate(vehicle, floating(vehicle), rtol=1e-10, sample=0.01)
    energy = energy_of(flight, 3.0)
    swing = np.ptp(flight["elastic_energy"].to_numpy())
    assert np.abs(energy - energy[0]).max() < 1e-7 * swing
    for name in ("linear_momentum", "angular_momentum"):
        momentum = flight[name].to_numpy()
        assert np.abs(momentum - momentum[0]).max() < 1e-7 * np.abs(momentum).max()


@pytest.mark.parametrize("by_length", [False, pytest.param(True, marks=pytest.mark.long)])
def test_friction_only_takes_energy(by_length: bool) -> None:
    """Of bodies, springs and guides, from sample to sample; what friction takes is all that goes
    from bodies and springs."""
    winches = {"command": "length", "stiffness": 2e4} if by_length else {}
    vehicle = pulled(RUBBING | winches, damping_ratio=0.0)
    flight = ca.simulate(vehicle, floating(vehicle), rtol=1e-10, sample=1e-4)
    energy = energy_of(flight, 0.0 if by_length else 3.0)
    swing = np.ptp(flight["kinetic_energy"].to_numpy())
    assert np.diff(energy).max() < 1e-9 * swing
    taken = flight["tendon_friction_power"].sum("tendon").integrate("time")
    left = flight["tendon_energy"].isel(time=-1).sum() if not by_length else 0.0
    if not by_length:
        assert energy[0] - energy[-1] + float(left) == pytest.approx(float(taken), rel=1e-3)
    assert energy[0] - energy[-1] > 0.02 * swing


@pytest.mark.long
def test_a_helix_rubs_on_a_rod_that_stays_straight() -> None:
    """Its own curve turns it by ω² d/√(1 + ω² d²) per length of the rod; θ up to the last gap.

    Over two whole turns it does not bend the rod, which untwists a little: the tendon slides.
    """
    offset, turn, length = 0.02, 4.0 * np.pi, 0.5
    helix = {"angles": [0.3], "offset": offset, "turn": turn, "friction": 0.1, "pretension": 3.0,
             "friction_stiffness": 1e7}  # fmt: skip
    stiff = rod(bending=0, twist=0, youngs_modulus=5e10, damping_ratio=0.5)
    vehicle = pulled(helix, sections=[stiff])

    def command(t: float) -> Any:
        return [1000.0 * t]

    still = ca.Scenario("pulled", np.zeros(9), gravity=0.0, tendon_command=command, duration=0.02)
    flight = ca.simulate(vehicle, still, rtol=1e-8, sample=0.005)
    omega = turn / length
    turned = omega**2 * offset / np.hypot(1.0, omega * offset) * length * 5.0 / 6.0
    ratio = float((flight["tendon_end_tension"] / flight["tendon_tension"])[-1, 0])
    assert ratio == pytest.approx(np.exp(-0.1 * turned), rel=2e-3)


def test_a_sliding_tendon_loses_tension_as_the_capstan_says() -> None:
    """T1/T0 = exp(-μ θ) where it is pulled, exp(μ θ) where it is let go; θ up to the last gap."""
    vehicle = pulled(RUBBING, damping_ratio=0.3)

    def command(t: float) -> Any:
        return [20.0 * np.sin(np.pi * t) ** 2, 0.0, 0.0, 0.0]

    still = ca.Scenario("pulled", np.zeros(8), gravity=0.0, tendon_command=command)
    flight = ca.simulate(vehicle, still, rtol=1e-9)
    bend = np.linalg.norm(flight["bend"].to_numpy()[:, 0], axis=-1)
    turned = FRICTION * bend * vehicle.arms[0].section[0].length * 5.0 / 6.0
    ratio = (flight["tendon_end_tension"] / flight["tendon_tension"]).to_numpy()[:, 0]
    inwards, outwards = slice(200, 450), slice(800, 900)
    assert ratio[inwards] == pytest.approx(np.exp(-turned[inwards]), rel=1e-12)
    assert ratio[outwards] == pytest.approx(np.exp(turned[outwards]), rel=1e-12)
    assert (np.abs(np.log(ratio)) <= turned * (1.0 + 1e-12) + 1e-14).all()


@pytest.mark.long
def test_the_loop_of_tension_over_bend_is_closed_and_loses_energy() -> None:
    """Slow cycles of one tendon, from the second on; the area is the work of the motor."""
    vehicle = pulled(RUBBING, damping_ratio=1.0)

    def command(t: float) -> Any:
        return [8.0 * (1.0 - np.cos(2.0 * np.pi * t)), 0.0, 0.0, 0.0]

    slow = ca.Scenario("cycles", np.zeros(8), gravity=0.0, duration=5.0, tendon_command=command)
    flight = ca.simulate(vehicle, slow, rtol=1e-8, sample=1e-3)
    bend = flight["bend"].to_numpy()[:, 0, 0]
    before, last = bend[3000:4000], bend[4000:5000]
    assert np.abs(last - before).max() < 1e-5 * np.ptp(bend)
    tensions, lengths = (
        flight[f"tendon_{name}"].to_numpy()[4000:] for name in ("tension", "length")
    )
    work = -np.trapezoid(tensions, lengths, axis=0).sum()
    part = flight["tendon_friction_power"].isel(time=slice(4000, None))
    taken = float(part.sum("tendon").integrate("time"))
    assert 0.0 < taken < work
    assert taken > 0.1 * work
    up, down = last[250], last[750]
    assert down - up > 0.02 * np.ptp(bend)


def random_rows(vehicle: ca.Vehicle, count: int) -> tuple[Any, Any]:
    """Tensions of tendons at random states, deflected guides included, and the bends."""
    from continuair.engine.engine import Drive, Engine
    from continuair.vehicle.layout import TENDONS

    engine, draw = Engine(vehicle, "coupled"), np.random.default_rng(2)
    layout = engine.layout
    log = np.zeros((1, count, layout.log))
    log[..., layout.attitude.stop - 1] = 1.0
    log[..., layout.bend] = draw.normal(size=(count, layout.bends))
    log[..., layout.bend_rate] = 20.0 * draw.normal(size=(count, layout.bends))
    slips = layout.of_state["tendon_slip"]
    log[..., slips] = 1e-3 * draw.normal(size=(count, slips.stop - slips.start))
    table = np.zeros((count, 1, layout.inputs))
    table[:, 0, layout.of_input["tendon_command"]] = 10.0 * draw.normal(size=(count, 4))
    acting = Drive(table, True, TENDONS, 9.81)
    names = ["tendon_tension", "tendon_end_tension"]
    seen = engine.observe(log, acting, names, np.arange(1))[0]
    found = {name: seen[:, layout.observed[name]] for name in names}
    return found, np.linalg.norm(log[0][:, layout.bend], axis=-1)


@pytest.mark.parametrize(
    "count", [2_000, pytest.param(100_000, marks=[pytest.mark.long])], ids=["few", "many"]
)
def test_no_tendon_pushes_or_holds_more_than_friction(count: int) -> None:
    found, bend = random_rows(pulled(RUBBING), count)
    near, far = (found[f"tendon_{name}"] for name in ("tension", "end_tension"))
    assert near.min() >= 0.0
    assert far.min() >= 0.0
    limit = np.exp(FRICTION * bend * 0.5 * 5.0 / 6.0)[:, None]
    assert (far <= near * limit * (1.0 + 1e-12)).all()
    assert (far * limit * (1.0 + 1e-12) >= near).all()


@pytest.mark.long
def test_tensions_of_150_newtons_neither_stall_nor_overflow() -> None:
    vehicle = pulled(RUBBING | {"friction": 0.5}, damping_ratio=0.02)

    def command(t: float) -> Any:
        return [150.0 * (t > 0.05), 0.0, 147.0 * (t > 0.05), 0.0]

    still = ca.Scenario("pulled", np.zeros(8), gravity=0.0, duration=0.3, tendon_command=command,
                        jumps=(0.05,))  # fmt: skip
    flight = ca.simulate(vehicle, still)
    assert int(flight["status"]) == 0
    assert int(flight["steps"]) < 20_000
    assert float(flight["tendon_end_tension"].min()) >= 0.0


@pytest.mark.long
def test_the_error_of_flights_with_friction_is_told() -> None:
    """Within a factor of 3, in 90 of 100 random flights whose error is above 1e-6."""
    draw = np.random.default_rng(11)
    told: list[float] = []
    true: list[float] = []
    while len(true) < 100:
        friction, holding = draw.uniform(0.05, 0.6), 10.0 ** draw.uniform(3.0, 4.5)
        vehicle = pulled({"angles": FOUR, "pretension": draw.uniform(0.5, 5.0),
                          "friction": friction, "friction_stiffness": holding},
                         damping_ratio=0.02)  # fmt: skip
        scenario = floating(vehicle, 0.15)
        coarse = ca.simulate(vehicle, scenario, rtol=1e-4, check=True, sample=0.01)
        fine = ca.simulate(vehicle, scenario, rtol=1e-9, sample=0.01)
        away = np.linalg.norm(coarse["tip_position"] - fine["tip_position"], axis=-1).max() / 0.5
        if away > 1e-6:
            told.append(float(coarse["error_estimate"]))
            true.append(float(away))
    ratio = np.array(told) / np.array(true)
    assert ((ratio > 1.0 / 3.0) & (ratio < 3.0)).sum() >= 90
