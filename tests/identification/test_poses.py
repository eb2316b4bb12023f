"""Static poses: what made them is recovered, they are where flights come to rest, bad input."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.analysis.clamped import ClampedArm
from continuair.analysis.equilibria import equilibria
from continuair.identification import Marker, StaticPoses, load_poses
from continuair.vehicle.coordinates import bends_of
from tests.refusals import refused
from tests.sections.strains import flying, rod

TENDONS: list[dict[str, Any]] = [
    {"name": "left", "angles": [1.0], "offset": [0.011, 0.004]},
    {"name": "right", "angles": [-1.0], "offset": [0.011, 0.004]},
]
TENSIONS = np.array([[0.6, 0.0], [0.0, 0.6], [1.2, 0.3], [0.3, 1.2]])
MARKERS = (
    Marker("base", 0.15, (0.02, 0.0, 0.0)),
    Marker("base", offset=(0.0, -0.02, 0.0)),
    Marker("tip", offset=(0.0, 0.0, -0.01)),
)


def arm(**changes: Any) -> ca.Vehicle:
    """Return a vehicle whose arm tapers, stretches and is pulled by two tendons."""
    base = rod(name="base", length=0.3, radius=[0.012, 0.006], youngs_modulus=5e5, bending=2,
               stretch=0, damping_ratio=0.5) | changes  # fmt: skip
    tip = rod(name="tip", length=0.1, youngs_modulus=5e5, damping_ratio=0.5)
    tendons = [group | {"section": "base"} for group in TENDONS]
    return flying(base, tip, name="arm", mount=[0.0, 0.0, -0.05], tendon=tendons,
                  tip={"mass": 0.003})  # fmt: skip


def measured(vehicle: ca.Vehicle, **changes: Any) -> StaticPoses:
    """Return poses of a vehicle without errors."""
    nothing = np.zeros((len(TENSIONS), len(MARKERS), 3))
    given: dict[str, Any] = {"tensions": TENSIONS, "points": nothing, "markers": MARKERS}
    empty = StaticPoses("made", **given | changes)
    return StaticPoses("made", **given | changes | {"points": empty.predict(vehicle)[0]})


TILTED = {"attitude": Rotation.from_euler("y", 0.7).as_quat(), "position": [0.3, -0.2, 1.0]}
FIELDS = ("youngs_modulus", "density")


def with_fields(vehicle: ca.Vehicle, values: np.ndarray) -> ca.Vehicle:
    """Return a batch of vehicles; values (runs, 2): Young's modulus and density of all sections."""
    return vehicle.replace(
        {f"arm.arm.section.{section}.{name}": values[:, column]
         for section in ("base", "tip") for column, name in enumerate(FIELDS)}
    )  # fmt: skip


def test_material_is_recovered() -> None:
    truth = np.array([5e5, 1500.0])
    poses = measured(arm(), **TILTED)

    def residuals(factors: np.ndarray) -> np.ndarray:
        return poses.residuals(with_fields(arm(), np.atleast_2d(factors) * truth))

    def slopes(factors: np.ndarray) -> np.ndarray:
        found = residuals(np.vstack([factors, factors + 1e-5 * np.eye(2)]))
        return (found[1:] - found[0]).T / 1e-5

    assert residuals(np.ones(2)) == pytest.approx(0.0, abs=1e-9)
    found = least_squares(lambda x: residuals(x)[0], [1.4, 0.7], slopes, x_scale=[1.0, 1.0])
    np.testing.assert_allclose(found.x, 1.0, atol=1e-4)


def test_rests_where_trim_does() -> None:
    # In `trim` the pretension pulls, through the device code of the tendons.
    groups = [group | {"section": "base", "pretension": T}
              for group, T in zip(TENDONS, (0.9, 0.2), strict=True)]  # fmt: skip
    vehicle = arm()
    pulled = vehicle.replace({"arm.arm.tendon": groups})
    chain, row = vehicle.arms[0], np.zeros(1, int)
    found = equilibria(ClampedArm(chain, 1), row, np.array([[0.9, 0.2]]), np.array([[0, 0, -9.81]]))
    expected = bends_of(ca.trim(pulled).q, pulled.layout)
    np.testing.assert_allclose(found[0], expected, rtol=1e-6, atol=1e-8)


def test_rests_where_a_damped_flight_ends() -> None:
    vehicle = arm()
    scenario = ca.Scenario(
        "pulled", np.zeros(vehicle.layout.coordinates), duration=25.0,
        force=[0.0, 0.0, 9.81 * vehicle.mass], tendon_command=[0.9, 0.2],
    )  # fmt: skip
    flight = ca.simulate(
        vehicle, scenario, sample=1.0, model="independent", method="implicit", step=1e-3
    )
    end = flight["strain"].isel(time=-1).values.ravel()
    row = np.zeros(1, int)
    found = equilibria(
        ClampedArm(vehicle.arms[0], 1), row, np.array([[0.9, 0.2]]), np.array([[0, 0, -9.81]])
    )
    np.testing.assert_allclose(end, found[0], atol=2e-5 * np.abs(found).max())


def test_mirrored_tensions_give_mirrored_points() -> None:
    markers = [Marker("base", 0.1), Marker("tip")]
    poses = measured(arm(), markers=markers, points=np.zeros((4, 2, 3)))
    for left, right in ((0, 1), (2, 3)):
        mirrored = poses.points[right] * [1.0, -1.0, 1.0]
        np.testing.assert_allclose(poses.points[left], mirrored, atol=1e-9)
    assert poses.points[0, 1, 1] > 0.01


def test_points_turn_with_base_and_gravity() -> None:
    turn = Rotation.from_euler("xyz", [0.4, -1.0, 2.0])
    straight, turned = measured(arm()), measured(
        arm(), attitude=turn.as_quat(), gravity=turn.apply([0.0, 0.0, -9.81])
    )  # fmt: skip
    np.testing.assert_allclose(turned.points, turn.apply(straight.points.reshape(-1, 3))
                               .reshape(straight.points.shape), atol=1e-9)  # fmt: skip
    # Held level the arm hangs below its straight line.
    level = measured(arm(), gravity=[0.0, -9.81, 0.0], tensions=np.zeros((4, 2)))
    assert (level.points[:, 2, 1] < -0.05).all()


def test_an_arm_that_buckles_is_nan() -> None:
    # Upright, a soft arm rests straight in an unstable equilibrium alone, by symmetry.
    soft = arm(youngs_modulus=2e4)
    poses = StaticPoses("upright", np.zeros((4, 2)), np.zeros((4, 3, 3)), MARKERS,
                        gravity=[0.0, 0.0, 9.81])  # fmt: skip
    assert np.isnan(poses.predict(soft)).all()


def test_batches_are_single_vehicles() -> None:
    values = np.array([[4e5, 1200.0], [6e5, 1500.0]])
    poses = measured(arm(), **TILTED)
    together = poses.residuals(with_fields(arm(), values))
    assert together.shape == (2, TENSIONS.shape[0] * len(MARKERS) * 3)
    for run in range(2):
        alone = poses.residuals(with_fields(arm(), values[run : run + 1]))
        np.testing.assert_allclose(together[run], alone[0], atol=1e-10)


def test_gaps_are_left_out() -> None:
    poses = measured(arm())
    points = poses.points.copy()
    points[1, 2] = np.nan
    gaps = StaticPoses("gaps", TENSIONS, points, MARKERS)
    found = gaps.residuals(arm())
    assert found.shape == (1, poses.points.size - 3)
    assert np.isfinite(found).all()


def table(poses: StaticPoses, path: Path, **changes: str) -> Path:
    """Write poses as a CSV file, with the text of some headings changed."""
    headings = ["pose", *(f"tension_{k + 1}" for k in range(2)),
                *(f"{axis}_{k + 1}" for k in range(len(MARKERS)) for axis in "xyz")]  # fmt: skip
    lines = [",".join(changes.get(name, name) for name in headings)]
    for label, tensions, points in zip(poses.labels, poses.tensions, poses.points, strict=True):
        cells = ["" if np.isnan(x) else repr(float(x)) for x in (*tensions, *points.ravel())]
        lines.append(",".join([label, *cells]))
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def test_files_hold_poses(tmp_path: Path) -> None:
    poses = measured(arm())
    points = poses.points.copy()
    points[0, 1] = np.nan
    gaps = StaticPoses("gaps", TENSIONS, points, MARKERS, labels=["a", "b", "c", "d"])
    read = load_poses(table(gaps, tmp_path / "poses.csv"), MARKERS)
    np.testing.assert_array_equal(read.points, points)
    np.testing.assert_array_equal(read.tensions, TENSIONS)
    assert read.labels == ("a", "b", "c", "d")


@pytest.mark.parametrize("change", [{"x_2": "x_4"}, {"tension_2": "force_2"}, {"z_3": "y_3"}])
def test_columns_of_other_names_are_refused(change: dict[str, str], tmp_path: Path) -> None:
    with pytest.raises(ca.InputError):
        load_poses(table(measured(arm()), tmp_path / "poses.csv", **change), MARKERS)


def test_decimal_commas_are_refused(tmp_path: Path) -> None:
    path = table(measured(arm()), tmp_path / "poses.csv")
    path.write_text(path.read_text("utf-8").replace(".", ","), "utf-8")
    with refused("data", place=path):
        load_poses(path, MARKERS)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"points": "millimetres"}, "points"),
        ({"points": "another order"}, "points"),
        ({"markers": (Marker("elbow", 0.1), *MARKERS[1:])}, "markers.0.section"),
        ({"markers": (Marker("tip", 0.3), *MARKERS[1:])}, "markers.0.distance"),
        ({"arm": "leg"}, "arm"),
        ({"tensions": TENSIONS[:, :1]}, "tensions"),
    ],
)
def test_poses_of_another_arm_are_refused(changes: dict[str, Any], field: str) -> None:
    poses = measured(arm())
    kinds = {"millimetres": 1e3 * poses.points, "another order": poses.points[:, ::-1]}
    changes = {name: kinds.get(value, value) if isinstance(value, str) else value
               for name, value in changes.items()}  # fmt: skip
    given: dict[str, Any] = {"tensions": TENSIONS, "points": poses.points, "markers": MARKERS}
    with refused(field) as caught:
        StaticPoses("wrong", **given | changes).residuals(arm())
    assert ("millimetres" in str(caught.value)) == (kinds["millimetres"] is changes.get("points"))


@pytest.mark.parametrize(
    "changes",
    [
        {"tensions": -TENSIONS},
        {"tensions": TENSIONS[:3]},
        {"points": np.zeros((4, 2, 3))},
        {"points": np.full((4, 3, 3), np.nan)},
        {"attitude": [0.0, 0.0, 0.0, 0.0]},
        {"spread": -1.0},
        {"labels": ["a"]},
    ],
)
def test_impossible_poses_are_refused(changes: dict[str, Any]) -> None:
    given: dict[str, Any] = {"tensions": TENSIONS, "points": np.zeros((4, 3, 3)),
                             "markers": MARKERS}  # fmt: skip
    with pytest.raises(ca.InputError):
        StaticPoses("wrong", **given | changes)
