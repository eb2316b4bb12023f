"""Linearisation, modes and trim."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import continuair as ca
from continuair.analysis.linear import bending_frequencies
from continuair.analysis.modes import Base
from continuair.engine.engine import Engine
from continuair.flight.frequencies import fastest_rate
from tests.refusals import refused

pytestmark = pytest.mark.targets

VEHICLE = ca.load_vehicle("paper")


def test_clamped_modes_are_those_of_the_modal_mass_and_gravity() -> None:
    """ω² = (E I l + g ρA l⁴/12) / M₇₇: gravity stiffens the hanging arm."""
    arm = VEHICLE.arm
    stiffness = arm.bending_stiffness * arm.length + 9.81 * arm.mass_per_length * arm.length**4 / 12
    found = ca.modes(VEHICLE, base="clamped").frequencies
    np.testing.assert_allclose(found, np.sqrt(stiffness / arm.straight_modal_mass), rtol=2e-12)


def test_a_stiff_hovering_vehicle_swings_as_a_rigid_pendulum() -> None:
    """Lift at B, the weight below it: ω² = W c / I about the common centre of mass, at c from B."""
    stiff = VEHICLE.replace({"arm.youngs_modulus": 1e5 * VEHICLE.arm.youngs_modulus})
    arm, uav = stiff.arm, stiff.uav
    below = arm.mass * arm.length / 2.0 / stiff.mass
    about_b = uav.inertia[0][0] + arm.mass * arm.length**2 / 3.0
    about_b += arm.transverse_inertia_per_length * arm.length
    expected = np.sqrt(stiff.mass * 9.81 * below / (about_b - stiff.mass * below**2))
    found = ca.modes(stiff, base="hovering")
    np.testing.assert_allclose(found.frequencies[:2], expected, rtol=1e-5)
    # It turns about its centre of mass, which stays where it is.
    x, _, _, _, turned, *_ = found.shapes[:, np.argmax(np.abs(found.shapes[4, :2]))]
    assert x == pytest.approx(below * turned, rel=1e-4)


HOVERING: dict[str, dict[str, Any]] = {
    "two_section": {"arm.arm.mount": [0.0, 0.0, -0.05], "uav.inertia": [0.02, 0.04, 0.05]},
    "dual_arm": {},
    "slender": {"uav.mount": [0.03, -0.02, -0.05], "arm.damping_ratio": 0.02},
    "paper": {
        "uav.mount": [0.17, 0.15, -0.05],
        "uav.inertia": [0.02, 0.03, 0.04],
        "arm.damping_ratio": 0.01,
    },
}


def hovering(vehicle: ca.Vehicle, yaw: float) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of a hover that looks aside, and A about it under the forces that hold it."""
    rest = ca.trim(vehicle)
    q = np.array(rest.q)
    q[5] = yaw
    held: dict[str, Any] = {
        "force": rest.force,
        "moment": rest.moment,
        "bend_moment": rest.bend_moment,
    }
    return q, ca.linearize(vehicle, q, **held)[0]


@pytest.mark.parametrize("name", HOVERING)
def test_hovering_modes_are_the_eigenvalues_about_the_hover(name: str) -> None:
    """Of all motions, damping and gravity included, but translation and turning in the level."""
    vehicle = ca.load_vehicle(name).replace(HOVERING[name])
    q, A = hovering(vehicle, yaw=0.7)
    rates = np.linalg.eigvals(A)
    swinging = sorted(rates[rates.imag > 0.05], key=abs)
    found = ca.modes(vehicle, q, base="hovering")
    np.testing.assert_allclose(found.frequencies, np.abs(swinging), rtol=2e-3)
    damping = [-rate.real / abs(rate) for rate in swinging]
    np.testing.assert_allclose(found.damping, damping, rtol=2e-3)


def test_a_hover_that_flutters_under_the_constant_moment_that_holds_it_is_told() -> None:
    """Of a vehicle with an arm off its centre and axes of inertia aslant; its swing grows."""
    inertia = [[0.0226, -0.0002, -0.0022], [-0.0002, 0.02315, -0.0039], [-0.0022, -0.0039, 0.0384]]
    uav = {"mass": 2.0, "inertia": inertia, "mount": [-0.145, 0.024, -0.0485]}
    arm = {"length": 0.4927, "radius": 0.004, "density": 1500.0, "youngs_modulus": 20e9}
    vehicle = ca.Vehicle(name="aslant", uav=uav, arm=arm)
    q, A = hovering(vehicle, yaw=0.0)
    growth = np.linalg.eigvals(A).real.max()
    assert growth > 0.02
    with refused("q"):
        ca.modes(vehicle, q, base="hovering")


def test_hovering_modes_solve_the_undamped_motion() -> None:
    """K φ = ω² φ, in the world, where the vehicle looks aside."""
    undamped = {f"arm.{side}.section.0.damping_ratio": 0.0 for side in ("left", "right")}
    vehicle = ca.load_vehicle("dual_arm").replace(undamped)
    q, A = hovering(vehicle, yaw=0.7)
    found = ca.modes(vehicle, q, base="hovering")
    shapes = found.shapes.copy()
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1]])
    shapes[:3] = turn @ shapes[:3]
    n = len(A) // 2
    left = -A[n:, :n] @ shapes - found.frequencies**2 * shapes
    assert np.abs(left).max() < 1e-6 * found.frequencies[-1] ** 2
    np.testing.assert_array_equal(found.damping, 0.0)


# Its two tendons make pairs of modes differ by 2e-6 in frequency, whose shapes a hover mixes up.
NEARLY_EQUAL = pytest.mark.xfail(strict=True, raises=AssertionError, reason="nearly equal modes")
EACH = [
    pytest.param(name, marks=NEARLY_EQUAL) if name == "tentacle" else name
    for name in ca.preset_names()
]


@pytest.mark.parametrize("name", EACH)
def test_without_gravity_nothing_but_the_arms_resists_and_hovering_is_free(name: str) -> None:
    vehicle = ca.load_vehicle(name)
    hovering, free = (ca.modes(vehicle, base=base, gravity=0.0) for base in ("hovering", "free"))
    np.testing.assert_allclose(hovering.frequencies, free.frequencies, rtol=1e-9)
    np.testing.assert_allclose(hovering.damping, free.damping, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(hovering.shapes, free.shapes, rtol=0, atol=1e-9)


@pytest.mark.long
def test_turning_about_a_level_arm_through_the_centre_is_no_mode_whatever_its_rounding() -> None:
    """The arm keeps its sag in the world. With the arm's base lower by h the vehicle hangs from it,
    the more softly the smaller h is, and the other modes are those of h = 0."""

    def modes_of(below: float, stiffness: float) -> Any:
        arm = {"mount": [0.1, 0.0, -below], "attitude": [0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5)]}
        section = {"length": 0.6, "mass_per_length": 0.2, "bending_stiffness": stiffness}
        uav = {"mass": 3.0, "inertia": [0.04, 0.045, 0.07]}
        vehicle = ca.Vehicle(name="level", uav=uav, arm=[arm | {"section": [section]}])
        return ca.modes(vehicle, ca.trim(vehicle).q, base="hovering")

    for stiffness in np.linspace(0.9, 1.1, 9):
        level, lower, lowest = (modes_of(h, stiffness).frequencies for h in (0.0, 1e-5, 4e-5))
        assert lowest[0] == pytest.approx(2.0 * lower[0], rel=1e-2)
        np.testing.assert_allclose(level, lower[1:], rtol=1e-3)


def test_without_gravity_the_clamped_frequency_is_the_arms_own() -> None:
    found = ca.modes(VEHICLE, base="clamped", gravity=0.0).frequencies
    np.testing.assert_allclose(found, VEHICLE.arm.clamped_frequency, rtol=2e-12)


def test_a_very_heavy_base_is_a_clamped_one() -> None:
    heavy = VEHICLE.replace({"uav.mass": 1e7, "uav.inertia": [1e7, 1e7, 1e7]})
    clamped, free = bending_frequencies(heavy)
    # Arm over base: 6e-8 of mass and inertia.
    assert free == pytest.approx(clamped, rel=5e-7)


def test_a_free_base_raises_the_bending_frequency() -> None:
    clamped, free = bending_frequencies(VEHICLE)
    assert free > 2.0 * clamped


def test_a_damping_ratio_is_what_the_clamped_mode_shows() -> None:
    damped = VEHICLE.replace({"arm.damping_ratio": 0.03})
    np.testing.assert_allclose(
        ca.modes(damped, base="clamped", gravity=0.0).damping, 0.03, rtol=2e-12
    )


@pytest.mark.parametrize("ratio", [0.0, 0.2, 4.0])
def test_the_fastest_rate_is_the_largest_eigenvalue_of_the_free_vehicle(ratio: float) -> None:
    vehicle = VEHICLE.replace({"arm.damping_ratio": ratio})
    A, _ = ca.linearize(vehicle, gravity=0.0)
    expected = np.abs(np.linalg.eigvals(A)).max()
    found = fastest_rate(Engine(vehicle, "coupled"), np.zeros(8))
    np.testing.assert_allclose(found, expected, rtol=2e-11)


def test_a_free_vibration_rings_at_the_free_mode() -> None:
    frequency = ca.modes(VEHICLE).frequencies[0]
    scenario = ca.Scenario(name="ring", q=[0, 0, 0, 0, 0, 0, 1e-4, 0], gravity=0.0, duration=0.5)
    bend = ca.simulate(VEHICLE, scenario, method="RK4", step=1e-4).bend.sel(bend_axis="x")
    np.testing.assert_allclose(bend, 1e-4 * np.cos(frequency * bend.time), rtol=0, atol=2e-10)


@pytest.mark.parametrize("noise", [0.0, 1e-16, -3e-17])
def test_an_arm_that_bends_alike_to_all_sides_has_a_mode_along_each_axis(noise: float) -> None:
    """Products of inertia that are rounding tell no direction; neither does the attitude."""
    around = VEHICLE.replace({"uav.inertia": [[0.02, noise, 0], [noise, 0.02, 0], [0, 0, 0.04]]})
    found = ca.modes(around, [0, 0, 0, 0.1, 0.2, 0.3, 0, 0])
    bends = found.shapes[6:]
    np.testing.assert_allclose(bends, bends[0, 0] * np.eye(2), atol=1e-9)
    assert bends[0, 0] > 0.0


def test_the_first_bend_of_a_mode_is_positive() -> None:
    """A mount off both axes alike: modes along the diagonals, the arm's lean not telling which."""
    bends = ca.modes(VEHICLE.replace({"uav.mount": [0.1, 0.1, 0.0]})).shapes[6:]
    np.testing.assert_allclose(bends / bends[0], [[1.0, 1.0], [1.0, -1.0]], rtol=1e-8)
    assert (bends[0] > 0.0).all()


def test_small_motions_follow_the_linear_system() -> None:
    hover = ca.trim(VEHICLE, bend=(0.5, -0.2), yaw=0.3)
    held: dict[str, Any] = {
        "force": hover.force,
        "moment": hover.moment,
        "bend_moment": hover.bend_moment,
    }
    A, B = ca.linearize(VEHICLE, hover.q, **held)
    # From rest at the trim, a small extra bend moment; forced response by the matrix exponential.
    push = np.concatenate([np.zeros(6), [1e-3, 2e-3]])
    block = np.zeros((17, 17))
    block[:16, :16], block[:16, 16] = A, B @ push
    expected = expm(block * 0.05)[:16, 16]
    scenario = ca.Scenario(
        name="push",
        q=hover.q,
        duration=0.05,
        **(held | {"bend_moment": hover.bend_moment + push[6:]}),
    )
    run = ca.simulate(VEHICLE, scenario, method="RK4", step=1e-4)
    moved = (run.bend[-1] - run.bend[0]).to_numpy()
    np.testing.assert_allclose(moved, expected[6:8], rtol=1e-4)


def test_a_tip_force_bends_the_arm_as_the_energy_says() -> None:
    """E I l k + gravity = J_tᵀ F: tip deflection 0.25 F l³/(E I) for constant curvature."""
    tip_force = 0.05
    found = ca.trim(VEHICLE, tip_wrench=[tip_force, 0, 0, 0, 0, 0], gravity=0.0)
    expected = tip_force * VEHICLE.arm.length / (2.0 * VEHICLE.arm.bending_stiffness)
    # The circle's own nonlinearity is quadratic in its angle, 2.5e-4.
    assert found.q[6] == pytest.approx(expected, rel=1e-6)


def test_trim_refuses_a_wrench_without_equilibrium_and_a_bad_bend() -> None:
    with refused("bend"):
        ca.trim(VEHICLE, bend=(1.0, 2.0, 3.0))
    with refused("base"):
        ca.modes(VEHICLE, base="flying")  # type: ignore[arg-type]


CIRCLE = [0.0] * 6 + [2 * np.pi - 1e-3, 0.0]
NOT_A_MAGNITUDE: list[Any] = [np.nan, -1.0, "g", [9.81], np.inf]


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: ca.trim(VEHICLE, bend=[7, 0]), "bend"),
        (lambda: ca.linearize(VEHICLE, CIRCLE), "q"),
        (lambda: ca.modes(VEHICLE, [0] * 6 + [7, 0]), "q"),
        (
            lambda: ca.modes(VEHICLE, [0, 0, 0, np.pi, 0, 0, 0, 0], base="clamped", gravity=1e4),
            "q",
        ),
        (lambda: ca.linearize("paper"), "vehicle"),  # type: ignore[arg-type]
        (lambda: ca.modes("paper"), "vehicle"),  # type: ignore[arg-type]
        (lambda: ca.trim("paper"), "vehicle"),  # type: ignore[arg-type]
        (lambda: ca.modes(VEHICLE, "q"), "q"),
        (lambda: ca.linearize(VEHICLE, qd=[1, 2]), "qd"),
        (lambda: ca.linearize(VEHICLE, force=25.0), "force"),
        (lambda: ca.linearize(VEHICLE, qd=0.1), "qd"),
        (lambda: ca.trim(VEHICLE, tip_wrench=0.1), "tip_wrench"),
        (lambda: ca.trim(VEHICLE, position=1.0), "position"),
        (lambda: ca.modes(VEHICLE, 0.3), "q"),
        (lambda: ca.trim(VEHICLE, yaw="n"), "yaw"),  # type: ignore[arg-type]
        (lambda: ca.modes(VEHICLE, base=np.array(["a", "b"])), "base"),  # type: ignore[arg-type]
        (lambda: ca.trim(VEHICLE.replace({"uav.mass": [1, 2]})), "vehicle"),
    ],
)
def test_what_cannot_be_linearised_or_trimmed_is_told_in_one_sentence(
    call: Callable[[], object], field: str
) -> None:
    with refused(field):
        call()


def test_just_inside_a_full_circle_everything_is_finite() -> None:
    """The largest bend that the sentences name is one that can be used."""
    bend = 2 * np.pi - 0.005
    A, B = ca.linearize(VEHICLE, [0] * 6 + [bend, 0])
    assert np.isfinite(A).all() and np.isfinite(B).all()
    assert np.isfinite(ca.trim(VEHICLE, bend=[bend, 0]).bend_moment).all()


@pytest.mark.parametrize("gravity", NOT_A_MAGNITUDE)
def test_gravity_must_be_a_magnitude_everywhere(gravity: Any) -> None:
    for call in (ca.linearize, ca.modes, ca.trim):
        with refused("gravity"):
            call(VEHICLE, gravity=gravity)
    with refused("gravity"):
        ca.forward_dynamics(VEHICLE, np.zeros(8), np.zeros(8), gravity=gravity)


@pytest.mark.parametrize("base", ["free", "clamped"])
def test_modes_about_a_bend_are_those_of_the_arm_held_there(base: Base) -> None:
    """Eigenvalues of the whole linear system, held by what trim says."""
    at = [0, 0, 0, 0, 0, 0, 1.0, 0.7]
    gravity = 0.0 if base == "free" else 9.81
    held = ca.trim(VEHICLE, bend=[np.cos(0.7), np.sin(0.7)], gravity=gravity)
    A, _ = ca.linearize(
        VEHICLE, at, force=held.force, moment=held.moment, bend_moment=held.bend_moment,
        gravity=gravity, model="coupled" if base == "free" else "independent",
    )  # fmt: skip
    ringing = np.unique(np.round(np.linalg.eigvals(A).imag, 6))[-2:]
    found = ca.modes(VEHICLE, at, base=base, gravity=gravity).frequencies
    np.testing.assert_allclose(found, ringing, rtol=1e-5)


def test_the_bend_that_an_arm_takes_by_itself_is_one_that_it_comes_back_to() -> None:
    """Pushed up beyond buckling, it goes to the side of a small sideways force."""
    soft = ca.load_vehicle("slender")
    found = ca.trim(soft, tip_wrench=[0.01, 0, 30, 0, 0, 0])
    bend = found.q[6] * np.array([np.cos(found.q[7]), np.sin(found.q[7])])
    assert bend[0] > 0.1
    A, _ = ca.linearize(
        soft, found.q, model="independent", tip_wrench=[0.01, 0, 30, 0, 0, 0],
        force=found.force, moment=found.moment,
    )  # fmt: skip
    assert np.linalg.eigvals(A[14:, 6:8]).real.max() < 0.0, "on a held base it swings back"


def two_sections(**arm: object) -> ca.Vehicle:
    """The vehicle with the slender arm in two halves."""
    half = {"length": 0.5, "radius": 0.0025, "density": 7850.0, "youngs_modulus": 207e9}
    uav = {"mass": 2.0, "inertia": [0.024, 0.024, 0.047]}
    return ca.Vehicle(name="halves", uav=uav, arm=[{"section": [half, half], **arm}])


@pytest.mark.long
def test_an_arm_that_buckles_upright_falls_to_a_side_that_nothing_chooses() -> None:
    """As far as with a push of nearly nothing, and a turn around the load is no mode about it."""
    for vehicle in (ca.load_vehicle("slender"), two_sections()):
        pushed, free = (
            ca.trim(vehicle, tip_wrench=[side, 0, 30, 0, 0, 0]).q for side in (1e-5, 0.0)
        )
        np.testing.assert_allclose(free[6::2], pushed[6::2], rtol=1e-5)
        assert free[6] > 1.0, "it has buckled"
    upright = two_sections(attitude=[1.0, 0.0, 0.0, 0.0])
    upright = upright.replace({f"arm.0.section.{i}.youngs_modulus": 1e9 for i in range(2)})
    rest = ca.trim(upright).q
    assert rest[6] > 1.0
    assert len(ca.modes(upright, rest, base="clamped").frequencies) == 3


def test_trim_resolves_the_load_of_a_tiny_vehicle() -> None:
    """All moments in proportion: the same bend angle as at full size."""
    scale = 1e-2
    tiny = VEHICLE.replace(
        {
            "arm.length": scale * VEHICLE.arm.length,
            "arm.radius": scale * VEHICLE.arm.radius,
            "uav.mass": scale**3 * VEHICLE.uav.mass,
            "uav.inertia": (scale**5 * np.asarray(VEHICLE.uav.inertia)).tolist(),
        }
    )
    angles = [
        vehicle.arm.length
        * ca.trim(vehicle, tip_wrench=[size**2 * 5.0, 0, 0, 0, 0, 0], gravity=0.0).q[6]
        for vehicle, size in ((VEHICLE, 1.0), (tiny, scale))
    ]
    assert angles[1] == pytest.approx(angles[0], rel=1e-6)
    assert angles[0] > 0.01


def test_shapes_of_modes_are_in_body_axes_however_the_vehicle_is_turned() -> None:
    mounted = VEHICLE.replace({"uav.mount": [0.1, 0.0, 0.0]})
    level = ca.modes(mounted).shapes
    turned = ca.modes(mounted, [0, 0, 0, 1.0, 0.4, 0.7, 0, 0]).shapes
    np.testing.assert_allclose(turned, level, atol=1e-6)
    assert np.abs(level[:3]).max() > 1e-3
