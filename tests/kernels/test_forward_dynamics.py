"""The kernels against the readable form, which shares no code with them."""

from functools import cache

import numpy as np
import pytest

import continuair as ca
from continuair import equations
from continuair.engine.engine import Drive, Engine, Start
from continuair.sections.arc import moments as arc
from continuair.typing import ArrayLike, Model
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL, PAPER
from tests.kernels.conftest import Place
from tests.refusals import refused

pytestmark = pytest.mark.targets

PLAIN = ca.load_vehicle("paper").replace({"arm.kappa_s": 0.0})
FURNISHED = PLAIN.replace(
    {
        "arm.damping": 0.3,
        "uav.mount": [0.03, -0.05, 0.04],
        "uav.inertia": [[0.024, 0.001, 0.002], [0.001, 0.026, -0.001], [0.002, -0.001, 0.04]],
        "arm.disks": [
            {"position": 0.3, "mass": 0.02, "inertia": [1e-5, 2e-5]},
            {"position": 1.0, "mass": 0.1, "inertia": [3e-5, 5e-5]},
        ],
    }
)
VEHICLES = {"plain": PLAIN, "furnished": FURNISHED}
STATES = 60


def in_bend_axes(q: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
    scaled = accelerations.copy()
    scaled[:, 7] *= q[:, 6]
    return scaled


def drawn() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """States q and q̇, forces and wrenches on the tip: κl up to 2π, |θ| <= 1.2."""
    rng = np.random.default_rng(20260218)
    n = STATES
    q = np.column_stack(
        [
            rng.uniform(-2, 2, (n, 3)),
            rng.uniform(-np.pi, np.pi, n),
            rng.uniform(-1.2, 1.2, n),
            rng.uniform(-np.pi, np.pi, n),
            rng.uniform(0.02, 2 * np.pi, n) * rng.choice([-1, 1], n),
            rng.uniform(-np.pi, np.pi, n),
        ]
    )
    return q, rng.normal(size=(n, 8)), rng.normal(0, 5, (n, 8)), rng.normal(0, 5, (n, 6))


@cache
def readable(name: str, mask: str) -> np.ndarray:
    """The readable form's accelerations of those."""
    return np.array(
        [
            equations.forward_dynamics(VEHICLES[name], *each, mask=mask, nodes=32)
            for each in zip(*drawn(), strict=True)
        ]
    )


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize(("model", "mask"), [("coupled", "coupled"), ("decoupled", "block")])
def test_kernels_equal_the_papers_equations(
    name: str, model: Model, mask: str, place: Place
) -> None:
    """4 x 60 states; reached: 4e-13, and 3e-6 in float32."""
    q, *acting = drawn()
    fast = ca.forward_dynamics(
        VEHICLES[name], q, *acting, model=model, dtype=place.dtype, device=place.device
    )
    slow = readable(name, mask)
    error = np.linalg.norm(in_bend_axes(q, fast - slow), axis=1)
    size = np.linalg.norm(in_bend_axes(q, slow), axis=1)
    assert np.max(error / size) < (1e-11 if place.exact else 1e-5)


def test_beyond_a_full_circle_there_is_no_number(place: Place) -> None:
    q = np.zeros(8)
    q[6] = 2 * np.pi * 1.001
    found = ca.forward_dynamics(
        PLAIN, q, np.zeros(8), model="coupled", dtype=place.dtype, device=place.device
    )
    assert np.isnan(found).all()


def test_independent_model_moves_the_uav_as_a_rigid_body(place: Place) -> None:
    """A bend moment moves only the arm, a force on the UAV only the UAV."""
    q = np.array([0, 0, 0, 0.1, 0.2, 0.3, 0.7, 0.4])

    def accelerations(tau: list[float]) -> np.ndarray:
        return ca.forward_dynamics(
            PLAIN, q, [0] * 8, tau, model="independent", dtype=place.dtype, device=place.device
        )

    rest = accelerations([0.0] * 8)
    bent = accelerations([0.0] * 6 + [3.0, 0.5])
    np.testing.assert_allclose(bent[:6], rest[:6], atol=1e-12)
    pushed = accelerations([5.0] + [0.0] * 7)
    np.testing.assert_allclose(pushed[6:], rest[6:], atol=1e-9)
    assert pushed[0] - rest[0] > 1.0


def test_moments_obey_the_tangent_identity_at_any_bend() -> None:
    """u B² + C² = 1 of the unit tangent makes uP + S a trace."""
    s, u = np.linspace(0.0, 4.4, 7)[:, None], arc.squared_bends()
    by_density = arc.integrands(s, u)
    alpha, beta = by_density["alpha"][0], by_density["beta"][0]
    trace = u * by_density["P"][0] + by_density["S"][0]
    np.testing.assert_allclose(
        trace.astype(float), (u * alpha**2 + beta**2).astype(float), atol=1e-14
    )
    no_mass = u * by_density["P"][2] + by_density["S"][2]
    np.testing.assert_allclose(no_mass.astype(float), -1.0, atol=1e-14)


BENT = [0.0, 0.0, 5.0, 0.1, 0.2, 0.3, 1.1, 0.4]


@pytest.mark.parametrize(
    ("field", "value"), [("q", "seven"), ("qd", np.zeros(7)), ("tau", [np.nan] * 8)]
)
def test_a_bad_array_is_named(field: str, value: object) -> None:
    arguments = {"q": np.zeros(8), "qd": np.zeros(8), field: value}
    with refused(field):
        ca.forward_dynamics(PLAIN, **arguments, model="coupled")  # type: ignore[arg-type]


@pytest.mark.parametrize("given", [{"tau": 1.0}, {"tip_wrench": 0.1}, {"qd": 0.1}, {"q": 0.1}])
def test_one_number_does_not_stand_for_a_vector_unless_it_is_0(given: dict[str, float]) -> None:
    (name,) = given
    rest = {"q": BENT, "qd": 0.0, "tau": 0.0, "tip_wrench": 0.0}
    with refused(name):
        ca.forward_dynamics(PLAIN, **rest | given)  # type: ignore[arg-type]
    none = ca.forward_dynamics(PLAIN, BENT, [0] * 8, [0] * 8, [0] * 6)
    np.testing.assert_array_equal(ca.forward_dynamics(PLAIN, **rest), none)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("q", "field"),
    [
        (np.zeros((0, 8)), "q"),
        (np.zeros(8), "q"),
        ([0, 0, 0, 0, np.pi / 2, 0, 0.1, 0], "q"),
        ([0, 0, 0, 0, -np.pi / 2, 0, 0.1, 0], "q"),
    ],
)
def test_where_the_papers_coordinates_are_singular_is_told(q: ArrayLike, field: str) -> None:
    with refused(field):
        ca.forward_dynamics(PLAIN, q, 0, [0] * 7 + [1.0])


def test_rows_that_do_not_fit_the_vehicles_are_refused() -> None:
    batch = PLAIN.replace({"uav.mass": [1.0, 2.0]})
    with refused("vehicle"):
        ca.forward_dynamics(batch, np.full((3, 8), 0.1), 0)


@pytest.mark.parametrize("kappa", [0.2, 0.01, -0.01, -0.2])
def test_a_torque_about_the_bend_is_divided_by_the_bend_or_by_its_threshold(kappa: float) -> None:
    """Q_psi_a acts across the bend as Q_psi_a / κ, |κ| at least κ_s, with the sign of κ."""
    engine = Engine(PLAIN.replace({"arm.kappa_s": 0.05}), "coupled")
    layout, torque, psi = engine.layout, 0.3, 0.7
    q = np.array([[0.1, 0.2, 0.3, 0.1, -0.2, 0.4, kappa, psi]])
    start = Start(state_from_paper(q, np.zeros((1, 8)), layout), branches_of(q, layout))
    polar, plain = np.zeros((2, 1, 1, layout.inputs))
    polar[..., layout.of_input["polar_torque"]] = 0.0, torque
    across = np.array([-np.sin(psi), np.cos(psi)])
    plain[..., layout.bend_moment] = torque / np.copysign(max(abs(kappa), 0.05), kappa) * across
    rates = [
        engine.derivative(start, Drive(table, False, GENERAL + PAPER, 9.81))
        for table in (polar, plain)
    ]
    np.testing.assert_allclose(rates[0], rates[1], rtol=1e-12, atol=1e-12)
