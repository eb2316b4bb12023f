"""First frequencies and static sag: constant curvature against chains of rigid links."""

import numpy as np
import pytest
from scipy.optimize import brentq

import continuair as ca
from continuair.analysis.modes import Base
from continuair.vehicle.vehicle import Vehicle
from tests.oracles.conftest import Claim

mujoco = pytest.importorskip("mujoco", exc_type=ImportError)
from tests.oracles.mujoco_chain import (  # noqa: E402
    SOURCE,
    CircularChain,
    chain,
    extrapolated,
    first_frequency,
)

VEHICLE = ca.load_vehicle("paper")
JOINTS = (8, 16, 32, 64)
CANTILEVER = 1.875104068711961**2
"""ω √(ρA l⁴ / EI) of a clamped beam's first mode, the root of cos x cosh x = -1, squared."""


def circular_frequency(joints: int, base: str) -> float:
    """The same for the chain that is held in a circular arc."""
    M, _ = CircularChain(VEHICLE, joints).terms([0, 0, 0, 1], [0, 0], [0, 0, 0], [0, 0])
    compliance = np.linalg.inv(M)[6, 6] if base == "free" else 1.0 / M[6, 6]
    return float(np.sqrt(VEHICLE.arm.bending_stiffness * VEHICLE.arm.length * compliance))


def beam_on_hub() -> float:
    """First frequency [rad/s] of a thin beam that hangs from the free hub: momentum balances.

    E I w'''(0) = m ω² w(0), E I w''(0) = -J ω² w'(0), both zero at the tip.
    """
    arm, uav = VEHICLE.arm, VEHICLE.uav
    EI, μ, l_a = arm.bending_stiffness, arm.mass_per_length, arm.length

    def determinant(ω: float) -> float:
        β = (μ * ω**2 / EI) ** 0.25
        x = β * l_a
        m, J = uav.mass * ω**2 / (EI * β**3), uav.inertia[1][1] * ω**2 / (EI * β)
        # w = a cos + b sin + c cosh + d sinh
        rows = [
            [-m, -1.0, -m, 1.0],
            [-1.0, J, 1.0, J],
            [-np.cos(x), -np.sin(x), np.cosh(x), np.sinh(x)],
            [np.sin(x), -np.cos(x), np.sinh(x), np.cosh(x)],
        ]
        return float(np.linalg.det(rows))

    scan = np.linspace(10.0, 400.0, 400)
    values = [determinant(ω) for ω in scan]
    first = next(i for i in range(399) if values[i] * values[i + 1] < 0)
    return float(brentq(determinant, scan[first], scan[first + 1], xtol=1e-10))


@pytest.mark.parametrize("base", ["clamped", "free"])
def test_first_frequency(claim: Claim, base: Base) -> None:
    ours = float(ca.modes(VEHICLE, base=base, gravity=0.0).frequencies[0])
    chains = [first_frequency(VEHICLE, n, base) for n in JOINTS]
    circular = [circular_frequency(n, base) for n in JOINTS]
    limit = extrapolated(*chains[1:])
    rows = [[n, f, c, ours / f] for n, f, c in zip(JOINTS, chains, circular, strict=True)]
    table = (
        ["N", "chain [rad/s]", "chain held circular [rad/s]", "continuair / chain"],
        [*rows, ["∞", limit, extrapolated(*circular[1:]), ours / limit]],
    )
    claim(
        f"{base} first frequency of constant curvature, relative to links held in a circular arc, "
        "N → ∞",
        SOURCE,
        1e-8,
        ours / extrapolated(*circular[1:]) - 1.0,
    )
    # The thin beam lacks the sections' rotary inertia, (r/2l)² = 6e-6 times a factor of the mode.
    thin = beam_on_hub() if base == "free" else CANTILEVER * thin_unit()
    claim(
        f"{base} first frequency of the chain over that of a thin beam (is the chain a beam?)",
        f"{SOURCE}, beam theory",
        1e-4,
        limit / thin,
        1.0,
    )
    if base == "clamped":
        claim(
            "clamped first frequency of constant curvature over the true beam's",
            SOURCE,
            1e-4,
            ours / limit,
            np.sqrt(20.0) / CANTILEVER,
            note="constant curvature has ω² = 20 EI/(ρA l⁴), and a clamped beam 3.516² of them: "
            "one shape of deflection, s²/2, is stiffer than the beam's own",
            table=table,
        )
    else:
        claim(
            "free first frequency of constant curvature over the true beam's",
            SOURCE,
            None,
            ours / limit,
            note="above 1 by Rayleigh's principle, as a restricted shape is stiffer; nearer to 1 "
            "than clamped, as the hub's own motion adds to the shapes that the arm can take",
            table=table,
        )


def thin_unit() -> float:
    """√(EI / (ρA l⁴)) [rad/s]."""
    arm = VEHICLE.arm
    return float(np.sqrt(arm.bending_stiffness / (arm.mass_per_length * arm.length**4)))


def chain_sag(joints: int, force: float) -> float:
    """Deflection [m] of the clamped chain's tip under a sideways force, in equilibrium."""
    model = chain(VEHICLE, joints, base="clamped", bending="plane", gravity=0.0)
    data = mujoco.MjData(model)
    J = np.zeros((3, model.nv))
    for _ in range(200):
        mujoco.mj_forward(model, data)
        mujoco.mj_jacSite(model, data, J, None, 0)
        residual = J.T @ [force, 0.0, 0.0] + data.qfrc_passive
        if np.abs(residual).max() < 1e-12 * abs(force):
            break
        data.qpos += residual / model.jnt_stiffness
    return float(data.site_xpos[0][0])


def our_sag(vehicle: Vehicle, force: float) -> float:
    k = ca.trim(vehicle, tip_wrench=[force, 0, 0, 0, 0, 0], gravity=0.0).q[6:]
    angle = k[0] * vehicle.arm.length
    return float(np.cos(k[1]) * (1.0 - np.cos(angle)) / k[0])


@pytest.mark.parametrize(
    ("load", "of_beam", "of_circle", "tolerance"),
    # F l² / EI; δ/l of a slender beam: F l³/3EI, and Bisshopp and Drucker's elastica at load 1.
    [(1e-3, 1e-3 / 3, 0.25e-3, 1e-9), (1.0, 0.3017, None, 5e-5)],
    ids=["small", "large"],
)
def test_static_sag(
    claim: Claim, load: float, of_beam: float, of_circle: float | None, tolerance: float
) -> None:
    arm = VEHICLE.arm
    force = load * arm.bending_stiffness / arm.length**2
    chains = [chain_sag(n, force) / arm.length for n in JOINTS]
    limit = extrapolated(*chains[1:])
    ours = our_sag(VEHICLE, force) / arm.length
    what = f"sag over length under a tip force of {load:g} EI/l²"
    table = (
        ["N", "sag/l of the chain", "continuair / chain"],
        [[n, x, ours / x] for n, x in zip([*JOINTS, "∞"], [*chains, limit], strict=True)],
    )
    claim(f"{what}: the chain, N → ∞", f"{SOURCE}, beam theory", tolerance, limit, of_beam)
    if of_circle is not None:
        claim(
            f"{what}: constant curvature over the true beam",
            SOURCE,
            1e-4,
            ours / limit,
            0.75,
            note="F l³/4EI against F l³/3EI: the sag of the shape s²/2 is ¼",
            table=table,
        )
    else:
        claim(
            f"{what}: constant curvature over the true beam",
            SOURCE,
            None,
            ours / limit,
            note="the ratio is ¾ for small loads",
            table=table,
        )
