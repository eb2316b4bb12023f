"""A clamped arm bent by a couple at its tip: constant curvature against a Cosserat rod."""

from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np
import pytest

import continuair as ca
from tests.oracles.conftest import Claim

pytest.importorskip("elastica", exc_type=ImportError)
import elastica as ea  # noqa: E402

SOURCE = f"PyElastica {version('pyelastica')}"

# A thicker arm than the preset's: the rod's shear waves, of speed over radius, set its time step.
VEHICLE = ca.load_vehicle("paper").replace({"arm.radius": 0.01})
HELD = VEHICLE.replace({"uav.mass": 1e9, "uav.inertia": [1e9, 1e9, 1e9]})
"""The same arm on a base that does not move."""
ARM = VEHICLE.arm
PERIOD = 2 * np.pi / (3.516 * np.sqrt(ARM.bending_stiffness / ARM.mass_per_length)) * ARM.length**2
"""Of the first mode of the clamped beam [s]."""
SAMPLES = 50
_STABLE = 0.8


def ramp(duration: float) -> Callable[[float], float]:
    """From 0 to 1 in that time, with four derivatives zero at both ends."""

    def at(t: float) -> float:
        x = min(t / duration, 1.0)
        return float(x**5 * (126 - 420 * x + 540 * x**2 - 315 * x**3 + 70 * x**4))

    return at


class _Couple(ea.NoForces):  # type: ignore[misc]
    """A couple about -y on the rod's last element."""

    def __init__(self, couple: float, share: Callable[[float], float]):
        super().__init__()
        self.couple, self.share = couple, share

    def apply_torques(self, system: Any, time: Any = 0.0) -> None:
        along = np.array([0.0, -self.couple * self.share(time), 0.0])
        system.external_torques[:, -1] += system.director_collection[..., -1] @ along


class _Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):  # type: ignore[misc]
    """One rod, its clamp and its couple."""


def rod_tip(elements: int, duration: float, couple: float) -> np.ndarray:
    """Path (n, 3) of a rod's tip that hangs clamped and is bent by a couple."""
    simulator = _Simulator()
    rod = ea.CosseratRod.straight_rod(
        elements,
        np.zeros(3),
        np.array([0.0, 0.0, -1.0]),
        np.array([1.0, 0.0, 0.0]),
        ARM.length,
        ARM.radius,
        ARM.density,
        youngs_modulus=ARM.youngs_modulus,
        shear_modulus=ARM.youngs_modulus / 2.6,
    )
    simulator.append(rod)
    simulator.constrain(rod).using(
        ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    simulator.add_forcing_to(rod).using(_Couple, couple=couple, share=ramp(duration))
    simulator.finalize()
    stepper = ea.PositionVerlet()
    sound = np.sqrt(ARM.youngs_modulus / ARM.density)
    limit = _STABLE * min(ARM.length / elements, ARM.radius) / sound
    per_sample = int(np.ceil(duration / SAMPLES / limit))
    time, step = 0.0, duration / SAMPLES / per_sample
    tips = [rod.position_collection[:, -1].copy()]
    for _ in range(SAMPLES):
        for _ in range(per_sample):
            time = stepper.step(simulator, time, step)
        tips.append(rod.position_collection[:, -1].copy())
    return np.array(tips)


def our_tip(duration: float, couple: float) -> np.ndarray:
    share = ramp(duration)
    scenario = ca.Scenario(
        "bend",
        np.zeros(8),
        duration=duration,
        gravity=0.0,
        bend_moment=lambda t: [couple * ARM.length * share(t), 0.0],
    )
    flight = ca.simulate(HELD, scenario, rtol=1e-10, sample=duration / SAMPLES)
    return np.asarray(flight.tip_position.values)


def chain_tip(duration: float, couple: float) -> np.ndarray:
    """The same in MuJoCo, for N → ∞."""
    pytest.importorskip("mujoco", exc_type=ImportError)
    from tests.oracles.mujoco_chain import extrapolated, fly

    share = ramp(duration)
    paths = [
        fly(
            VEHICLE,
            joints,
            duration,
            base="clamped",
            gravity=0.0,
            samples=SAMPLES,
            loads=lambda t: {"bend": couple * share(t)},
        ).tip
        for joints in (8, 16, 32)
    ]
    return np.asarray(extrapolated(*paths))


def relative(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance of two tip paths, over the largest excursion of the second."""
    excursion = np.linalg.norm(b - b[0], axis=1).max()
    return float(np.linalg.norm(a - b, axis=1).max() / excursion)


def test_slow_and_fast_bend(claim: Claim) -> None:
    couple = ARM.bending_stiffness * 1.0  # to a curvature of 1 1/m
    rows, agreement = [], []
    for periods in (0.5, 2.0, 8.0):
        duration = periods * PERIOD
        coarse, fine = (rod_tip(n, duration, couple) for n in (40, 80))
        # The end elements do not bend in their outer halves: errors go with 1/n.
        rod = 2 * fine - coarse
        ours = our_tip(duration, couple)
        agreement.append(relative(rod, chain_tip(duration, couple)))
        rows.append([periods, relative(fine, rod), relative(ours, rod)])
    table = (["duration [periods]", "rod of 80 elements to the limit", "continuair to it"], rows)
    claim(
        "the rod against MuJoCo's chain, bends within ½ to 8 periods: tip paths, relative to the "
        "excursion (do the two engines agree on the beam?)",
        f"{SOURCE}, MuJoCo",
        5e-3,
        max(agreement),
        note="both extrapolated, the rod in 1/n, the chain in 1/N²; the rod shears, the chain not: "
        "E I/(κ G A l²) = 7e-5",
    )
    claim(
        "slow bend: couple applied within 8 periods, distance of the tip of constant curvature "
        "from the rod's, relative to the excursion",
        SOURCE,
        5e-3,
        rows[2][2],
        note="a couple that leaves the arm's inertia behind bends it evenly",
        table=table,
    )
    claim(
        "fast bend: the same within half a period",
        SOURCE,
        None,
        rows[0][2],
        note="the couple bends the tip first, and the bend travels up the arm as a wave, which "
        "constant curvature cannot show",
    )
    claim("a bend in between: the same within 2 periods", SOURCE, None, rows[1][2])
