"""Tendons in SoRoMoX: lengths of its threadlike actuators, and their forces on strain fields.

Axes, signs and Legendre polynomials are matched as in test_soromox_strain.py. Tendons act within an
arm, so SoRoMoX's robot is the arm alone, clamped at its base. Its tendons end where segments do: a
section within which one of ours ends is two segments.
"""

from functools import cache
from itertools import pairwise
from typing import Any
from unittest import mock

import numpy as np
import pytest
from numpy.polynomial.legendre import legvander
from scipy.linalg import block_diag

import continuair as ca
from continuair.equations import tendon_lengths
from continuair.vehicle.section import Section
from continuair.vehicle.strain import COMPONENTS
from tests.oracles.conftest import Claim
from tests.sections.strains import flying, rod

pytest.importorskip("soromox", exc_type=ImportError)
import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import soromox.systems.gvs.construction as construction  # noqa: E402
import soromox.systems.gvs.core as core  # noqa: E402
from soromox.actuation import ThreadlikeActuator, ThreadlikeRouting  # noqa: E402
from soromox.systems.gvs import GVS  # noqa: E402

from tests.oracles.soromox_hub import SOURCE  # noqa: E402
from tests.oracles.test_soromox_strain import LOCAL, ROWS, numpys_nodes, segment  # noqa: E402

STATES, NODES, THEIRS, TOLERANCE = 5, 16, 32, 1e-10
NOTE = f"SoRoMoX of {THEIRS} of NumPy's nodes per segment, ours of {NODES} per section"
SIZE = np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05])
"""Largest coefficient of each component: a linear bend reaches 2 1/m in both directions."""
SOFT: dict[str, Any] = {"nodes": NODES, "youngs_modulus": 1e5}
"""So soft that the rod's own, larger forces do not round the tendons' away."""

PARALLEL = {"angles": [0.3, 2.0, 4.4], "offset": 0.02, "pretension": 3.0}
CONVERGING = PARALLEL | {"offset": [0.02, 0.005]}
OF_FIRST = {"angles": [1.1, 5.0], "offset": [0.015, 0.01], "pretension": 5.0, "section": "0"}
WITHIN_FIRST = {"angles": [3.5], "offset": [0.01, 0.02], "pretension": 7.0, "section": "0"}

ARMS: dict[str, tuple[list[dict[str, Any]], list[dict[str, Any]]]] = {
    "linear bending": ([rod(**SOFT, bending=1)], [PARALLEL]),
    "linear bending and constant twist, tendons converge": (
        [rod(**SOFT, bending=1, twist=0)], [CONVERGING]
    ),
    "linear bending, twist, stretch and shear, tendons converge": (
        [rod(**SOFT, bending=1, twist=1, stretch=1, shear=1)], [CONVERGING]
    ),
    "two sections, tendons end at the tip, at the end of the first and within it": (
        [rod(**SOFT, bending=1), rod(**SOFT, length=0.3, bending=1, twist=0)],
        [CONVERGING, OF_FIRST, WITHIN_FIRST | {"end": 0.35}],
    ),
}  # fmt: skip


def of_piece(section: Section, start: float, stop: float) -> np.ndarray:
    """SoRoMoX's coordinates of a piece, between shares of a section, per ours of the section."""
    rows, first = {}, 0
    for name, count in zip(COMPONENTS, section.orders.counts, strict=True):
        if count:
            row, sign = ROWS[name]
            at = np.linspace(0.0, 1.0, count)
            own = legvander(2.0 * at - 1.0, count - 1)
            whole = legvander(2.0 * (start + (stop - start) * at) - 1.0, count - 1)
            rows[row] = np.zeros((count, section.coordinates))
            rows[row][:, first : first + count] = sign * np.linalg.solve(own, whole)
        first += count
    return np.vstack([rows[row] for row in sorted(rows)])


class Arm:
    """An arm with tendons as a clamped robot of SoRoMoX."""

    def __init__(self, sections: list[dict[str, Any]], groups: list[dict[str, Any]]) -> None:
        lengths = [each["length"] for each in sections]
        last = [int(group.get("section", len(sections) - 1)) for group in groups]
        ends = [(i, group.get("end", lengths[i])) for i, group in zip(last, groups, strict=True)]
        segments, blocks, stops = [], [], []
        for index, (given, length) in enumerate(zip(sections, lengths, strict=True)):
            at = sorted({0.0, length, *(end for where, end in ends if where == index)})
            for start, stop in pairwise(at):
                segments.append(segment(Section(**given | {"length": stop - start}), THEIRS))
                stops.append((index, stop))
            whole = Section(**given)
            pieces = [of_piece(whole, a / length, b / length) for a, b in pairwise(at)]
            blocks.append(np.vstack(pieces))
        intercepts, slopes, ending, self._tensions = [], [], [], []
        for group, (index, end) in zip(groups, ends, strict=True):
            base, tip = np.broadcast_to(group["offset"], 2)
            slope = (tip - base) / (sum(lengths[:index]) + end)
            for angle in group["angles"]:
                outwards = LOCAL.inv().apply([np.cos(angle), np.sin(angle), 0.0])
                outwards[0] = 0.0
                intercepts.append(base * outwards)
                slopes.append(slope * outwards)
                ending.append(stops.index((index, end)))
                self._tensions.append(group["pretension"])
        routing = ThreadlikeRouting.linear(
            intercept=jnp.asarray(intercepts), slope=jnp.asarray(slopes),
            end_segment_index=tuple(ending),
        )  # fmt: skip
        tendons = ThreadlikeActuator.tendons(routing)
        with (
            mock.patch.object(core, "gauss_quadrature", numpys_nodes),
            mock.patch.object(construction, "gauss_quadrature", numpys_nodes),
        ):
            robot = GVS.from_segments(segments, backend="jax", actuators=tendons)
        self._theirs = block_diag(*blocks)
        self._lengths = jax.jit(lambda q: tendons.path_lengths(robot, q))
        self._forces = jax.jit(lambda q, tensions: robot.actuation_force(q, tensions))

    def lengths(self, strain: np.ndarray) -> np.ndarray:
        """Lengths of all tendons at our coordinates."""
        return np.array(self._lengths(self._theirs @ strain))

    def forces(self, strain: np.ndarray) -> np.ndarray:
        """Generalised forces of the pretensions on our coordinates."""
        theirs = self._forces(self._theirs @ strain, np.array(self._tensions))
        return self._theirs.T @ np.array(theirs)


@cache
def arms(name: str) -> tuple[ca.Vehicle, Arm, np.ndarray]:
    """A vehicle, its arm in SoRoMoX, and strains."""
    sections, groups = ARMS[name]
    vehicle = flying(*sections, tendon=groups)
    parts = [each for part in vehicle.arms[0].section for each in part.orders.coordinates]
    size = SIZE[[component for component, _ in parts]]
    random = np.random.default_rng(9)
    return vehicle, Arm(sections, groups), size * random.uniform(-1.0, 1.0, (STATES, len(parts)))


@pytest.mark.parametrize("name", ARMS)
def test_lengths_of_tendons(claim: Claim, name: str) -> None:
    vehicle, arm, strains = arms(name)
    theirs = np.array([arm.lengths(strain) for strain in strains])
    change = np.abs(theirs - arm.lengths(0.0 * strains[0])).max(axis=1, keepdims=True)
    start = np.pad(strains, ((0, 0), (6, 0)))
    flight = ca.simulate(
        vehicle, ca.Scenario("tendons", start, gravity=0.0, duration=1e-6), method="implicit",
        step=1e-6, sample=1e-6, variables=["tendon_length"],
    )  # fmt: skip
    of_flight = flight["tendon_length"].transpose("time", "run", "tendon").to_numpy()[0]
    for what, ours in (
        ("start of a flight", of_flight),
        ("readable form", tendon_lengths(vehicle, strains)),
    ):
        worst = float((np.abs(ours - theirs) / change).max())
        text = f"lengths of tendons, {what}, {name}, worst relative to the change from straight"
        text += f", {STATES} random strains"
        claim(text, SOURCE, TOLERANCE, worst, note=NOTE)


@pytest.mark.parametrize("name", ARMS)
def test_forces_of_tendons(claim: Claim, name: str) -> None:
    vehicle, arm, strains = arms(name)
    bare = vehicle.replace({"arm.0.tendon": ()})
    pushes = np.array([arm.forces(strain) for strain in strains])
    found, expected, without = (
        ca.accelerations(flown, strain=strains, strain_force=force, gravity=0.0)
        for flown, force in ((vehicle, None), (bare, pushes), (bare, None))
    )
    worst = 0.0
    for ours, theirs, free in zip(found, expected, without, strict=True):
        error = np.linalg.norm(ours - theirs, axis=1) / np.linalg.norm(theirs - free, axis=1)
        worst = max(worst, float(error.max()))
    what = f"forces of tendons, {name}, by the accelerations v̇, ω̇ and q̈ that they add"
    text = f"{what}, worst relative, {STATES} random strains"
    claim(text, SOURCE, TOLERANCE, worst, note=NOTE)
