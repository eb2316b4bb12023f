"""What holds of every kind of section, tried on kinds that only the tests define."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import sections
from continuair.engine.engine import Drive, Engine, Start
from continuair.vehicle.layout import GENERAL, TIP
from continuair.vehicle.section import Section
from tests.refusals import refused
from tests.sections.planar_arc import PlanarArc, PlanarSection
from tests.sections.wrapped_arc import WrappedArc, WrappedSection

VEHICLE = ca.load_vehicle("two_section")
ROUNDING = 1e-11
"""Of a flight: products and sums are fused in another order in another kernel."""


@pytest.fixture(autouse=True)
def listed(monkeypatch: pytest.MonkeyPatch) -> None:
    for kind in (WrappedArc, PlanarArc):
        monkeypatch.setitem(sections.KINDS, kind.name, kind)


def mixed(kind: type[Section], place: int) -> ca.Vehicle:
    """The vehicle whose arm has a section of another kind beside an arc."""
    (arm,) = VEHICLE.arms
    found = [kind.model_construct(**dict(each)) if n == place else each
             for n, each in enumerate(arm.section)]  # fmt: skip
    return VEHICLE.having(arm=(arm.having(section=tuple(found)),))


@pytest.mark.parametrize("field", ["arm.arm.section.0.length", "arm"])
def test_a_change_that_would_make_arcs_of_other_kinds_is_refused(field: str) -> None:
    vehicle = mixed(WrappedSection, 0)
    with refused("arm"):
        vehicle.replace({field: 0.3})
    assert vehicle.replace({"uav.mass": 3.0}).uav.mass == 3.0


def pushed() -> ca.Scenario:
    """A flight on which all acts that a scenario can hold but wind."""
    q, qd, tau = np.random.default_rng(3).normal(size=(3, VEHICLE.layout.coordinates))
    return ca.Scenario(
        "pushed",
        0.3 * q,
        0.05 * qd,
        tau=0.02 * tau,
        bend_moment=(0.001, -0.002, 0.0, 0.001),
        tip_wrench=(0.01, 0.02, 0.0, 0.0, 0.001, 0.0),
        duration=0.02,
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "method", "place"),
    [("coupled", "RK4", 1), ("decoupled", "implicit", 0), ("coupled", "Tsit5", 1)],
)
def test_a_wrapped_arc_flies_as_the_arc_does_beside_another_one(
    model: str, method: str, place: int
) -> None:
    how: dict[str, Any] = {"model": model, "method": method, "sample": 5e-3}
    how |= {"rtol": 1e-9} if method == "Tsit5" else {"step": 1e-4}
    arcs = ca.simulate(VEHICLE, pushed(), **how)
    wrapped = ca.simulate(mixed(WrappedSection, place), pushed(), **how)
    for name in ("position", "attitude", "bend", "bend_rate", "tip_position", "base_force"):
        expected = arcs[name].to_numpy()
        assert np.abs(wrapped[name].to_numpy() - expected).max() < ROUNDING * np.abs(expected).max()


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_a_section_of_one_coordinate_moves_in_a_plane_as_an_arc_does(
    model: str, place: int
) -> None:
    """All is in the plane of x and z, which the arc's second coordinate does not leave."""
    arcs, planar = Engine(VEHICLE, model), Engine(mixed(PlanarSection, place), model)
    assert planar.layout.bends == arcs.layout.bends - 1
    expected, found = (_rate(engine) for engine in (arcs, planar))
    for name in ("velocity", "angular_velocity"):
        rate = expected[getattr(arcs.layout, name)]
        assert found[getattr(planar.layout, name)] == pytest.approx(rate, rel=1e-12, abs=1e-12)
    for section in range(2):
        rate = expected[arcs.layout.bend_rate_of(section).start]
        own = found[planar.layout.bend_rate_of(section)]
        assert own[0] == pytest.approx(rate, rel=1e-12)


def _rate(engine: Engine) -> np.ndarray:
    """The rate of a state that moves in the plane of x and z, under a wrench on the tip."""
    layout = engine.layout
    state, inputs = np.zeros(layout.state), np.zeros((1, 1, layout.inputs))
    state[layout.attitude] = 0.0, np.sin(0.1), 0.0, np.cos(0.1)
    state[layout.velocity] = 0.3, 0.0, -0.2
    state[layout.angular_velocity] = 0.0, 0.7, 0.0
    for section, (bend, rate) in enumerate([(1.5, -2.0), (-2.0, 3.0)]):
        state[layout.bend_of(section).start] = bend
        state[layout.bend_rate_of(section).start] = rate
    inputs[..., layout.tip_wrench] = 0.2, 0.0, -0.1, 0.0, 0.03, 0.0
    start = Start(state[None], np.zeros((1, layout.branch_angles)))
    return engine.derivative(start, Drive(inputs, False, GENERAL + TIP, 9.81))[0]
