"""Limits in a loop: flights simulated directly beside them agree, and what the advice tells."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.analysis.limits import Limit
from continuair.figures import advise as figures
from continuair.scenario.tracking_task import without_rotors
from continuair.studies.advise import excitations, frequencies
from continuair.studies.advise.excitations import excite
from continuair.studies.advise.notes import notes
from continuair.studies.advise.verdicts import verdict
from continuair.studies.excited_flights import Loop, excited, flown_errors
from continuair.studies.tables import number_below
from continuair.studies.timing import median_ratios
from tests.new_user import NEW_USER
from tests.refusals import numbers_of

Array = np.ndarray
TOLERANCE = 0.02


def direct_error(vehicle: ca.Vehicle, name: str, hertz: float, bandwidth: float) -> float:
    """Error of the decoupled model in a position loop, of a flight that is written out here.

    It swells over three cycles or eight periods of the arm, and counts for as long again and half.
    """
    arm, clamped = vehicle.arm, vehicle.arm.clamped_frequency / (2.0 * np.pi)
    bend = 0.2 / arm.length * np.array([1.0, 1.0]) / np.sqrt(2.0)
    held = ca.trim(vehicle, bend=bend)
    until = max(3.0 / hertz, 8.0 / clamped)
    x, _, z = np.transpose(vehicle.uav.mount)
    inertia = vehicle.uav.inertia[1][1] + _about_b(vehicle, x, z)
    size = {
        "bend": 0.2 * arm.bending_stiffness,
        "tip": 0.2 * 2.0 * arm.bending_stiffness / arm.length**2,
        "force": 0.2 * vehicle.mass * 9.81,
        "moment": 0.1 * inertia * (2.0 * np.pi * hertz) ** 2,
    }[name]

    def load(t: float) -> float:
        share = np.sin(0.5 * np.pi * min(t / until, 1.0)) ** 2
        return float(share * np.sin(2.0 * np.pi * hertz * t))

    given: dict[str, Any] = {"bend_moment": held.bend_moment}
    if name == "bend":
        given["bend_moment"] = lambda t: held.bend_moment + size * load(t) * np.array([1.0, 0.0])
    elif name == "tip":
        given["tip_wrench"] = lambda t: size * load(t) * np.eye(6)[0]
    elif name == "force":
        given["force"] = lambda t: size * load(t) * np.eye(3)[0]
    else:
        given["moment"] = lambda t: size * load(t) * np.eye(3)[1]
    law = ca.flight_controller(vehicle, attitude_bandwidth=bandwidth, bend_bandwidth=0.0)
    scenario = ca.Scenario("direct", held.q, duration=2.5 * until, controller=law, **given)
    names = ["tip_position", "tip_attitude"]
    sample = 0.004 * max(1, int(1.0 / (40.0 * clamped) / 0.004))
    one, other = (
        ca.simulate(vehicle, scenario, model=model, sample=sample, variables=names).sel(
            time=slice(until, None)
        )
        for model in ("coupled", "decoupled")
    )
    found = ca.compare(one, other)
    return float(max(found["rmse_t_m"] / arm.length, found["angle_rad"]))


def _about_b(vehicle: ca.Vehicle, x: float, z: float) -> float:
    """Inertia of a straight, thin arm with its disks about B's y axis [kg m²]."""
    arm = vehicle.arm
    along = np.linspace(0.0, arm.length, 20001)
    thin = arm.backbone_mass * float(np.mean(x**2 + (z - along) ** 2))
    turned = arm.transverse_inertia_per_length * arm.length
    disks = sum(
        disk.transverse_inertia + disk.mass * (x**2 + (z - disk.position) ** 2)
        for disk in arm.disks
    )
    return float(thin + turned + disks)


def assert_flights_agree(vehicle: ca.Vehicle, name: str, bandwidth: float) -> None:
    """The limit, as a flight says that lasts longer and swells otherwise."""
    found = excite(vehicle, name, TOLERANCE, Loop("position", bandwidth))["models"]["decoupled"]
    hz, limit = np.array(found["hz"]), found["limit_hz"]
    below = 0.97 * limit if math.isfinite(limit) else hz[-1]
    beyond = hz[0] if math.isnan(limit) else 1.03 * hz[np.searchsorted(hz, limit) + 1 :][:1]
    if not math.isnan(limit):
        assert direct_error(vehicle, name, float(below), bandwidth) <= TOLERANCE
    if not math.isinf(limit):
        assert direct_error(vehicle, name, float(np.squeeze(beyond)), bandwidth) > TOLERANCE


SLOW = pytest.mark.soak


@pytest.mark.long
@pytest.mark.parametrize(
    "bandwidth", [pytest.param(4.0, marks=SLOW), pytest.param(8.0, marks=SLOW), 20.0]
)
def test_a_limit_is_where_flights_beside_it_leave_the_tolerance(bandwidth: float) -> None:
    for name in ("bend", "tip"):
        assert_flights_agree(NEW_USER, name, bandwidth)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(10))
def test_limits_of_random_vehicles_are_where_flights_beside_them_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mass, length = rng.uniform(1.0, 4.0), rng.uniform(0.25, 0.8)
    inertia = mass * rng.uniform(0.006, 0.012)
    arm_mass = mass * rng.uniform(0.01, 0.08)
    clamped = rng.uniform(6.0, 30.0)
    vehicle = ca.Vehicle(
        name="random",
        uav={"mass": mass, "inertia": [inertia, inertia, 1.8 * inertia]},
        arm={
            "length": length,
            "mass_per_length": arm_mass / length,
            "bending_stiffness": clamped**2 * arm_mass * length**3 / 5.0,
            "damping_ratio": rng.uniform(0.02, 0.1),
        },
    )
    name = ("bend", "moment", "force", "tip")[seed % 4]
    assert_flights_agree(vehicle, name, (4.0, 8.0, 20.0)[seed % 3])


@pytest.mark.slow
def test_an_attitude_loop_lets_the_decoupled_model_do_for_faster_motion() -> None:
    limits = [
        excite(NEW_USER, "bend", TOLERANCE, loop)["models"]["decoupled"]["limit_hz"]
        for loop in (Loop("none"), Loop("attitude", 8.0), Loop("attitude", 20.0))
    ]
    assert limits[0] < limits[1] < limits[2]


@pytest.mark.long
def test_an_attitude_loop_flies_as_long_at_every_frequency_as_nothing_holds_the_place() -> None:
    """Sideways the models drift apart with the square of the time: flights of other durations
    beside each other would be of other errors."""
    loop = Loop("attitude", 8.0)
    beside = excitations._errors(NEW_USER, "tip", [0.155, 0.165], loop)["decoupled"]
    assert abs(beside[1] / beside[0] - 1.0) < 0.3
    shorter = flown_errors(NEW_USER, "tip", np.array([0.165]), loop, frequencies.LONGEST / 3.0)
    assert shorter["decoupled"][0] < 0.5 * beside[1]
    case = results({"bend": 0.6, "moment": 0.5}, {"bend": 0.5, "moment": 0.4})
    case["loop"] |= {"name": "attitude", "drifting_s": 86.2}
    (told,) = (each for each in notes(case) if "does not hold the position" in each)
    assert "flights of 86 s" in told


def test_errors_of_a_slow_loop_are_compared_with_flights_in_which_it_has_settled() -> None:
    """The integral of the preset's loop takes 2 s, in which its arm swings 18 times: twice the ten
    periods of a flight tell nothing of where it ends."""
    vehicle, loop = ca.load_vehicle("paper"), Loop("position")

    def error(least: float) -> Any:
        return excitations._errors(vehicle, "tip", [0.5], loop, 1.0, least)["decoupled"][0]

    none = Limit(math.nan, np.empty(0), np.empty(0))
    moderate = {"decoupled": float(error(0.0))}
    found = excitations._settled(vehicle, "tip", moderate, {"decoupled": none}, loop)["decoupled"]
    assert abs(error(20.0) / moderate["decoupled"] - 1.0) < 0.1
    assert found["settled"] is False
    assert found["longer_error"] == pytest.approx(error(400.0), rel=0.15)
    assert found["longer_error"] > 1.4 * moderate["decoupled"]


def test_printed_limits_are_never_beyond_those_that_were_found() -> None:
    for value in np.geomspace(0.011, 97.0, 500):
        text = number_below(float(value))
        assert float(text) <= value < 1.1 * float(text)
    assert [number_below(each) for each in (0.29, 2.5, 25.0, 109.0)] == ["0.29", "2.5", "25", "100"]


def results(decoupled: dict[str, float], independent: dict[str, float]) -> dict[str, Any]:
    def entry(limit: float) -> dict[str, Any]:
        settled = {"settled": True, "limit_settled": True}
        return {
            "limit_hz": limit,
            "tolerable": True,
            "hz": [0.1, 3.0],
            "errors": [0.01, 0.03],
            **settled,
        }

    parts = {
        name: {
            "models": {"decoupled": entry(limit), "independent": entry(independent[name])},
            "responsible": "inertia",
        }
        for name, limit in decoupled.items()
    }
    once = {"limit_hz": None, "tolerable": True, "error": 0.01}
    parts["release"] = {"models": {"decoupled": once, "independent": once}}
    vehicle = ca.load_vehicle("slender")
    found: dict[str, Any] = {
        "vehicle": vehicle.describe(),
        "loop": {"name": "none", "controller": None, "growth_1_s": None, "drifting_s": None},
        "least_settled_hz": 0.3,
        "hovering_hz": [1.0, 9.0],
        "groups": dict.fromkeys(
            ("mass_ratio", "inertia_ratio", "gravity_number", "slenderness", "damping_ratio"), 0.06
        ),
        "excitations": parts,
        "tracking": {},
        "tracking_notes": [],
    }
    found["groups"]["slenderness"] = 0.01
    of = {model: verdict(found, "hover", model) for model in ("decoupled", "independent")}
    return found | {"verdicts": {"hover": of}}


def test_notes_tell_where_independent_is_better_and_whose_limit_it_is() -> None:
    found = notes(results({"bend": 2.0, "moment": 0.5}, {"bend": 1.0, "moment": 0.9}))
    assert numbers_of(found[0]) == [0.9, 0.5] and "independent" in found[0]
    assert numbers_of(found[1]) == [2.0] and "moment" in found[1]
    quiet = notes(results({"bend": 0.6, "moment": 0.5}, {"bend": 0.5, "moment": 0.4}))
    assert len(quiet) == 2 and "0.3 Hz" in quiet[0] and "0.1 Hz" in quiet[1]


def test_a_note_tells_that_gravity_swings_an_arm_faster_than_anything_that_was_tried() -> None:
    """A limp arm: what is tried ends at three times the frequency of its clamped stiffness."""
    case = results({"bend": 0.6, "moment": 0.5}, {"bend": 0.5, "moment": 0.4})
    case["hovering_hz"] = [3.94, 9.0]
    assert any("3.9 Hz" in note and " 3 Hz" in note for note in notes(case))


def test_a_note_tells_whose_flights_ended_early() -> None:
    case = results({"bend": 0.6, "moment": 0.5}, {"bend": 0.5, "moment": 0.4})
    entry = case["excitations"]["moment"]["models"]["decoupled"]
    entry |= {"hz": [0.1, 0.5, 1.0, 3.0], "errors": [0.01, math.inf, math.inf, 0.02]}
    for whose, error in (("of decoupled", math.inf), ("of the coupled model", math.nan)):
        entry["errors"] = [0.01, error, error, 0.02]
        (told,) = (each for each in notes(case) if "ended early" in each)
        assert told.startswith("moment: ") and whose in told
        assert numbers_of(told) == [2.0, 4.0, 0.5, 1.0]
    entry["errors"] = [0.01, 0.02, 0.03, 0.02]
    assert not [each for each in notes(case) if "ended early" in each]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:controller flight controller")
def test_a_loop_in_which_the_coupled_model_alone_is_lost_has_no_errors() -> None:
    """A soft side arm with a load swings a tight loop up; the decoupled model knows none of it."""
    section = {"length": 0.7, "mass_per_length": 0.05, "bending_stiffness": 2.1952}
    turned = [0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5)]
    tip = {"mass": 0.4, "inertia": [1e-4, 1e-4, 5e-5]}
    arm = {"mount": [0.05, 0.0, 0.0], "attitude": turned, "tip": tip}
    vehicle = ca.Vehicle(
        name="side",
        uav={"mass": 2.6, "inertia": [0.03, 0.03, 0.05]},
        arm=[arm | {"section": [section | {"damping_ratio": 0.005}]}],
    )
    loop = Loop("position", 40.0)
    found = ca.run_pairs(vehicle, excited(vehicle, "tip", 0.5, loop), sample=0.01)
    assert (found["status"].to_numpy() > 0).tolist() == [[True, False]]
    for errors in flown_errors(vehicle, "tip", np.array([0.5]), loop).values():
        assert np.isnan(errors).all()
    assert excitations._alike(math.nan, math.nan) is None
    assert excitations._alike(0.02, math.inf) is False


def test_a_note_tells_that_a_loop_is_unstable_with_the_arm_bent() -> None:
    case = results({"bend": 0.6, "moment": 0.5}, {"bend": 0.5, "moment": 0.4})
    told = []
    for growth in (-0.2, 0.18):
        case["loop"] = {
            "name": "attitude",
            "controller": None,
            "growth_1_s": growth,
            "drifting_s": None,
        }
        told.append([each for each in notes(case) if "the loop is unstable" in each])
    assert not told[0] and "0.18 1/s" in told[1][0]


def test_notes_tell_what_the_atlas_does_not_hold_and_what_has_not_settled() -> None:
    case = results({"bend": 0.6, "moment": 0.5}, {"bend": 0.5, "moment": 0.4})
    case["loop"]["name"] = "position"
    case["groups"] |= {"gravity_number": 2.5, "bandwidth": 1.0}
    del case["groups"]["slenderness"]  # as of an arm by its stiffness
    case["vehicle"] = NEW_USER.describe()
    case["excitations"]["bend"]["models"]["decoupled"] |= {
        "limit_settled": False, "limit_longer_error": 0.0361
    }  # fmt: skip
    unsettled, _, outside = notes(case)
    assert unsettled.startswith("bend, decoupled: ") and 0.036 in numbers_of(unsettled)
    for part in ("gravity number 2.5 (0.002 to 2 there)", "disks", "mount"):
        assert part in outside
    assert "loop" not in outside and "bandwidth" not in outside
    assert not any(part in outside for part in ("rotors", "drag", "unequal"))
    case["loop"]["name"] = "attitude"
    *_, outside = notes(case)
    assert "gravity number 2.5 (0.001 to 0.3 there)" in outside and "loop attitude" in outside
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 15.0]}
    changes = {"uav.rotors": rotors | {"torque_per_thrust": 0.02}, "arm.drag_coefficient": 1.1}
    turning = NEW_USER.uav.inertia * np.diag([1.5, 1.0, 1.0])
    case["vehicle"] = NEW_USER.replace(changes | {"uav.inertia": turning}).describe()
    *_, plane, outside = notes(case)
    assert "rotors, drag, unequal inertia in roll and pitch" in outside
    pitch = NEW_USER.uav.inertia[1][1]
    assert "along x and about y" in plane
    assert f"{pitch:.2g} kg m², and {1.5 * pitch:.2g} about x" in plane
    case["excitations"] = {}
    assert not [each for each in notes(case) if each.startswith("Loads push")]


def test_tracking_leaves_out_rotors_that_cannot_push_in_any_direction() -> None:
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 15.0]}
    rotors |= {"lag": 0.03, "torque_per_thrust": 0.02}
    flat = NEW_USER.replace({"uav.rotors": rotors})
    assert without_rotors(NEW_USER) == (NEW_USER, [])
    flown, told = without_rotors(flat)
    assert flown.uav.rotors is None and "without rotors" in told[0]


def test_ratios_of_times_are_medians_of_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = iter(np.cumsum([0, 9, 0, 9, 0, 1, 0, 2, 0, 10, 0, 20, 0, 2, 0, 6]).tolist())
    monkeypatch.setattr("continuair.studies.timing.perf_counter", lambda: next(ticks))
    # Rounds of (1, 2), (10, 20) and (2, 6): medians over each other would give 3, pairs give 2.
    found = median_ratios({"one": lambda: None, "two": lambda: None}, "one", 3)
    assert found == {"two": 2.0}


@pytest.mark.parametrize(
    ("coupled_px", "says"),
    [(math.nan, "undecided"), (0.1, "decoupled flights are lost, or rounding decides them")],
)
def test_an_advice_on_a_lost_target_is_drawn(tmp_path: Path, coupled_px: float, says: str) -> None:
    entry = {"speed_m_s": [0.1, 0.2], "ds_px": [math.nan, math.nan], "limit_m_s": math.nan}
    found = {
        "vehicle": {"name": "lost", "arm": {}},
        "loop": {"name": "position"},
        "pixels": 0.7,
        "excitations": {},
        "tracking": {
            "track:M": {
                "models": {"decoupled": entry, "independent": entry},
                "rms_px": coupled_px,
            }
        },
    }
    figure = figures.advice(found)
    assert says in [text.get_text() for axes in figure.axes for text in axes.texts]
    figure.savefig(tmp_path / "lost.png")
    assert (tmp_path / "lost.png").stat().st_size > 3_000
