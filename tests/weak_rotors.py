"""Rotors that just carry a vehicle, and cannot push as a servoing law asks for at the start."""

from continuair.vehicle.vehicle import Vehicle


def with_weak_rotors(vehicle: Vehicle) -> Vehicle:
    """The vehicle with six tilted rotors, each of which gives a quarter of its weight."""
    weight = 9.81 * (vehicle.uav.mass + vehicle.arm.mass)
    rotors = {
        "layout": "hex_tilted", "lever": 0.3, "tilt": 0.5, "torque_per_thrust": 0.02,
        "thrust_limits": [0.0, 0.25 * weight],
    }  # fmt: skip
    return vehicle.replace({"uav.rotors": rotors})
