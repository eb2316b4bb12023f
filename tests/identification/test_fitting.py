"""Fits to recorded flights recover what made them, and say what they cannot tell."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.identification import Fit, fit, load_recording
from continuair.identification.aliasing import of_fast_swings
from continuair.identification.recording import MEASURED
from continuair.vehicle.vehicle_file import as_toml, write_vehicle
from tests.identification.flights import NOISE, record, true_vehicle
from tests.refusals import assert_refused, numbers_of, refused

pytestmark = pytest.mark.targets

FIELDS = ("arm.youngs_modulus", "arm.damping_ratio", "uav.mass", "arm.disks.0.mass")
TRUTH = np.array([40e9, 0.03, 1.6, 0.05])
WRONG = dict(zip(FIELDS, (60e9, 0.06, 2.0, 0.08), strict=True))


@pytest.fixture(autouse=True)
def own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def fitted(
    fields: tuple[str, ...] = FIELDS,
    test: str | None = None,
    seed: int | None = None,
    changes: dict[str, Any] = WRONG,
    duration: float = 1.0,
) -> Fit:
    record(Path("flight.csv"), test=test, seed=seed, duration=duration)
    start = true_vehicle().replace(changes)
    return fit(start, load_recording("flight.csv"), fields, test=test)


def test_a_flight_without_noise_gives_back_its_vehicle_to_six_digits() -> None:
    found = fitted()
    assert found.converged
    np.testing.assert_allclose(found.values, TRUTH, rtol=1e-5)
    assert found.doubts == ()


def test_a_noisy_flight_gives_back_its_vehicle_within_its_standard_errors() -> None:
    found = fitted(seed=1)
    off = (found.values - TRUTH) / found.errors
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(off**2)) < 2.0
    # Small enough to mean something, and the noise that was put in is what is left over.
    assert (found.errors / TRUTH < [0.01, 0.02, 0.002, 0.03]).all()
    np.testing.assert_allclose(list(found.deviations.values()), list(NOISE.values()), rtol=0.15)


def fitted_from_softer(times: float) -> Fit:
    """A stiff arm with little damping, fitted from a vehicle that is softer."""
    changes = {"arm.length": 0.4, "arm.radius": 0.008, "arm.damping_ratio": 0.005}
    stiff = true_vehicle().replace(changes | {"arm.disks": [{"position": 0.4, "mass": 0.01}]})
    record(Path("flight.csv"), seed=1, duration=0.3, vehicle=stiff, step=5e-5)
    start = stiff.replace({"arm.youngs_modulus": 40e9 / times})
    return fit(start, load_recording("flight.csv"), FIELDS[:2])


@pytest.mark.long
def test_a_fit_from_a_far_softer_arm_is_not_biased_by_the_steps_of_its_start() -> None:
    far, near = fitted_from_softer(20.0), fitted_from_softer(1.0)
    assert far.converged and far.doubts == ()
    # At the steps of the start the stiffness would be off by two standard errors.
    assert (np.abs(far.values - near.values) < 0.05 * near.errors).all()


@pytest.mark.long
def test_a_fit_whose_steps_never_follow_the_vehicle_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("continuair.identification.replay._MOST_FINER", 1.0)
    found = fitted_from_softer(20.0)
    assert not found.converged
    assert any("faster" in doubt for doubt in found.doubts)


@pytest.mark.long
def test_a_fit_that_stops_before_its_minimum_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("continuair.identification.problem._MOST", 2)
    found = fitted()
    assert not found.converged
    assert (np.abs(found.values - TRUTH) > 3.0 * found.errors).any()
    assert any("converged" in doubt for doubt in found.doubts)


@pytest.mark.long
def test_standard_errors_are_the_spread_of_repeated_flights() -> None:
    fields = FIELDS[:2]
    fits = [fitted(fields, "D", seed, {k: WRONG[k] for k in fields}) for seed in range(12)]
    spread = np.std([found.values for found in fits], axis=0, ddof=1)
    # The spread of 12 has itself an error of a fifth.
    np.testing.assert_allclose(spread, fits[0].errors, rtol=0.7)


@pytest.mark.long
def test_a_swing_that_rows_do_not_follow_is_in_doubt() -> None:
    """20 rows a second of an arm that swings at 7.8 Hz, from one of twice the stiffness."""
    record(Path("flight.csv"), test="D", seed=1)
    recording, field = load_recording("flight.csv"), "arm.youngs_modulus"
    rare = {
        name: getattr(recording, name)[::10] for name in ("time", "position", "attitude", "bend")
    }
    start = true_vehicle().replace({field: 80e9})
    rarely = dataclasses.replace(recording, inputs=None, **rare)
    assert not fit(start, recording, [field], test="D").doubts
    # A free swing hangs on the UAV, too.
    for vehicle, fitted_field in ((start, field), (true_vehicle(), "uav.inertia.1.1")):
        doubt = fit(vehicle, rarely, [fitted_field], test="D").doubts[-1]
        assert {7.84, 20.0, 12.2} <= set(numbers_of(doubt))


def test_rows_in_bursts_follow_no_swing_better_than_bursts() -> None:
    vehicle, even = true_vehicle(), 0.05 * np.arange(20)
    assert of_fast_swings(vehicle, vehicle, np.arange(200) / 200.0) == ()
    (told,) = of_fast_swings(vehicle, vehicle, np.sort(np.concatenate([even, even + 1e-3])))
    assert {7.84, 20.8} <= set(numbers_of(told))
    gap = np.concatenate([np.arange(35), np.arange(65, 101)]) / 100.0
    assert len(of_fast_swings(vehicle, vehicle, gap)) == 1


@pytest.mark.long
def test_parameters_that_only_act_together_are_reported_as_such() -> None:
    fields = ("arm.youngs_modulus", "arm.damping_ratio", "uav.mass", "uav.inertia.0.0")
    same = {"uav.mass": 1.6, "arm.youngs_modulus": 40e9}
    found = fitted((*fields, "arm.kappa_s"), changes=same, duration=0.5)
    assert any("arm.kappa_s" in doubt for doubt in found.doubts)
    assert found.errors[-1] == np.inf
    assert np.isfinite(found.errors[:-1]).all()
    rod = ("arm.youngs_modulus", "arm.radius", "arm.density")
    together = fitted(rod, changes={}, duration=0.3)
    assert any("cannot tell" in doubt and "arm.radius" in doubt for doubt in together.doubts)


@pytest.mark.long
def test_all_fields_that_act_together_have_no_standard_errors() -> None:
    """Where no known force acts, masses, stiffness and damping times one factor fly the same, the
    mass and the damping with but a hundredth of the combination in columns of norm 1."""
    damped = ca.load_vehicle("paper").replace({"arm.damping": 1e-3})
    record(Path("flight.csv"), test="B", seed=1, duration=0.5, vehicle=damped)
    fields = ("uav.mass", "uav.inertia.1.1", "arm.density", "arm.youngs_modulus", "arm.damping")
    found = fit(damped, load_recording("flight.csv"), fields, test="B")
    assert (found.errors == np.inf).all()


def test_few_rows_say_that_they_cannot_tell_what_is_noise() -> None:
    record(Path("flight.csv"), test="D", seed=1, duration=0.1)
    found = fit(true_vehicle(), load_recording("flight.csv"), ["arm.youngs_modulus"], test="D")
    assert any(21 in numbers_of(doubt) for doubt in found.doubts)


@pytest.mark.long
def test_arms_that_swing_for_long_do_not_tell_apart_what_acts_together() -> None:
    """Over 70 rad of a swing, what differences of second order leave looks like information."""
    swinging = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.002})
    record(Path("flight.csv"), test="B", seed=1, vehicle=swinging)
    fields = ("arm.youngs_modulus", "arm.density", "arm.radius")
    found = fit(swinging, load_recording("flight.csv"), fields, test="B")
    assert (found.errors == np.inf).all()
    assert any("apart" in doubt for doubt in found.doubts)


@pytest.mark.long
def test_what_lies_at_the_edge_of_what_a_vehicle_can_have_is_fitted_and_doubted() -> None:
    """The disk is at the arm's end, beyond which there is none: differences go to one side."""
    fields = ("arm.disks.0.position", "arm.disks.0.mass")
    found = fitted(fields, seed=3, changes={"arm.disks.0.mass": 0.04})
    truth = true_vehicle().arm.disks[0]
    off = np.abs(found.values - [truth.position, truth.mass])
    assert (found.errors > 1e-7).all() and (off < 5.0 * found.errors).all()
    assert any("arm.disks.0.position" in doubt for doubt in found.doubts)


def test_a_test_does_not_tell_what_rotors_did() -> None:
    record(Path("flight.csv"), test="C", duration=0.1)
    rotors = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 12.0], "lag": 0.04}
    furnished = true_vehicle().replace({"uav.rotors": rotors | {"torque_per_thrust": 0.016}})
    with refused("test"):
        fit(furnished, load_recording("flight.csv"), ["uav.mass"], test="C")


def test_what_a_flight_hardly_excites_is_warned_about() -> None:
    # A free fall in a plane turns about one axis; in its first tenth of a second, noise hides
    # what the mass of the UAV does to the bend.
    record(Path("flight.csv"), test="B", seed=1, duration=0.1)
    recording = load_recording("flight.csv")
    vague = fit(true_vehicle(), recording, ["uav.mass"], test="B")
    assert any("uav.mass" in doubt for doubt in vague.doubts)
    silent = fit(true_vehicle(), recording, ["uav.inertia.2.2"], test="B")
    assert any("uav.inertia.2.2" in doubt for doubt in silent.doubts)


def test_a_written_vehicle_is_read_back_as_it_was() -> None:
    vehicle = true_vehicle()
    write_vehicle(vehicle, "fitted.toml", ["a comment"])
    assert ca.load_vehicle("fitted.toml") == vehicle
    turned = vehicle.replace({"uav.inertia": [[2, 0.1, 0], [0.1, 2, 0], [0, 0, 3]]})
    assert ca.Vehicle(**tomllib.loads(as_toml(turned))) == turned


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli.app, ["identify", *arguments])


def test_the_command_writes_the_fitted_vehicle_and_shows_standard_errors() -> None:
    record(Path("flight.csv"), test="D", seed=1)
    write_vehicle(true_vehicle().replace({"arm.youngs_modulus": 55e9}), "start.toml")
    options = ["--data", "flight.csv", "--vehicle", "start.toml", "--test", "D"]
    result = run(*options, "--out", "fitted.toml", "--json", "-")
    assert result.exit_code == 0, result.output
    assert "standard error" in result.stderr
    found = ca.load_vehicle("fitted.toml")
    assert found.arm.youngs_modulus == pytest.approx(40e9, rel=0.01)
    assert found.arm.damping_ratio == pytest.approx(0.03, rel=0.05)
    assert '"arm.youngs_modulus"' in result.stdout


def broken(row: int | None = None, column: str = "", text: str = "", **renamed: str) -> None:
    """Spoil one cell of the recorded flight, or rename columns."""
    record(Path("flight.csv"))
    lines = [line.split(",") for line in Path("flight.csv").read_text().splitlines()]
    if row is not None:
        lines[row][lines[0].index(column)] = text
    lines[0] = [renamed.get(name, name) for name in lines[0]]
    Path("flight.csv").write_text("\n".join(",".join(cells) for cells in lines) + "\n")


@pytest.mark.parametrize(
    ("spoil", "field", "fact"),
    [
        ({"bend_x": "kappa_x"}, "bend_x", "kappa_x"),
        ({"row": 7, "column": "qx", "text": "nan"}, "qx", "row 7"),
        ({"row": 7, "column": "z", "text": ""}, "z", "row 7"),
        ({"row": 9, "column": "time", "text": "12.5"}, "time", "row 9"),
        ({"row": 4, "column": "qw", "text": "3"}, "qx qy qz qw", "row 4"),
    ],
)
def test_an_unusable_recording_is_refused_in_one_sentence(
    spoil: dict[str, Any], field: str, fact: str
) -> None:
    broken(**spoil)
    before = sorted(Path().iterdir())
    result = run("--data", "flight.csv", "--vehicle", "paper", "--out", "fitted.toml")
    assert_refused(result, field, fact, place="flight.csv")
    assert sorted(Path().iterdir()) == before


@pytest.mark.parametrize(
    ("heading", "cell", "field", "fact"),
    [
        ("time", '"0.1', "data", "line 7"),
        ("time,x", "0.1", "x", "twice"),
        ('"two\nlines"', "0.1", "time", "two lines, x"),
        (3000 * "x", "0.1", "time", "xxx..."),
    ],
)
def test_a_file_is_never_printed_nor_a_sentence_broken(
    heading: str, cell: str, field: str, fact: str
) -> None:
    record(Path("flight.csv"))
    lines = Path("flight.csv").read_text().splitlines()
    lines[0] = lines[0].replace("time", heading)
    lines[7] = cell + lines[7][lines[7].index(",") :]
    Path("flight.csv").write_text("\n".join(lines) + "\n")
    result = run("--data", "flight.csv", "--vehicle", "paper")
    assert_refused(result, field, fact, place="flight.csv")
    assert len(result.stderr) < 500


@pytest.mark.parametrize(
    ("arguments", "field", "fact"),
    [
        (("--fit", "arm.youngs_modulu"), "fit", "use arm.youngs_modulus"),
        (("--fit", "arm.damping_ratio"), "arm.damping_ratio", "0"),
        (("--fit", "uav.mass,uav.mass"), "fit", "uav.mass"),
        (("--test", "X"), "test", "A, B, C, D"),
        (("--json", "no/fit.json"), "json", "no/fit.json"),
        (("--out", "no/folder.toml"), "out", "no/folder.toml"),
    ],
)
def test_unusable_options_are_refused_in_one_sentence(
    arguments: tuple[str, ...], field: str, fact: str
) -> None:
    record(Path("flight.csv"))
    assert_refused(run("--data", "flight.csv", "--vehicle", "paper", *arguments), field, fact)


@pytest.mark.long
def test_a_fit_that_leaves_motion_over_says_that_it_is_no_noise() -> None:
    record(Path("flight.csv"), test="A", seed=1)
    recording = load_recording("flight.csv")
    right, wrong = (
        fit(true_vehicle(), recording, ["arm.youngs_modulus"], test=test) for test in "AB"
    )
    assert not right.doubts
    assert any("position, beyond noise" in doubt for doubt in wrong.doubts)


def test_a_fit_needs_data_a_vehicle_and_inputs() -> None:
    for given, missing in ((("--vehicle", "paper"), "--data"), (("--data", "a.csv"), "--vehicle")):
        result = run(*given)
        assert result.exit_code == 2
        assert "Missing option" in result.stderr and missing in result.stderr
    record(Path("flight.csv"), test="D")
    Path("empty.csv").write_text("")
    Path("short.csv").write_text(",".join(MEASURED) + "\n")
    for name, place, field in (
        ("no.csv", "", "data"),
        ("flight.csv", "flight.csv", "recording"),
        ("empty.csv", "empty.csv", "time"),
        ("short.csv", "short.csv", "recording"),
    ):
        assert_refused(run("--data", name, "--vehicle", "paper"), field, place=place)


@pytest.mark.long
def test_a_vehicle_that_turns_otherwise_than_the_recorded_one_is_in_doubt() -> None:
    """An inertia 20 % too large, which is not fitted, bends what is."""
    record(Path("flight.csv"), seed=1)
    recording, right = load_recording("flight.csv"), true_vehicle()
    wrong = right.replace({"uav.inertia": 1.2 * np.asarray(right.uav.inertia)})
    assert not fit(right, recording, ["uav.mass"]).doubts
    told = fit(wrong, recording, ["uav.mass"]).doubts
    assert any("attitude, beyond noise" in doubt for doubt in told)


def test_bends_that_no_arm_reaches_are_refused() -> None:
    record(Path("flight.csv"), duration=1.0)
    recording = load_recording("flight.csv")
    beyond = dataclasses.replace(recording, bend=np.full(recording.bend.shape, 900.0))
    with refused("bend"):
        fit(true_vehicle(), beyond, ("uav.mass",))


def test_a_fit_in_which_no_flight_lasts_is_refused() -> None:
    """Moments bend every arm past a full circle."""
    record(Path("flight.csv"), duration=1.0)
    recording = load_recording("flight.csv")
    assert recording.inputs is not None
    inputs = recording.inputs.copy()
    inputs[:, 6:] = 1e4
    with refused("simulations"):
        fit(true_vehicle(), dataclasses.replace(recording, inputs=inputs), ("uav.mass",))
