"""The error of constant curvature: against frequency equations, unit loads and the kernels."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

from continuair.analysis.beam import arc_frequency, beam_frequency, curvature_error
from continuair.analysis.modes import modes
from continuair.analysis.trim import trim
from continuair.vehicle.vehicle import Vehicle, load_vehicle
from tests.refusals import refused

PAPER = load_vehicle("paper")
# So thin that the rotary inertia of its sections, which frequency equations leave out, is nothing:
# it lowers a frequency by about (radius / length)².
THIN = PAPER.replace({"arm.radius": 5e-5, "arm.density": 7850e4, "arm.youngs_modulus": 207e17})
MIDDLE = {"position": 0.6, "mass": 0.3, "inertia": (2e-3, 0.0)}
# Ten and forty times as heavy as the arm of THIN.
HEAVY: dict[str, Any] = {"position": 0.5, "mass": 6.0, "inertia": (0.06, 0.0)}
WIDE = {"position": 0.26, "mass": 24.0, "inertia": (4.0, 0.0)}
TIP = {"position": 1.0, "mass": 0.2, "inertia": (1e-3, 0.0)}


def by_transfer_matrices(vehicle: Vehicle, free: bool) -> float:
    """First root of the beam's frequency equation [rad/s], in the plane of the body's x.

    The state (w, w', w'', w''') goes from the base to the tip: EI w'''' = ω² μ w between disks,
    and over a disk EI [w'''] = ω² m w and EI [w''] = -ω² j w'; the tip is free.
    """
    arm, uav = vehicle.arm, vehicle.uav
    EI = arm.bending_stiffness

    def determinant(omega: float) -> float:
        between = np.diag([1.0, 1.0, 1.0], 1)
        between[3, 0] = omega**2 * arm.mass_per_length / EI
        if free:
            # The UAV's own balances: M w = EI w''' / ω², and J w' = -EI w'' / ω².
            mass, inertia = omega**2 * np.array([uav.mass, uav.inertia[1][1]]) / EI
            state = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, -inertia], [mass, 0.0]])
        else:
            state = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        at = 0.0
        for disk in arm.disks:
            state = expm(between * (disk.position - at)) @ state
            jump = np.eye(4)
            jump[3, 0] = omega**2 * disk.mass / EI
            jump[2, 1] = -(omega**2) * disk.inertia[0] / EI
            state, at = jump @ state, disk.position
        state = expm(between * (arm.length - at)) @ state
        return float(np.linalg.det(state[2:]))

    # From above the rigid-body modes at 0 in small steps to the first change of sign.
    steps = pairwise(np.geomspace(1.0, 1e4, 500))
    low, high = next((a, b) for a, b in steps if determinant(a) * determinant(b) < 0)
    return float(brentq(determinant, low, high, xtol=1e-12, rtol=1e-14))


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("disks", [[], [TIP], [MIDDLE, TIP], [HEAVY], [WIDE, HEAVY, MIDDLE, TIP]])
def test_beam_frequency_is_the_root_of_the_frequency_equation(
    disks: list[dict[str, Any]], free: bool
) -> None:
    vehicle = THIN.replace({"arm.disks": disks})
    expected = by_transfer_matrices(vehicle, free)
    found = beam_frequency(vehicle, free=free)
    # The rotary inertia of THIN's sections makes 1e-8 at most.
    assert found == pytest.approx(expected, rel=1e-8)
    # Rayleigh: no finite sum of shapes is below the truth.
    assert found >= expected * (1 - 1e-8)


def test_many_disks_are_a_heavier_backbone() -> None:
    """Also of more disks than the arm is cut at."""
    count, arm = 60, THIN.arm
    each = float(arm.mass) / count
    disks = [{"position": (k + 0.5) / count * arm.length, "mass": each} for k in range(count)]
    vehicle, heavier = THIN.replace({"arm.disks": disks}), THIN.replace({"arm.density": 15700e4})
    for free in (False, True):
        expected = beam_frequency(heavier, free=free)
        # Lumps err by a tenth of the square of their distance over the length.
        assert beam_frequency(vehicle, free=free) == pytest.approx(expected, rel=5e-5)


def test_disks_side_by_side_are_one_disk() -> None:
    half = {"mass": HEAVY["mass"] / 2, "inertia": (HEAVY["inertia"][0] / 2, 0.0)}
    pair = [half | {"position": at} for at in (0.5, 0.5 + 1e-15)]
    one, two = (THIN.replace({"arm.disks": disks}) for disks in ([HEAVY], pair))
    for free in (False, True):
        expected = beam_frequency(one, free=free)
        assert beam_frequency(two, free=free) == pytest.approx(expected, rel=1e-12)


def test_clamped_beams_have_the_frequencies_of_textbooks() -> None:
    arm = THIN.arm
    unit = math.sqrt(arm.bending_stiffness / (arm.mass_per_length * arm.length**4))
    bare = brentq(lambda x: math.cos(x) * math.cosh(x) + 1, 1.5, 2.0)
    assert beam_frequency(THIN) == pytest.approx(bare**2 * unit, rel=1e-7)
    # A tip mass as heavy as the arm.
    loaded = brentq(
        lambda x: (
            1 + math.cos(x) * math.cosh(x)
            + x * (math.cos(x) * math.sinh(x) - math.sin(x) * math.cosh(x))
        ),
        1.0, 1.5,
    )  # fmt: skip
    disk = {"position": 1.0, "mass": float(arm.mass), "inertia": (0.0, 0.0)}
    vehicle = THIN.replace({"arm.disks": [disk]})
    assert beam_frequency(vehicle) == pytest.approx(loaded**2 * unit, rel=5e-9)
    ratio = curvature_error(THIN)["first frequency, UAV clamped"]["error"] + 1
    assert ratio == pytest.approx(math.sqrt(20) / bare**2, rel=2e-8)


def test_a_free_beam_without_a_uav_is_a_free_free_beam() -> None:
    tiny = THIN.replace({"uav.mass": 1e-9, "uav.inertia": (1e-12, 1e-12, 1e-12)})
    arm = tiny.arm
    unit = math.sqrt(arm.bending_stiffness / (arm.mass_per_length * arm.length**4))
    root = brentq(lambda x: math.cos(x) * math.cosh(x) - 1, 4.0, 5.0)
    assert beam_frequency(tiny, free=True) == pytest.approx(root**2 * unit, rel=1e-6)


@pytest.mark.parametrize("mount", [(0.0, 0.0, 0.0), (0.05, -0.02, -0.1)])
def test_one_shape_is_the_model_of_the_kernels(mount: tuple[float, ...]) -> None:
    vehicle = PAPER.replace(
        {
            "uav.mount": mount,
            "uav.inertia": [[0.024, 0.001, 0], [0.001, 0.03, 0.002], [0, 0.002, 0.047]],
            "arm.disks": [MIDDLE, TIP],
        }
    )
    clamped, free = (
        modes(vehicle, base=base, gravity=0.0).frequencies[0] for base in ("clamped", "free")
    )
    assert arc_frequency(vehicle) == pytest.approx(clamped, rel=1e-12)
    assert arc_frequency(vehicle, free=True) == pytest.approx(free, rel=2e-11)


@pytest.mark.parametrize("moments", [(0.02, 0.012), (0.012, 0.02)])
def test_the_first_frequency_of_a_free_uav_is_that_of_the_plane_it_gives_way_to_least(
    moments: tuple[float, float],
) -> None:
    """Roll and pitch moments differ: the lower frequency is that of turns about the larger one."""
    alike = THIN.replace({"uav.inertia": (0.02, 0.02, 0.03), "arm.disks": [TIP]})
    found = curvature_error(alike.replace({"uav.inertia": (*moments, 0.03)}))
    free, decoupled = (found[f"first frequency, UAV free{of}"] for of in ("", ", decoupled"))
    assert free["reference"] == pytest.approx(by_transfer_matrices(alike, free=True), rel=1e-7)
    arc = modes(alike, base="free", gravity=0.0).frequencies[0]
    assert (free["model"], decoupled["reference"]) == pytest.approx((arc, arc), rel=1e-9)


def test_tip_force_and_couple_by_unit_loads_and_by_the_kernels() -> None:
    arm = PAPER.arm
    L, EI = arm.length, arm.bending_stiffness
    found = curvature_error(PAPER)
    # Unit loads: a deflection is the integral of the moments of load and unit force over EI.
    unit_loads = {
        "tip deflection under a tip force": quad(lambda s: (L - s) ** 2 / EI, 0, L)[0],
        "tip angle under a tip force": quad(lambda s: (L - s) / EI, 0, L)[0],
        "tip deflection under a tip couple": quad(lambda s: (L - s) / EI, 0, L)[0],
    }
    for name, expected in unit_loads.items():
        assert found[name]["reference"] == pytest.approx(expected, rel=1e-12, abs=0)
    # Deflections of millimetres: the circle's own nonlinearity is then below 1e-6.
    pushed = trim(PAPER, tip_wrench=(0.1, 0, 0, 0, 0, 0), gravity=0.0).q[6]
    twisted = trim(PAPER, tip_wrench=(0, 0, 0, 0, -0.1, 0), gravity=0.0).q[6]
    force = (pushed * L**2 / 2, "tip deflection under a tip force")
    angle = (pushed * L, "tip angle under a tip force")
    couple = (twisted * L**2 / 2, "tip deflection under a tip couple")
    for moved, name in (force, angle, couple):
        assert abs(moved) / 0.1 == pytest.approx(found[name]["model"], rel=2e-6)
    assert found["tip deflection under a tip force"]["error"] == pytest.approx(-0.25, rel=1e-13)
    assert found["tip deflection under a tip couple"]["error"] == 0


def test_sag_by_unit_loads_and_by_least_energy() -> None:
    vehicle = PAPER.replace({"arm.disks": [MIDDLE, TIP]})
    arm = vehicle.arm
    L, EI, g = arm.length, arm.bending_stiffness, 9.81

    def moment(s: float) -> float:
        disks = sum(d.mass * max(d.position - s, 0.0) for d in arm.disks)
        return float(g * (arm.mass_per_length * (L - s) ** 2 / 2 + disks))

    sag = curvature_error(vehicle)["sag of the tip, arm held level"]
    beam, _ = quad(lambda s: moment(s) * (L - s) / EI, 0, L, points=[0.6])
    assert sag["reference"] == pytest.approx(beam, rel=1e-12, abs=0)

    def energy(kappa: float) -> float:
        work = arm.mass_per_length * kappa * L**3 / 6
        work += sum(d.mass * kappa * d.position**2 / 2 for d in arm.disks)
        return float(EI * L * kappa**2 / 2 - g * work)

    kappa = minimize_scalar(energy, bracket=(0.0, 0.1)).x
    assert sag["model"] == pytest.approx(kappa * L**2 / 2, rel=1e-6)
    # Whatever the load, the arc of least energy has the beam's angle at the tip.
    angle, _ = quad(lambda s: moment(s) / EI, 0, L, points=[0.6])
    assert kappa * L == pytest.approx(angle, rel=1e-6)
    bare = curvature_error(PAPER)["sag of the tip, arm held level"]
    assert bare["error"] == pytest.approx(-1 / 3, rel=1e-13)
    assert curvature_error(PAPER, gravity=0.0)["sag of the tip, arm held level"]["error"] == 0


def test_a_heavy_uav_is_a_clamp_and_a_batch_is_refused() -> None:
    heavy = PAPER.replace({"uav.mass": 1e6, "uav.inertia": (1e6, 1e6, 1e6)})
    assert beam_frequency(heavy, free=True) == pytest.approx(beam_frequency(heavy), rel=1e-5)
    with refused("vehicle"):
        curvature_error(PAPER.replace({"arm.radius": [0.004, 0.005]}))
