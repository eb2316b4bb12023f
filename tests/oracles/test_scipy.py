"""SciPy's DOP853 on the readable form: another integrator on other equations of motion."""

from importlib.metadata import version

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import continuair as ca
from continuair import equations as eq
from continuair.typing import Model
from tests.oracles.conftest import Claim

SOURCE = f"SciPy {version('scipy')} DOP853 on continuair.equations"
VEHICLE = ca.load_vehicle("paper").replace(
    {
        "uav.mount": [0.03, -0.05, 0.04],
        "arm.damping": 0.3,
        "arm.kappa_s": 0.0,
        "arm.disks": [{"position": 0.9, "mass": 0.1, "inertia": [3e-5, 5e-5]}],
    }
)
MASKS = {"coupled": "coupled", "decoupled": "block"}
START = [0, 0, 5, 0.1, -0.2, 0.3, 0.8, 0.5]
RATES = [1, 0, 2, 0.5, 0.3, -0.2, 1.0, 80.0]
"""The bend goes round fast enough to stay off the straight arm, where polar coordinates end."""
DURATION = 0.2


def wrench(t: float) -> list[float]:
    """Tip wrench [N, N m], world axes."""
    return [8 * np.sin(20 * t), 5 * np.cos(15 * t), 12.0, 0.2, -0.1 * np.sin(10 * t), 0.3]


def scenario(forced: bool) -> ca.Scenario:
    acting = wrench if forced else None
    return ca.Scenario("flight", START, RATES, tip_wrench=acting, duration=DURATION)


def reference_tips(model: str, forced: bool, times: np.ndarray) -> np.ndarray:
    """Tip path (n, 3) by the paper's equations in the paper's coordinates."""

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        q, qd = y[:8], y[8:]
        push = wrench(t) if forced else 0.0
        qdd = eq.forward_dynamics(VEHICLE, q, qd, tip_wrench=push, mask=MASKS[model])
        return np.concatenate([qd, qdd])

    start = np.array([*START, *RATES], float)
    solved = solve_ivp(rate, (0, DURATION), start, "DOP853", times, rtol=1e-11, atol=1e-13)
    return np.array([eq.position(VEHICLE, y[:8], VEHICLE.arm.length) for y in solved.y.T])


@pytest.mark.parametrize("model", MASKS)
@pytest.mark.parametrize("forced", [False, True], ids=["free", "forced"])
def test_flights(claim: Claim, model: Model, forced: bool) -> None:
    flight = scenario(forced)
    fine = ca.simulate(VEHICLE, flight, model=model, rtol=1e-12, sample=0.01)
    times = fine.time.values
    tips = reference_tips(model, forced, times)

    def off(path: np.ndarray) -> float:
        return float(np.linalg.norm(path - tips, axis=1).max())

    steps = [8e-4 / 2**i for i in range(4)]
    ladder = [
        off(
            ca.simulate(
                VEHICLE, flight, model=model, method="RK4", step=h, sample=0.01
            ).tip_position.values
        )
        for h in steps
    ]
    kind = "a tip wrench acts" if forced else "free flight"
    what = f"{model}, {kind}, {DURATION} s, tip path"
    claim(
        f"{what}: Tsit5 on the kernels, rtol 1e-12, largest distance",
        SOURCE,
        1e-9,
        off(fine.tip_position.values),
        unit="m",
    )
    claim(
        f"{what}: order of the kernels' RK4, from steps of 0.4 and 0.2 ms",
        SOURCE,
        0.1,
        float(np.log2(ladder[1] / ladder[2])),
        4.0,
        table=(
            ["step [s]", "largest distance [m]"],
            [list(x) for x in zip(steps, ladder, strict=True)],
        ),
    )
