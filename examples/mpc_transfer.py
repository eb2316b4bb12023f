"""Plan a transfer that leaves the arm at rest, by optimal control on the coupled model."""

import casadi as cs
import numpy as np
import xarray as xr

import continuair as ca

DISTANCE, TIME, N, HEIGHT = 1.0, 1.5, 30, 3.0
ROTORS = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0, 12], "torque_per_thrust": 0.02}
SLENDER = ca.load_vehicle("slender").describe()
VEHICLE = ca.Vehicle(**SLENDER | {"uav": SLENDER["uav"] | {"rotors": ROTORS}})
LIFT, KNOTS = 9.81 * VEHICLE.mass, np.linspace(0, TIME, N + 1)


def rates() -> cs.Function:
    """Of (x, z, pitch, bend) and their rates, under a lift along the body's z and a moment."""
    x, u = cs.SX.sym("x", 8), cs.SX.sym("u", 2)
    model = ca.to_casadi(VEHICLE)
    attitude = cs.vertcat(0, cs.sin(x[2] / 2), 0, cs.cos(x[2] / 2))
    motion = {"velocity": cs.vertcat(x[4], 0, x[5]), "angular_velocity": cs.vertcat(0, x[6], 0)}
    bend = {"bend": cs.horzcat(x[3], 0), "bend_rate": cs.horzcat(x[7], 0)}
    force = u[0] * cs.vertcat(cs.sin(x[2]), 0, cs.cos(x[2]))
    found = model(attitude=attitude, **motion, **bend, force=force, moment=cs.vertcat(0, u[1], 0))
    v, w, k = (found[name] for name in model.name_out())
    return cs.Function("rates", [x, u], [cs.vertcat(x[4:], v[0], v[2], w[1], k[0])])


def planned() -> tuple[np.ndarray, np.ndarray]:
    """States (8, N + 1) at the knots and inputs (2, N) held in between, by multiple shooting."""
    plan = cs.Opti()
    x, u = plan.variable(8, N + 1), plan.variable(2, N)
    plan.subject_to(x[:, 1:] == cs.simpleRK(rates(), 10).map(N)(x[:, :-1], u, TIME / N))
    plan.subject_to(x[:, 0] == 0)
    plan.subject_to(x[:, -1] == cs.vertcat(DISTANCE, cs.DM.zeros(7)))
    plan.set_initial(u[0, :], LIFT)
    plan.minimize(cs.sumsqr(u[0, :] / LIFT - 1) + 25 * cs.sumsqr(cs.diff(u[1, :], 1, 1)))
    plan.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    found = plan.solve()
    return found.value(x), found.value(u)


def flown(inputs: np.ndarray) -> xr.Dataset:
    """What the rotors make of the inputs, and a second of hover after them."""
    wrenches = [[0, 0, lift, 0, moment, 0] for lift, moment in [*inputs.T, (LIFT, 0)]]
    thrusts = VEHICLE.uav.rotors.thrusts_for(np.array(wrenches))

    def held(t: float) -> np.ndarray:
        return thrusts[np.searchsorted(KNOTS, t, side="right") - 1]

    start, acting = [0, 0, HEIGHT, 0, 0, 0, 0, 0], {"rotor_command": held, "jumps": KNOTS[1:]}
    scenario = ca.Scenario("transfer", start, duration=TIME + 1, **acting)
    return ca.simulate(VEHICLE, scenario, rtol=1e-8)


def main() -> None:
    flight = flown(planned()[1])
    bend, after = np.abs(flight.bend).max("bend_axis"), slice(TIME, None)
    off = flight.position.sel(time=TIME).to_numpy() - [DISTANCE, 0, HEIGHT]
    print(
        f"The bend is up to {bend.max():.3f} 1/m, and {bend.sel(time=after).max():.0e} 1/m after."
    )
    print(f"The UAV is {np.linalg.norm(off):.0e} m off its goal when it should be there.")


if __name__ == "__main__":
    main()
