"""Functions that cannot use a strain that varies say so, and impossible strains are refused."""

import inspect
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.interfaces.log_recording import check_roles
from tests.refusals import refused
from tests.sections.strains import flying, rod

LINEAR = flying(rod(bending=1))

USE_IT = {
    "accelerations",
    "simulate",
    "trim",
    "modes",
    "linearize",
    "advise",
    "backbone",
    "gradient",
    "classic",
    "design",
    "run_pairs",
    "twist_servoing",
    "flight_controller",
    "hold",
    "rigid_inertia",
    "tendon_tensions",
    "pressing",
    "to_casadi",
    "to_mjcf",
}
"""Functions that sections of any kind can be given to."""


def of_vehicles() -> dict[str, Any]:
    """Return the public functions whose first argument is a vehicle."""
    found: dict[str, Any] = {}
    for name in ca.__all__:
        each = getattr(ca, name)
        if inspect.isfunction(each):
            first = next(iter(inspect.signature(each).parameters), "")
            found |= {name: each} if first == "vehicle" else {}
    return found


def arguments(function: Any) -> dict[str, Any]:
    """Return arguments that an arm of one arc could be given."""
    values = {
        "scenario": ca.Scenario("rest", q=[0, 0, 1, 0, 0, 0, 0.1, 0]),
        "q": [0.0] * 8, "qd": [0.0] * 8, "position": [0, 0, 1], "bandwidth": 3.0, "path": "a.xml",
        "cost": lambda flight: 0.0, "flight": None,
    }  # fmt: skip
    given = inspect.signature(function).parameters.values()
    return {
        each.name: values[each.name]
        for each in given
        if each.default is each.empty and each.name in values
    }


def test_there_are_such_functions() -> None:
    assert len(of_vehicles()) > 15 and set(of_vehicles()) >= USE_IT


@pytest.mark.parametrize("name", sorted(set(of_vehicles()) - USE_IT))
def test_functions_for_arcs_refuse_a_strain_that_varies(name: str) -> None:
    function = of_vehicles()[name]
    with refused("strain"):
        function(LINEAR, **arguments(function))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"tau": np.zeros(10)}, "scenario.tau"),
        ({"q": np.zeros(8), "qd": np.zeros(8)}, "scenario.q"),
    ],
)
def test_scenarios_of_arcs_are_refused(changes: dict[str, Any], field: str) -> None:
    with refused(field):
        ca.simulate(LINEAR, ca.Scenario("rest", np.zeros(10)).replace(**changes))


def test_variables_of_arcs_are_refused() -> None:
    with refused("variables"):
        ca.simulate(LINEAR, ca.Scenario("rest", np.zeros(10)), variables=["bend"])
    with refused("variables"):
        ca.simulate(
            ca.load_vehicle("paper"), arguments(ca.simulate)["scenario"], variables=["strain"]
        )


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"bending": 4}, "arm.0.section.0.strain.bending"),
        ({"bending": 1, "twist": 3}, "arm.0.section.0.strain.twist"),
        ({"bending": 1, "stretch": 2}, "arm.0.section.0.strain.stretch"),
        ({"bending": 2, "nodes": 2}, "arm.0.section.0.nodes"),
        ({"bending": 1, "nodes": 40}, "arm.0.section.0.nodes"),
        ({"bending": 0, "nodes": 6}, "arm.0.section.0.nodes"),
        ({"bending": 1, "twist": 0, "poisson_ratio": None}, "arm.0.section.0.poisson_ratio"),
        ({"bending": 1, "twist": 0, "poisson_ratio": 0.6}, "arm.0.section.0.poisson_ratio"),
    ],
)
def test_impossible_strains_are_refused(changes: dict[str, Any], field: str) -> None:
    with refused(field):
        flying(rod(**changes))


def test_coordinates_of_arcs_and_of_strains_are_not_mixed_up() -> None:
    with refused("bend"):
        ca.accelerations(LINEAR, bend=[[1.0, 0.0]])
    with refused("strain_rate"):
        ca.accelerations(ca.load_vehicle("paper"), strain_rate=[1.0, 0.0])


@pytest.mark.parametrize("name", ["strain.bending", "nodes"])
def test_what_gives_a_section_its_coordinates_is_the_same_in_all_runs(name: str) -> None:
    with refused(f"arm.0.section.0.{name}"):
        LINEAR.replace({f"arm.0.section.0.{name}": [6, 7]})


@pytest.mark.parametrize("bend", [[12.0, 12.0, 0.0, 0.0], [6.0, 6.0, 2.0, 2.0]])
def test_a_strain_beyond_a_full_circle_is_refused(bend: list[float]) -> None:
    at = np.concatenate([np.zeros(6), bend])
    for field, call in (
        ("bend", lambda: ca.trim(LINEAR, bend=bend)),
        ("bend", lambda: ca.hold(LINEAR, [0, 0, 1], bend=bend)),
        ("q", lambda: ca.linearize(LINEAR, at)),
        ("q", lambda: ca.modes(LINEAR, at)),
    ):
        with refused(field):
            call()


def test_a_law_for_arcs_is_refused() -> None:
    rest = ca.Scenario("rest", np.zeros(10))
    law = ca.flight_controller(flying(rod()))
    wanted = ca.Setpoints(bend=[0.5, 0.0, 0.0, 0.0])
    with refused("controller"):
        ca.simulate(LINEAR, rest.replace(controller=law, setpoints=wanted))


def test_a_log_of_a_tip_does_not_give_a_strain_but_one_of_all_coordinates_does() -> None:
    check_roles(LINEAR, {"position", "attitude", "bend"})
    for role in ("tip", "camera"):
        with refused("topics"):
            check_roles(LINEAR, {"position", "attitude", role})


def test_a_soft_upright_arm_tips_over_or_is_refused() -> None:
    """Its equilibrium may be where the sums of its coefficients allow no more."""
    soft = flying(rod(bending=1, youngs_modulus=1e7), attitude=[1.0, 0.0, 0.0, 0.0])
    with refused("gravity"):
        ca.trim(soft)
