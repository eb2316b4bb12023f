"""Judges of what the camera sees: a corrected paper turns their verdicts, a wrong one too."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import image
from amiri2026.verdicts import DEPENDS, HOLDS, MISPRINT
from continuair.scenario import paths

VEHICLE = ca.load_vehicle("paper")
EVIDENCE = Evidence(VEHICLE, quick=True)
RIGHT = ca.equations.interaction_matrix


def verdict(name: str, evidence: Evidence = EVIDENCE) -> str:
    return image.JUDGES[name](evidence).verdict


def with_focal_length(pixels: float) -> Evidence:
    return Evidence(VEHICLE.replace({"camera.focal_length": [pixels, pixels]}), quick=True)


def wrong_matrix(row: int, column: int) -> Any:
    """Eq. (14) with one entry of each point turned round."""

    def matrix(seen: Any, depth: Any) -> np.ndarray:
        L = np.array(RIGHT(seen, depth))
        L[row::2, column] *= -1.0
        return L

    return matrix


def test_the_rate_of_the_image_is_the_slope_of_what_a_moving_camera_sees() -> None:
    rng = np.random.default_rng(0)
    for point, twist in zip(image.points_in_view(rng, 20), rng.normal(size=(20, 6)), strict=True):
        slope = image.slope(point, twist)
        assert image.off(image.image_rate(point[None], twist), slope) < 1e-8


def test_a_matrix_that_hides_a_motion_does_not_give_the_twist(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert verdict("III-D.1") == HOLDS
    monkeypatch.setattr(image, "interaction_matrix", lambda s, Z: RIGHT(s, Z) * [1, 1, 1, 1, 1, 0])
    assert verdict("III-D.1") == MISPRINT


def test_eq_12_holds_in_pixels_only_for_a_focal_length_of_one_pixel() -> None:
    assert verdict("III-D.4", with_focal_length(1.0)) == HOLDS
    found = image.error_rate(with_focal_length(500.0))
    assert found.verdict == MISPRINT
    assert found.numbers["rate_in_pixels_over_printed"] == pytest.approx(500.0, rel=1e-6)
    assert found.correction


def test_the_sign_of_eq_12_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(image, "interaction_matrix", lambda s, Z: -RIGHT(s, Z))
    assert verdict("III-D.4", with_focal_length(1.0)) == MISPRINT


def test_corners_that_are_next_to_sharp_have_a_jerk_that_finer_times_raise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert verdict("III-D.6") == HOLDS
    rounded = paths.letter
    monkeypatch.setattr(
        paths, "letter", lambda name, height, T: rounded(name, height, T, smoothing=1e-5)
    )
    assert verdict("III-D.6") == DEPENDS


def test_the_corner_of_the_l_is_a_right_angle_at_constant_speed() -> None:
    # Strokes of 0.8 m and 0.48 m in 50 s.
    assert image.corner_jump("L", 50.0) == pytest.approx(np.sqrt(2.0) * 1.28 / 50.0)


def test_coordinates_that_hold_the_pixels_size_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    assert verdict("III-D.9") == HOLDS
    monkeypatch.setattr(image, "to_normalised", lambda camera, pixels: (pixels - 500.0) / 800.0)
    assert verdict("III-D.9") == MISPRINT


@pytest.mark.long
@pytest.mark.parametrize(("row", "column"), [(0, 0), (0, 4), (1, 3), (1, 5)])
def test_one_wrong_entry_of_eq_14_is_found(
    monkeypatch: pytest.MonkeyPatch, row: int, column: int
) -> None:
    assert image.matrix_of_a_point(EVIDENCE).numbers["entries_that_agree"] == 12
    monkeypatch.setattr(image, "interaction_matrix", wrong_matrix(row, column))
    found = image.matrix_of_a_point(EVIDENCE)
    assert found.verdict == MISPRINT
    assert found.numbers["entries_that_agree"] == 11


def test_sizes_of_the_law_fit_three_points_alone() -> None:
    assert [n for n in range(1, 12) if image.sizes_fit(n)] == [3]


@pytest.mark.long
def test_the_rotation_of_the_camera_makes_j_l_the_features_rate() -> None:
    for camera in ([0.0, 0.0, 0.0], [0.05, -0.02, 0.1]):
        vehicle = VEHICLE.replace({"camera.position": camera})
        assert max(image.corrected_errors(vehicle, np.random.default_rng(0))) < image.AGREES


@pytest.mark.long
def test_without_t_a_the_printed_j_l_is_the_features_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    assert verdict("III-D.12") == MISPRINT
    monkeypatch.setattr(image, "euler_rate_matrix", lambda q: np.eye(3))
    assert verdict("III-D.12") == HOLDS


@pytest.mark.long
def test_the_printed_j_l_is_right_for_a_level_uav_without_yaw_in_the_texts_reading_alone() -> None:
    errors = image.printed_errors(VEHICLE, np.random.default_rng(0), level=True)
    right = [name for name, each in errors.items() if max(each) < image.AGREES]
    # T_e is then 1 both ways.
    assert {axes for axes, _, _ in right} == {"J_t in tip axes"}
    assert {meant for _, _, meant in right} == {image.FEATURES}
