"""The free flight that the conservation and convergence tests share."""

import numpy as np

import continuair as ca
from continuair.vehicle.coordinates import euler_to_body_rates


def tumbling(duration: float = 10.0, gravity: float = 0.0) -> ca.Scenario:
    """Bent, bending, spinning and drifting: every term of the coupled dynamics is at work."""
    bend, rate = np.array([1.0, 0.5]), np.array([2.0, -1.0])
    kappa = np.hypot(*bend)
    along = bend / kappa
    across = np.array([-along[1], along[0]])
    q = np.zeros(8)
    q[6:] = kappa, np.arctan2(bend[1], bend[0])
    euler_rates = np.linalg.solve(euler_to_body_rates(q[None])[0], [0.5, 1.0, -0.7])
    qd = np.concatenate([[0.1, -0.2, 0.3], euler_rates, [rate @ along, rate @ across / kappa]])
    return ca.Scenario(name="tumbling", q=q, qd=qd, duration=duration, gravity=gravity)
