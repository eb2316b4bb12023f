"""The vehicle with which the project was tried as a new user would."""

import continuair as ca

DISKS = [{"position": 0.04375 * k, "mass": 0.003, "inertia": [1.7e-7, 3.4e-7]} for k in range(1, 9)]
NEW_USER = ca.Vehicle(
    name="mydrone",
    uav={"mass": 1.9, "inertia": [0.012, 0.012, 0.021], "mount": [0.0, 0.0, -0.06]},
    arm={
        "length": 0.35,
        "radius": 0.0008,
        "density": 6450.0,
        "youngs_modulus": 60e9,
        "damping_ratio": 0.02,
        "disks": [*DISKS, {"position": 0.35, "mass": 0.04}],
    },
)
"""A quadrotor of 1.9 kg; the last disk is the camera."""
