"""Vehicles whose fields have errors: their files, their draws, and what is refused."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.typing import ArrayLike
from continuair.vehicle.uncertain import UncertainVehicle, band, load_uncertain
from tests.refusals import refused

PAPER = Path(ca.__file__).parent.joinpath("presets/paper.toml").read_text("utf-8")
STIFF, MOUNT = "arm.youngs_modulus", "uav.mount.2"
UNCERTAIN = {
    "mass = 2.0  ": "mass = { value = 2.0, sd = 0.2 }  ",
    "youngs_modulus = 207e9": "youngs_modulus = { value = 207e9, sd = 4e10 }",
    "mount = [0.0, 0.0, 0.0]": "mount = [0.0, 0.0, { value = 0.0, sd = 0.01 }]",
}


def written(path: Path, changes: dict[str, str], after: str = "") -> Path:
    """Write the paper's vehicle with some text replaced, and more after it."""
    text = PAPER
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text + after, "utf-8")
    return path


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return a vehicle's file with standard deviations."""
    return written(tmp_path / "mine.toml", UNCERTAIN)


def table(covariance: str, fields: str = f'["{STIFF}", "arm.density"]') -> str:
    """Return the table of a covariance in a vehicle's file."""
    return f"\n[uncertainty]\nfields = {fields}\ncovariance = {covariance}\nmodel_error = 0.004\n"


def test_a_vehicle_is_that_of_the_medians(file: Path) -> None:
    assert ca.load_vehicle(file) == ca.load_vehicle("paper")
    found = load_uncertain(file)
    assert found is not None and found.vehicle == ca.load_vehicle("paper")
    assert load_uncertain("paper") is None


def test_draws_have_the_medians_and_the_deviations_of_the_file(file: Path) -> None:
    """Of logarithms, or of places."""
    found = load_uncertain(file)
    assert found is not None
    values = dict(zip(found.fields, found.values(4096).T, strict=True))
    assert set(values) == {"uav.mass", STIFF, MOUNT}
    for name, median, sd in (("uav.mass", 2.0, 0.2), (STIFF, 207e9, 4e10)):
        assert np.median(values[name]) == pytest.approx(median, rel=2e-3)
        assert np.log(values[name]).std() == pytest.approx(sd / median, rel=1e-2)
    assert abs(np.median(values[MOUNT])) < 1e-4
    assert values[MOUNT].std() == pytest.approx(0.01, rel=1e-2)


def test_draws_keep_the_correlations_of_a_covariance(tmp_path: Path) -> None:
    path = written(tmp_path / "mine.toml", {}, table("[[0.01, -0.016], [-0.016, 0.04]]"))
    found = load_uncertain(path)
    assert found is not None and found.model_error == 0.004
    drawn = np.cov(np.log(found.values(4096)).T)
    assert drawn == pytest.approx(np.array([[0.01, -0.016], [-0.016, 0.04]]), rel=2e-2)


def test_a_seed_repeats_draws_and_another_gives_others(file: Path) -> None:
    found = load_uncertain(file)
    assert found is not None
    assert (found.values(64, 3) == found.values(64, 3)).all()
    assert (found.values(64, 3) != found.values(64, 4)).all()
    batch, values = found.draws(64, 3), found.values(64, 3)
    assert batch.runs == 64
    assert (np.asarray(batch.uav.mass) == values[:, found.fields.index("uav.mass")]).all()
    assert (np.asarray(batch.uav.mount)[:, 2] == values[:, found.fields.index(MOUNT)]).all()


def test_a_covariance_without_rank_is_drawn(tmp_path: Path) -> None:
    path = written(tmp_path / "mine.toml", {}, table("[[0.01, 0.02], [0.02, 0.04]]"))
    found = load_uncertain(path)
    assert found is not None
    first, second = np.log(found.values(64) / found.medians).T
    assert second == pytest.approx(2.0 * first, abs=1e-6)


def test_a_band_has_as_many_draws_below_as_above() -> None:
    low, high = band(np.arange(101.0), 0.9)
    assert (low, high) == pytest.approx((5.0, 95.0))
    with_gaps = np.column_stack([np.arange(101.0), np.full(101, np.nan)])
    with_gaps = np.vstack([with_gaps, [np.nan, np.nan]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(band(with_gaps), [[5.0, np.nan], [95.0, np.nan]])
    for values in ([], "many", [[1.0], [1.0, 2.0]]):
        with refused("values"):
            band(values)
    for level in (0.0, 1.0):
        with refused("level"):
            band([1.0, 2.0], level)


@pytest.mark.parametrize(
    ("changes", "after", "field"),
    [
        ({"mass = 2.0  ": "mass = { value = 2.0, sd = 2.5 }  "}, "", "uav.mass.sd"),
        ({"mass = 2.0  ": "mass = { value = 2.0, sd = -1.0 }  "}, "", "uav.mass.sd"),
        ({"mass = 2.0  ": 'mass = { value = 2.0, sd = "0.1" }  '}, "", "uav.mass.sd"),
        ({"damping = 0.0 ": "damping = { value = 0.0, sd = 0.1 } "}, "", "arm.damping"),
        ({}, table("[[0.01, 0.0], [0.0, -0.04]]"), "uncertainty.covariance"),
        ({}, table("[[0.01, 0.03], [0.03, 0.04]]"), "uncertainty.covariance"),
        ({}, table("[[0.01, 0.01], [0.0, 0.04]]"), "uncertainty.covariance"),
        ({}, table("[[0.01]]"), "uncertainty.covariance"),
        ({}, table('"much"'), "uncertainty.covariance"),
        ({}, table("[[0.01]]", '["arm.stiffness"]'), "uncertainty.fields"),
        ({}, table("[[0.01]]", '["name"]'), "uncertainty.fields"),
        ({}, table("[[0.01]]", '"arm.density"'), "uncertainty.fields"),
        ({}, table("[[0.1, 0], [0, 0.1]]", f'["{STIFF}", "{STIFF}"]'), "uncertainty.fields"),
        ({}, "\n[uncertainty]\nsd = 1.0\n", "uncertainty"),
        (UNCERTAIN, table("[[0.01]]", f'["{STIFF}"]'), STIFF),
        ({}, table("[[0.01]]", '["mass"]'), "mass"),
    ],
)
def test_errors_that_cannot_be_used_are_refused(
    tmp_path: Path, changes: dict[str, str], after: str, field: str
) -> None:
    path = written(tmp_path / "mine.toml", changes, after)
    with refused(field, place=path):
        load_uncertain(path)


def test_a_field_by_its_name_and_by_its_index_is_one_field(tmp_path: Path) -> None:
    """In a list of arms, a deviation in the file has indices, and the table of a fit has names."""
    text = """
name = "limb"
uav = { mass = 1.5, inertia = [{ value = 0.02, sd = 0.001 }, 0.02, 0.03] }
[[arm]]
name = "limb"
[[arm.section]]
name = "rod"
length = 0.3
mass_per_length = 0.2
bending_stiffness = { value = 0.04, sd = 0.004 }
"""
    path = tmp_path / "limb.toml"
    path.write_text(text, "utf-8")
    found = load_uncertain(path)
    assert found is not None
    np.testing.assert_allclose(found.medians, [0.02, 0.04])
    inertia = np.asarray(found.draws(64).uav.inertia)
    assert np.log(inertia[:, 0, 0]).std() == pytest.approx(0.05, rel=0.1)
    name = "arm.limb.section.rod.bending_stiffness"
    path.write_text(text + table("[[0.01]]", f'["{name}"]'), "utf-8")
    with refused("arm.0.section.0.bending_stiffness", place=path):
        load_uncertain(path)


def test_a_field_with_an_error_is_one_that_the_vehicle_has() -> None:
    with refused("uncertainty.fields"):
        UncertainVehicle(ca.load_vehicle("paper"), ("arm.radius.value",), [[0.01]])
    with refused("uncertainty.covariance"):
        UncertainVehicle(ca.load_vehicle("paper"), (), np.zeros((0, 0)))
    assert not re.search("sd", str(ca.load_vehicle("paper").describe()))


def of(values: dict[str, float], covariance: ArrayLike) -> UncertainVehicle:
    """Return a fit of the paper's vehicle: values over its own, or places."""
    paper = ca.load_vehicle("paper")
    known = {STIFF: paper.arm.youngs_modulus, "arm.density": paper.arm.density}
    fields = {name: value * known.get(name, 1.0) for name, value in values.items()}
    return UncertainVehicle(paper.replace(fields), tuple(values), covariance)


def test_two_fits_of_a_field_are_weighted_by_their_variances() -> None:
    """Logarithms of a stiffness, and places in metres."""
    fits = [of({STIFF: 1.05, MOUNT: 0.03}, np.diag([0.01, 1e-4]))]
    fits.append(of({STIFF: 0.9, MOUNT: -0.01}, np.diag([0.04, 3e-4])))
    found = ca.combine_fits(fits)
    stiffness = np.exp((4.0 * np.log(1.05) + np.log(0.9)) / 5.0) * 207e9
    np.testing.assert_allclose(found.medians, [stiffness, 0.02], rtol=1e-12)
    np.testing.assert_allclose(
        np.asarray(found.covariance), np.diag([0.008, 7.5e-5]), rtol=1e-9, atol=1e-18
    )


def test_a_fit_of_one_field_changes_another_that_hangs_together_with_it() -> None:
    """As the mean of a normal distribution, given a component, does."""
    both = of({STIFF: 1.0, "arm.density": 1.0}, [[0.04, 0.018], [0.018, 0.01]])
    density = of({"arm.density": 1.1}, [[1e-8]])
    found = ca.combine_fits([both, density])
    given = 0.018 / 0.01
    assert found.medians[0] == pytest.approx(1.1**given * 207e9, rel=1e-5)
    assert np.asarray(found.covariance)[0, 0] == pytest.approx(0.04 - given * 0.018, rel=1e-4)
    with refused("uncertainty.covariance"):
        ca.combine_fits([both, of({STIFF: 1.0, "arm.density": 1.0}, np.full((2, 2), 0.01))])
    bad: list[Any] = [[both], both, [both, None], [both.vehicle, both.vehicle]]
    for given in bad:
        with refused("fits"):
            ca.combine_fits(given)


def test_fits_of_different_vehicles_are_told_apart() -> None:
    """Five standard errors of the difference apart, and one."""
    first = of({STIFF: 1.0}, [[9e-4]])
    with pytest.warns(ca.ContinuairWarning, match="differ"):
        ca.combine_fits([first, of({STIFF: np.exp(0.25)}, [[16e-4]])])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ca.combine_fits([first, of({STIFF: np.exp(0.05)}, [[16e-4]])])
        longer = first.vehicle.replace({"uav.mass": 9.0, "arm.length": 0.9})
        ca.combine_fits([first, UncertainVehicle(longer, ("arm.length",), [[1e-4]])])
    # A stiffness that was fitted with another length is not that of this arm.
    with pytest.warns(ca.ContinuairWarning, match="no fit estimates"):
        ca.combine_fits([first, UncertainVehicle(longer, (STIFF,), [[1e-4]])])
