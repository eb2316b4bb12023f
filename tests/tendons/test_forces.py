"""Forces and lengths of tendons, against the lengths of their curves and known answers."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.equations import rod_curve, tendon_lengths
from continuair.vehicle.tendon_path import pieces, straight_lengths
from tests.refusals import refused
from tests.sections.strains import flying, rod
from tests.tendons.pulled import DISKS, FOUR, pulled, settled

TENSION, LONG = 3.0, pytest.mark.long
ANGLES = {"angles": [0.3, 2.0, 4.4]}
CONVERGING: Any = ANGLES | {"offset": [0.02, 0.01]}
ON_DISKS = {"guides": "disks"}
HELICAL: Any = CONVERGING | {"turn": 2.1}
ALL = {"bending": 1, "twist": 1, "stretch": 1, "shear": 1}


def forces_of(vehicle: ca.Vehicle, q: Any) -> tuple[Any, Any, Any]:
    """Accelerations with tendons, with the derivatives of their lengths instead, and without."""
    bare = vehicle.replace({"arm.0.tendon": ()})
    steps = q + 1e-100j * np.eye(len(q))
    pushes = -TENSION * tendon_lengths(vehicle, steps).imag.sum(axis=-1) / 1e-100
    if vehicle.layout.strains:
        at, equal = {"strain": q}, {"strain_force": pushes}
    else:
        at, equal = {"bend": q.reshape(-1, 2)}, {"bend_moment": pushes.reshape(-1, 2)}
    each: Any = (vehicle, {}), (bare, equal), (bare, {})
    found = [ca.accelerations(flown, **at, **given) for flown, given in each]
    return tuple(np.concatenate([np.ravel(part) for part in parts]) for parts in found)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("sections", "groups", "size", "tolerance"),
    [
        ([rod()], [ANGLES], 2.0, 1e-12),
        ([rod(), rod(length=0.3)], [CONVERGING, ANGLES | {"section": "0", "end": 0.4}], 2.0, 1e-12),
        pytest.param([rod(bending=1), rod()], [CONVERGING, ANGLES | {"section": "0"}], 2.0, 1e-12,
                     marks=LONG),
        ([rod(bending=1, twist=0)], [HELICAL], 2.0, 1e-10),
        pytest.param([rod(), rod(length=0.3)], [HELICAL, ANGLES | {"section": "0", "turn": -3.0}],
                     2.0, 1e-10, marks=LONG),
        pytest.param([rod(disks=DISKS)], [HELICAL | ON_DISKS], 2.0, 1e-3, marks=LONG),
        pytest.param([rod(bending=3, twist=2)], [CONVERGING], 2.0, 1e-10, marks=LONG),
        pytest.param([rod(**ALL)], [CONVERGING], 0.2, 1e-10, marks=LONG),
        ([rod(disks=DISKS)], [ANGLES | {"guides": "disks"}], 2.0, 1e-12),
        pytest.param([rod(disks=DISKS)], [CONVERGING | ON_DISKS], 2.0, 1e-4, marks=LONG),
        pytest.param([rod(bending=1, disks=DISKS)], [ANGLES | ON_DISKS], 2.0, 1e-3, marks=LONG),
        pytest.param([rod(bending=1, twist=0, disks=DISKS)], [CONVERGING | {"guides": "disks"}],
                     2.0, 0.05, marks=LONG),
    ],
)  # fmt: skip
def test_a_tension_pulls_along_the_derivatives_of_the_length(
    sections: Any, groups: Any, size: float, tolerance: float
) -> None:
    """By complex steps through the curve; between disks a gap has one strain, not the curve's."""
    vehicle = pulled(*[each | {"pretension": TENSION} for each in groups], sections=sections)
    q = size * np.random.default_rng(0).normal(size=vehicle.layout.bends)
    found, expected, without = forces_of(vehicle, q)
    assert np.abs(found - expected).max() <= tolerance * np.abs(expected - without).max()


@pytest.mark.parametrize("route", [CONVERGING, HELICAL])
def test_lengths_are_those_of_the_curve_in_space(route: Any) -> None:
    """Of many points of a tendon, whose polygon is shorter by the square of their distance."""
    vehicle = pulled(route, sections=[rod(bending=2, twist=1)])
    (section,), (group,) = vehicle.arms[0].section, vehicle.arms[0].tendon
    q = 2.0 * np.random.default_rng(1).normal(size=vehicle.layout.bends)
    expected = []
    for count in (400, 800):
        s = np.linspace(0.0, section.length, count + 1)
        points, frames = rod_curve(section.orders, section.length, q, s[1:])
        points, frames = np.vstack([np.zeros(3), points]), np.concatenate([[np.eye(3)], frames])
        radius = np.interp(s, [0.0, section.length], group.offset)
        lengths = []
        for angle in group.angles:
            at = angle + group.turn * s / section.length
            o = radius[:, None] * np.column_stack([np.cos(at), np.sin(at), 0.0 * at])
            places = points + np.einsum("sij,sj->si", frames, o)
            lengths.append(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
        expected.append(lengths)
    coarse, fine = np.array(expected)
    assert tendon_lengths(vehicle, q) == pytest.approx(fine + (fine - coarse) / 3.0, rel=1e-9)


@pytest.mark.parametrize("guides", ["channel", "disks"])
def test_a_helix_on_a_straight_rod_has_its_length_and_its_torque(guides: str) -> None:
    """Pythagoras: over the rod and around it; unrolled, a torsion γ adds -γ l to the turn."""
    length, offset, turn, gaps = 0.5, 0.02, 2.1, 8
    vehicle = pulled({"angles": [0.4], "offset": offset, "turn": turn, "guides": guides},
                     sections=[rod(bending=0, twist=0, disks=DISKS)])  # fmt: skip

    def expected(around: Any) -> Any:
        if guides == "disks":
            return np.hypot(length, 2.0 * gaps * offset * np.sin(0.5 * around / gaps))
        return np.hypot(length, offset * around)

    found = straight_lengths(pieces(vehicle.arms[0].tendon[0], vehicle.arms[0], 1))
    assert found.ravel() == pytest.approx([expected(turn)], rel=1e-13)
    assert tendon_lengths(vehicle, np.zeros(3)) == pytest.approx([expected(turn)], rel=1e-13)
    torsion = 0.7
    twisted = tendon_lengths(vehicle, [0.0, 0.0, torsion])
    assert twisted == pytest.approx([expected(turn - torsion * length)], rel=1e-13)


def two_sections(guides: str) -> ca.Vehicle:
    """The benchmark's arm: a tendon at 90 degrees to the first section, one at -30 to the tip."""
    disks = {"disks": {"count": 10, "mass": 1e-9}} if guides == "disks" else {}
    section = {"length": 0.2, "mass_per_length": 0.01, "bending_stiffness": 0.0101830} | disks
    groups = [
        {"angles": [np.deg2rad(90.0)], "section": "a", "pretension": 4.0},
        {"angles": [np.deg2rad(-30.0)], "section": "b", "pretension": 2.0},
    ]
    return flying(
        section | {"name": "a"}, section | {"name": "b"},
        tendon=[group | {"offset": 0.01, "guides": guides} for group in groups],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("guides", "tip", "tolerance"),
    [
        ("channel", (0.12761225, 0.14347360, 0.33642379), 5e-8),
        ("disks", (0.12938, 0.14605, 0.33416), 5e-6),
    ],
)
def test_two_sections_end_where_the_benchmark_says(guides: str, tip: Any, tolerance: float) -> None:
    vehicle = two_sections(guides)
    polar = ca.trim(vehicle, gravity=0.0).q[6:].reshape(2, 2)
    place, axes = np.zeros(3), np.eye(3)
    for section, (kappa, angle) in zip(vehicle.arms[0].section, polar, strict=True):
        bend = kappa * np.array([np.cos(angle), np.sin(angle)])
        points, frames = rod_curve(section.orders, section.length, bend, [section.length])
        place, axes = place + axes @ points[0], axes @ frames[0]
    assert place * [1.0, 1.0, -1.0] == pytest.approx(tip, abs=tolerance)
    if guides == "channel":
        assert polar[:, 0] == pytest.approx([3.40184735, 1.96405748], rel=2e-7)


def test_tensions_are_found_from_bends() -> None:
    vehicle = two_sections("channel")
    directions = np.deg2rad([60.0, -30.0])
    polar = np.array([3.40184735, 1.96405748])
    bends = polar[:, None] * np.column_stack([np.cos(directions), np.sin(directions)])
    held = ca.tendon_tensions(
        vehicle.replace({f"arm.0.tendon.{n}.pretension": 0.0 for n in (0, 1)}), bends.ravel(),
        gravity=0.0,
    )  # fmt: skip
    assert held.tensions == pytest.approx([4.0, 2.0], rel=2e-7)
    assert held.command == pytest.approx([4.0, 2.0], rel=2e-7)
    assert np.abs(held.missing).max() < 1e-8
    # What they say of winches holds the same bends, beside the weight of the arm.
    sections = [rod(damping_ratio=1.0), rod(length=0.3, damping_ratio=1.0)]
    groups = [{"command": "length", "stiffness": 2e4, "pretension": 1.0, "section": part}
              for part in ("0", "1")]  # fmt: skip
    winches = pulled(*groups, sections=sections)
    bent = np.array([0.6, -0.3, 0.2, 0.4])
    held = ca.tendon_tensions(winches, bent, gravity=0.0)
    assert held.tensions.min() >= 1.0 - 1e-12
    stays = settled(winches, held.command, bends=bent)["bend"].to_numpy()
    assert stays.ravel() == pytest.approx(bent, abs=1e-9)


def test_an_antagonistic_pair_bends_as_its_stiffness_says() -> None:
    """k = 2 k_t r d/(E I + 2 k_t r² l)."""
    stiffness, offset, taken = 5e3, 0.012, 1.5e-3
    vehicle = pulled({"angles": FOUR[:3:2], "offset": offset, "command": "length",
                      "stiffness": stiffness, "pretension": 30.0}, damping_ratio=1.0)  # fmt: skip
    (section,) = vehicle.arms[0].section
    whole = section.bending_stiffness + 2.0 * stiffness * offset**2 * section.length
    end = settled(vehicle, [taken, -taken], 2.0)
    expected = 2.0 * stiffness * offset * taken / whole
    assert end["bend"].to_numpy().ravel()[0] == pytest.approx(expected, rel=1e-6)
    assert end["tendon_slack"].to_numpy().tolist() == [0.0, 0.0]


def test_tendons_beyond_their_arm_are_refused() -> None:
    for wrong, field in (
        ({"end": 0.6}, "end"),
        ({"section": "none"}, "section"),
        ({"guides": "disks"}, "guides"),
        ({"command": "length"}, "stiffness"),
        ({"stiffness": 10.0}, "stiffness"),
        ({"rate": 1.0}, "lag"),
        ({"pretension": 5.0, "limits": [0.0, 4.0]}, "pretension"),
        ({"angles": []}, "angles"),
        ({"offset": 0.0}, "offset"),
    ):
        with refused(f"arm.0.tendon.0.{field}"):
            pulled(wrong)
    with refused("arm.0.section.0.tendon"):
        flying(rod() | {"tendon": [{"angles": FOUR, "offset": 0.01}]})
    one = ca.load_vehicle("paper").replace({"arm.tendon": [{"angles": FOUR, "offset": 0.01}]})
    assert one.tendons == 4
