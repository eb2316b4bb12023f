"""Releases of an arm on a fixed base: the clamped flight, its decay, files, fits and commands."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.errors import ContinuairWarning
from continuair.identification import (
    Bench,
    Releases,
    clamped,
    decay_of,
    fit_jointly,
    load_bench,
    load_releases,
    onset,
    validate_releases,
)
from continuair.identification.clamped import Clamped
from continuair.vehicle.uncertain import load_uncertain
from continuair.vehicle.vehicle_file import write_vehicle
from tests.identification.benches import (
    BENCH,
    FIELDS,
    TRUE,
    bench_vehicle,
    released,
    start_vehicle,
    written,
)
from tests.refusals import assert_refused, refused

MASS = 0.05


BENT = (4.0, -2.0, -3.0, 5.0)


def let_go(vehicle: ca.Vehicle, bend: Any, *variables: str, **how: Any) -> Any:
    """Return variables (samples, ...) of an arm that is let go on a fixed base."""
    given = {"samples": 60, "payload": 0.0} | how
    blank = (np.zeros((given["samples"], 4, 3)),)
    on_bench = Clamped(blank, BENCH, 100.0, given["payload"], False, {})
    start = np.append(bend, np.zeros(len(bend)))[None]
    flight = on_bench.flight(vehicle, start, given["samples"], list(variables))
    return [flight[name].to_numpy()[0].reshape(given["samples"], -1) for name in variables]


def polar(bend: Any) -> Any:
    """Return paper coordinates of a UAV at the origin with these bends."""
    at = np.reshape(bend, (-1, 2))
    arcs = np.column_stack([np.hypot(*at.T), np.arctan2(at[:, 1], at[:, 0])])
    return np.concatenate([np.zeros(6), arcs.ravel()])


@pytest.fixture
def exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate clamped arms to nine digits."""
    monkeypatch.setattr(clamped, "_PRECISION", 1e-9)


@pytest.mark.usefixtures("exact")
@pytest.mark.parametrize("payload", [0.0, MASS])
def test_an_arm_let_go_moves_as_on_a_uav_of_a_million_kilograms(payload: float) -> None:
    vehicle = bench_vehicle()
    heavy = vehicle.replace({"uav.mass": 1e6, "uav.inertia": [1e6, 1e6, 1e6]})
    scenario = ca.Scenario(
        "held",
        polar(BENT),
        force=(0.0, 0.0, 9.81 * (heavy.mass + payload)),
        duration=0.59,
        payload=ca.Payload(mass=payload) if payload else None,
    )
    flight = ca.simulate(heavy, scenario, sample=0.01, rtol=1e-9)
    coupled = flight["bend"].to_numpy().reshape(60, 4)
    (found,) = let_go(vehicle, BENT, "bend", payload=payload)
    assert np.abs(found - coupled).max() < 1e-6 * np.abs(coupled).max()


@pytest.mark.usefixtures("exact")
def test_an_arm_let_go_keeps_its_energy_without_damping() -> None:
    vehicle = bench_vehicle().replace(dict.fromkeys(FIELDS[2:4], 0.0))
    names = ("kinetic_energy", "gravity_energy", "elastic_energy")
    kinetic, *stored = let_go(vehicle, BENT, *names, samples=120)
    total = kinetic + sum(stored)
    assert np.ptp(total) < 1e-6 * np.ptp(kinetic)


def test_small_swings_have_the_clamped_frequency_and_damping() -> None:
    """Of the first mode, from its shape: `modes` of straight arms under gravity."""
    vehicle = bench_vehicle().replace({FIELDS[2]: 1e-4, FIELDS[3]: 5e-5})
    modes = ca.modes(vehicle, base="clamped")
    shape = modes.shapes[:, 0].real
    (bend,) = let_go(vehicle, 1e-2 * shape / np.abs(shape).max(), "bend", samples=150)
    path = np.zeros((150, 3))
    path[:, 0] = bend @ shape
    found = decay_of(path, 100.0)
    assert 2.0 * math.pi * found.frequency == pytest.approx(modes.frequencies[0], rel=1e-3)
    assert found.damping_ratio == pytest.approx(modes.damping[0], rel=1e-3)


def sine(rng: np.random.Generator | None = None, spread: float = 0.0) -> Any:
    """Return a damped sine (samples, 3) of 1.3 Hz and damping ratio 0.12 along a direction."""
    t, omega, zeta = np.arange(300) / 100.0, 2.0 * math.pi * 1.3, 0.12
    phase = omega * math.sqrt(1.0 - zeta**2) * t
    swing = np.exp(-zeta * omega * t) * (0.08 * np.cos(phase) + 0.02 * np.sin(phase))
    path = np.outer(swing, [0.6, -0.8, 0.0]) + [0.1, 0.2, -0.3]
    return path if rng is None else path + rng.normal(0.0, spread, path.shape)


def test_a_damped_sine_is_recovered() -> None:
    found = decay_of(sine(), 100.0)
    assert found.frequency == pytest.approx(1.3, rel=1e-6)
    assert found.damping_ratio == pytest.approx(0.12, rel=1e-6)
    assert found.misfit < 1e-6 * found.rms


def test_noise_leaves_a_damped_sine_unbiased() -> None:
    """Means of 200 are within 3.5 of their standard errors, which are below 0.1 %."""
    rng = np.random.default_rng(0)
    found = [decay_of(sine(rng, 3e-3), 100.0) for _ in range(200)]
    for name, true in (("frequency", 1.3), ("damping_ratio", 0.12)):
        values = np.array([getattr(each, name) for each in found])
        error = values.std(ddof=1) / len(values) ** 0.5
        assert error < 2e-3 * true
        assert abs(values.mean() - true) < 3.5 * error


@pytest.mark.parametrize("seed", range(20))
def test_the_start_of_motion_is_found_in_noise(seed: int) -> None:
    """Within two samples of a start of 0.5 m/s, with a false sample of 50 mm before it."""
    rng = np.random.default_rng(seed)
    hidden = int(rng.integers(20, 60))
    path = np.zeros((160, 3))
    moved = np.arange(160 - hidden) / 100.0
    path[hidden:, 1] = 0.1 * np.cos(5.0 * moved + 0.5 * math.pi) * np.exp(-0.5 * moved)
    path += rng.normal(0.0, 3e-4, path.shape)
    assert abs(onset(path, 100.0) - hidden) <= 2
    path[hidden - 10] += [0.05, 0.0, 0.0]
    assert abs(onset(path, 100.0) - hidden) <= 2


def fit_of_files(folder: Path, payloads: tuple[float, ...], fields: Any) -> Any:
    """Return the fit to releases read from files, one for each payload."""
    recordings = []
    for seed, mass in enumerate(payloads):
        path = written(folder / f"{seed}.csv", released(seed, payload=mass), still=8)
        recordings.append(load_releases(path, BENCH, payload=mass))
    return fit_jointly(start_vehicle().replace(known(fields)), recordings, fields)


def known(fields: Any) -> dict[str, float]:
    """Return the true values of all fields but some."""
    return {
        name: float(value) for name, value in zip(FIELDS, TRUE, strict=True) if name not in fields
    }


@pytest.mark.parametrize("payloads", [(0.0,), (0.0, MASS)])
def test_stiffness_and_damping_and_mass_are_recovered(
    tmp_path: Path, payloads: tuple[float, ...]
) -> None:
    """With y up and a base off the origin. Mass needs two payloads."""
    fields = FIELDS if len(payloads) > 1 else FIELDS[:4]
    found = fit_of_files(tmp_path, payloads, fields)
    truth = TRUE[: len(fields)]
    assert found.converged and not found.free
    assert (found.errors < 0.05 * truth).all()
    assert (np.abs(found.values - truth) < 3.0 * found.errors).all()
    assert all(rms == pytest.approx(5e-4, rel=0.05) for rms in found.rms.values())


def test_stiffness_damping_and_mass_scale_together_without_a_payload() -> None:
    names = (*FIELDS, "arm.limb.section.tip.mass_per_length")
    found = fit_jointly(start_vehicle(), [released(0)], names)
    assert len(found.free) == 1
    assert np.isinf(found.errors).all()


def test_fits_with_fields_of_their_own_combine_as_those_of_the_first_recording() -> None:
    recordings = [released(0), released(1, payload=MASS)]
    found = fit_jointly(bench_vehicle(), recordings, FIELDS[:1], own=FIELDS[2:3])
    first = ca.UncertainVehicle(found.vehicle, **found.uncertainty)  # type: ignore[arg-type]
    assert first.fields == (FIELDS[0], FIELDS[2])
    np.testing.assert_allclose(first.medians, found.values[:2])
    wider = found.degrees_of_freedom / (found.degrees_of_freedom - 2.0)
    errors = np.sqrt(np.diag(np.asarray(first.covariance)) / wider) * first.medians
    np.testing.assert_allclose(errors, found.errors[:2])


def test_a_vehicle_predicts_its_own_releases_with_another_payload() -> None:
    found = validate_releases(bench_vehicle(), released(7, payload=0.1))
    row = found.describe()
    for key in ("frequency_hz", "damping_ratio", "rms_mm"):
        values: Any = row[key]
        assert values["predicted"] == pytest.approx(values["measured"], rel=0.05)


def test_a_prediction_that_is_worse_than_an_arm_at_rest_is_told() -> None:
    """With another axis upwards, gravity bends the arm sideways."""
    wrong = replace(released(7), bench=replace(BENCH, up="z"))
    with pytest.warns(ContinuairWarning, match="up of the bench"):
        found = validate_releases(bench_vehicle(), wrong)
    assert found.error.mean() > np.mean([each.rms for each in found.measured])


# Files that cannot be used ------------------------------------------------------------------------


def changed(change: Callable[[Any], Any]) -> Releases:
    """Return releases whose positions are changed."""
    good = released(0, releases=3, samples=60)
    return replace(good, motions=tuple(change(motion.copy()) for motion in good.motions))


def holed(motion: Any) -> Any:
    """Return a motion with a gap."""
    motion[20, 2] = np.nan
    return motion


BAD: dict[str, Callable[[Any], Any]] = {
    "millimetres": lambda motion: 1e3 * motion,
    "another order": lambda motion: motion[:, ::-1],
    "a moved base": lambda motion: motion + [0.3, 0.0, 0.0],
    "gaps": holed,
    "too short": lambda motion: motion[:20],
    "a single row": lambda motion: motion[:1],
    "no rows": lambda motion: motion[:0],
    "nothing that moves": lambda motion: np.repeat(motion[:1], len(motion), axis=0),
    "rows in random order": lambda motion: motion[
        np.random.default_rng(0).permutation(len(motion))
    ],
}


@pytest.mark.parametrize("what", BAD)
def test_a_file_that_cannot_be_used_is_refused(tmp_path: Path, what: str) -> None:
    path = written(tmp_path / "bad.csv", changed(BAD[what]))
    with refused("data", place=path):
        load_releases(path, BENCH)


def test_releases_with_gaps_are_left_out_if_most_can_be_used(tmp_path: Path) -> None:
    good = released(0, releases=3, samples=60)
    motions = (holed(good.motions[0].copy()), *good.motions[1:])
    path = written(tmp_path / "some.csv", replace(good, motions=motions))
    with pytest.warns(ContinuairWarning):
        found = load_releases(path, BENCH)
    assert found.names == ("2", "3")


@pytest.mark.parametrize(
    ("pattern", "text", "field"),
    [
        (r"(?m)^2,[^,]*", "2,unseen", "x1"),
        (r"x4,y4,z4", "a,b,c", "x4"),
        (r"z4", "z4,x5,y5,z5", "data"),
        (r"^ID", "release", "ID"),
        (r"(?m)^2,", ",", "ID"),
        (r"(?m)^2,", "inf,", "ID"),
    ],
)
def test_cells_and_columns_that_cannot_be_used_are_refused(
    tmp_path: Path, pattern: str, text: str, field: str
) -> None:
    path = written(tmp_path / "bad.csv", released(0, releases=2, samples=60))
    path.write_text(re.sub(pattern, text, path.read_text("utf-8")), "utf-8")
    with refused(field, place=path):
        load_releases(path, BENCH)


def test_arguments_that_cannot_be_used_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "good.csv", released(0, releases=2, samples=60))
    with refused("payload"):
        load_releases(path, BENCH, payload=-0.1)
    with refused("rate"):
        load_releases(path, BENCH, rate=0.0)
    with refused("bench.markers"):
        Bench(markers=(0.2, 0.1))
    with refused("bench.up"):
        Bench(markers=(0.2,), up="up")
    with refused("vehicle"):
        released(0).starts(ca.load_vehicle("dual_arm"))
    with refused("bench.markers"):
        replace(released(0), bench=Bench(markers=(0.1, 0.2, 0.3, 0.4))).starts(bench_vehicle())
    with refused("fit"):
        fit_jointly(bench_vehicle(), [released(0)], ["arm.limb.section.base.stifness"])
    for given in ([], released(0), "releases", [bench_vehicle()]):
        with refused("measurements"):
            fit_jointly(bench_vehicle(), given, FIELDS[:1])  # type: ignore[arg-type]
    with refused("measurements"):  # twice the releases would give errors too small by √2
        fit_jointly(bench_vehicle(), [released(0), released(0)], FIELDS[:1])
    with refused("motions"):
        gap = np.where(np.arange(80)[:, None, None] < 1, np.nan, released(0).motions[0])
        replace(released(0), motions=(gap,)).starts(bench_vehicle())
    with refused("path"):
        onset(np.zeros((1, 3)), 100.0)


# Commands -----------------------------------------------------------------------------------------


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with a vehicle and releases with two payloads."""
    monkeypatch.chdir(tmp_path)
    write_vehicle(start_vehicle(), Path("start.toml"), ["A start."], beside=bench_table())
    written(Path("empty.csv"), released(0), still=8)
    written(Path("loaded.csv"), released(1, payload=MASS), still=8)
    return tmp_path


def bench_table() -> dict[str, dict[str, Any]]:
    """Return the table of the bench for a vehicle's file."""
    return {"bench": BENCH.describe()}


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli.app, list(arguments))


FIT = ("fit-release", "empty.csv", "loaded.csv", "--payload", "0", "--payload", f"{MASS}",
       "--vehicle", "start.toml", "--out", "fit.toml")  # fmt: skip


@pytest.mark.usefixtures("files")
def test_the_commands_fit_and_predict() -> None:
    result = run(*FIT, "--fit", ",".join(FIELDS))
    assert result.exit_code == 0, result.output
    fitted = ca.load_vehicle("fit.toml")
    for section, (stiffness, damping) in zip(
        fitted.arms[0].section, TRUE[:4].reshape(2, 2).T, strict=True
    ):
        assert section.bending_stiffness == pytest.approx(stiffness, rel=0.05)
        assert section.damping == pytest.approx(damping, rel=0.2)
    assert load_bench("fit.toml") == BENCH
    uncertain = load_uncertain("fit.toml")
    assert uncertain is not None and uncertain.fields == FIELDS
    result = run("validate-release", "loaded.csv", "--payload", f"{MASS}", "--fit", "fit.toml")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    for key in ("frequency_hz", "damping_ratio", "rms_mm"):
        assert found[key]["predicted"] == pytest.approx(found[key]["measured"], rel=0.1)


@pytest.mark.usefixtures("files")
def test_a_fit_tells_which_errors_of_its_start_it_leaves_out() -> None:
    """The mass's, but not that of the stiffness, which is fitted."""
    start = Path("start.toml")
    for field in ("bending_stiffness", "mass_per_length"):
        text = re.sub(
            rf"(?m)^{field} = (.*)$",
            rf"{field} = {{ value = \1, sd = 0.001 }}",
            start.read_text("utf-8"),
            count=1,
        )
        start.write_text(text, "utf-8")
    result = run(*FIT, "--fit", FIELDS[0])
    assert result.exit_code == 0, result.output
    (told,) = [line for line in result.stderr.splitlines() if "as exact" in line]
    assert "arm.limb.section.base.mass_per_length" in told and "stiffness" not in told


@pytest.mark.usefixtures("files")
def test_the_commands_refuse_bad_input() -> None:
    assert_refused(run(*FIT[:-3], "paper", *FIT[-2:]), "[bench]")
    assert_refused(run(*FIT, "--payload", "1"), "payload")
    assert_refused(run(*FIT, "--fit", "arm.limb.nothing"), "fit")
    assert not Path("fit.toml").exists()
    validate = ("validate-release", "empty.csv", "--fit", "start.toml", "--payload")
    assert_refused(run(*validate, "-1"), "payload")
    Path("empty.csv").write_text("ID,x1\n1,a\n", "utf-8")
    assert_refused(run(*validate, "0"), "y1")
