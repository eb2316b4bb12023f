"""Standard errors of a fit are written to the vehicle's file and agree with the scatter of fits."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair.cli as cli
from continuair.identification import Fit, fit, load_recording
from continuair.vehicle.uncertain import load_uncertain
from continuair.vehicle.vehicle_file import write_vehicle
from tests.identification.flights import record, true_vehicle

FIELDS = ["arm.youngs_modulus", "arm.density"]


def fitted(folder: Path, seed: int, fields: list[str] = FIELDS) -> Fit:
    path = folder / f"{seed}.csv"
    record(path, seed=seed, duration=0.5)
    return fit(true_vehicle(), load_recording(path, true_vehicle()), fields)


def test_the_file_holds_the_covariance_of_logarithms(tmp_path: Path) -> None:
    record(tmp_path / "flight.csv", seed=0, duration=0.5)
    write_vehicle(true_vehicle(), tmp_path / "start.toml")
    out = tmp_path / "fitted.toml"
    names = [*FIELDS, "uav.mount.2"]
    CliRunner().invoke(
        cli.app,
        ["identify", "--data", str(tmp_path / "flight.csv"), "--vehicle",
         str(tmp_path / "start.toml"), "--fit", ",".join(names), "--out", str(out)],
        catch_exceptions=False,
    )  # fmt: skip
    expected = fitted(tmp_path, 0, names)
    found = load_uncertain(out)
    assert found is not None
    assert list(found.fields) == names
    assert found.medians == pytest.approx(expected.values, rel=1e-6)
    # Of a place, which may be 0, the error is in metres.
    scale = expected.errors / [*expected.values[:2], 1.0]
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(scale, rel=1e-4)
    low, middle, high = np.quantile(found.values(1024), [0.16, 0.5, 0.84], axis=0)
    assert middle == pytest.approx(
        expected.values, abs=0.1 * float(expected.errors.max()), rel=1e-3
    )
    assert 0.5 * (high - low) == pytest.approx(expected.errors, rel=0.05)


def test_a_field_without_an_error_is_left_out(tmp_path: Path) -> None:
    """The flight does not depend on `kappa_s`, which divides a force that is 0 here."""
    found = fitted(tmp_path, 0, ["arm.kappa_s", "uav.mass"])
    assert np.isinf(found.errors[0])
    assert found.uncertainty["fields"] == ["uav.mass"]


@pytest.mark.long
def test_estimates_of_many_flights_correlate_as_each_fit_says(tmp_path: Path) -> None:
    """A denser arm has to be stiffer: the frequency tells E over the density best."""
    fits = [fitted(tmp_path, seed) for seed in range(40)]
    scattered = np.corrcoef(np.log([each.values for each in fits]).T)[0, 1]
    said = np.mean([each.correlation[0, 1] for each in fits])
    # Its standard error is (1 - r²)/√39, below 0.08.
    assert said == pytest.approx(scattered, abs=0.2)
    assert said > 0.5
