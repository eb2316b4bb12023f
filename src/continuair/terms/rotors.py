"""Rotors: thrusts, allocation of a commanded wrench to rotors, and downwash."""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.arguments import arguments
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.logs import push_reader
from continuair.kernels.term_sum import Acting
from continuair.terms.term import CasadiModel, Stream, Term
from continuair.vehicle.layout import COMMAND, ROTORS
from continuair.vehicle.rotors import AIR_DENSITY, WASH_EDGE
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class RotorThrusts(Term):
    """Thrusts of rotors that follow commanded thrusts with a first-order lag of their speed.

    Parameters
    ----------
    count : int
        Number of rotors.
    prompt : bool, default False
        Whether rotors of some runs have no lag.
    washing : bool, default False
        Whether the rotors have a radius, and so a downwash.
    curved : bool, default False
        Whether the thrust is not the square of the speed: f_max (f u² + (1 - f) u) of what follows
        the command, u, with f the thrust_model_factor.
    uneven : bool, default False
        Whether rotors slow down with another lag.
    """

    field: ClassVar[str] = "uav.rotors"
    flown: ClassVar[tuple[str, ...]] = (
        "allocation", "inverse", "lowest", "highest", "lag", "hubs", "disk",
    )  # fmt: skip
    stiff: ClassVar[bool] = False

    count: int
    prompt: bool = False
    washing: bool = False
    curved: bool = False
    uneven: bool = False

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return the term if the vehicle has rotors, else None.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle, plain or batched.

        Returns
        -------
        RotorThrusts or None
            The term.
        """
        rotors = vehicle.uav.rotors
        if rotors is None:
            return None
        prompt = bool((np.asarray(rotors.lag) == 0.0).any())
        curved = bool((np.asarray(rotors.thrust_model_factor) != 1.0).any())
        washing, uneven = rotors.radius is not None, rotors.lag_down is not None
        return cls(rotors.count, prompt, washing, curved, uneven)

    @property
    def moves_air(self) -> bool:
        """Return whether the rotors have a downwash."""
        return self.washing

    @property
    def states(self) -> dict[str, int]:
        """Return the speeds of the rotors, over their maximum."""
        return {"rotor_speed": self.count}

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of rotors, each with a command."""
        return {"rotor": self.count}

    @property
    def variables(self) -> dict[str, int]:
        """Return the thrusts, and the saturation of the vehicle."""
        return {"rotor_thrust": self.count, "saturation": 1}

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return the fields of the device's Plant that describe the rotors.

        Parameters
        ----------
        tree : Tree
            The arms.

        Returns
        -------
        dict of str to tuple of int
            Shape of ``allocation`` and its pseudo-inverse ``inverse``, of each rotor's
            thrust limits ``lowest`` and ``highest`` [N], of ``lag`` and ``lag_down`` [s]
            and the factor ``thrust_curve``. With a downwash also ``hubs`` [m],
            ``disk``, the squared radius [m²], and ``wash``, squared induced velocity per thrust.
        """
        wash = {"hubs": (self.count, 3), "disk": (), "wash": ()} if self.washing else {}
        matrices = {"allocation": (6, self.count), "inverse": (self.count, 6)}
        more = {"lag_down": ()} if self.uneven else {}
        more |= {"thrust_curve": ()} if self.curved else {}
        limits = {"lowest": (self.count,), "highest": (self.count,)}
        return {**matrices, **limits, "lag": (), **more, **wash}

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill the fields of `parameters`.

        Parameters
        ----------
        plants : structured ndarray, shape (runs,)
            Parameters of the vehicles, changed in place.
        vehicle : Vehicle
            The vehicle.
        """
        rotors, runs = vehicle.uav.rotors, len(plants)
        assert rotors is not None
        plants["allocation"], plants["inverse"] = rotors.allocation, rotors.inverse
        plants["lowest"], plants["highest"] = rotors.limits[..., 0], rotors.limits[..., 1]
        plants["lag"] = per_run(rotors.lag, runs)
        if self.uneven:
            plants["lag_down"] = per_run(rotors.lag_down, runs)
        if self.curved:
            plants["thrust_curve"] = per_run(rotors.thrust_model_factor, runs)
        if self.washing:
            square = np.square(per_run(rotors.radius, runs))
            plants["hubs"], plants["disk"] = rotors.hubs, square
            plants["wash"] = 0.5 / (AIR_DENSITY * np.pi * square)

    def device(self, code: Device) -> Acting:
        """Return the device functions of the rotors.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on the UAV, rates of the speeds, and the demand beyond the thrust limits.
        """
        of = rotor_code(code.numbers, code.tree, self)
        return Acting(on_uav=of.rotor_load, rates=of.spun_up, excess=of.excess_of)

    def left(self, numbers: Numbers, tree: Tree) -> wp.Function:
        """Return the device function that keeps only the bend moments of an actuator wrench.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Function
            ``bending(push) -> Push``. The rotors apply force and moment.
        """
        types = device_types(numbers, tree)
        Push, vec3 = types.Push, types.vec3
        push_of, bend_moment_of = types.push_of, types.bend_moment_of

        @wp.func
        def bending(push: Push):
            return push_of(vec3(), vec3(), bend_moment_of(push))

        return bending

    def stream(self, numbers: Numbers, tree: Tree) -> Stream | None:
        """Return the downwash of the rotors, or None without a radius.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        Stream or None
            Device functions of the moving air.
        """
        return _wash(numbers, tree, self) if self.washing else None

    def observer(self, numbers: Numbers, tree: Tree) -> wp.Kernel:
        """Return the kernel of thrusts and saturation along a log.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Kernel
            The kernel `thrusts`, which writes the columns ``rotor_thrust`` and ``saturation``.
        """
        return _thrusts_kernel(numbers, tree, self)

    def casadi(self, model: CasadiModel) -> "SX":
        """Return no force: the model in CasADi has no rotor commands.

        Parameters
        ----------
        model : CasadiModel
            The symbolic vehicle.

        Returns
        -------
        SX, shape (6 + 2 N, 1)
            Zeros.
        """
        return model.none


@dataclass(frozen=True)
class RotorCode:
    """Device functions of the rotors.

    rotor_load(y, along, flight, row, push): load of the thrusts. spun_up(rate, y, flight, row,
    push): rate of the state with the rates of the speeds. thrusts_of: thrusts. speeds_of: speeds
    over the greatest. excess_of: largest demand beyond the thrust limits, as a share of their
    range.
    """

    rotor_load: Any
    spun_up: Any
    thrusts_of: Any
    speeds_of: Any
    excess_of: Any


@cache
def rotor_code(numbers: Numbers, tree: Tree, term: RotorThrusts) -> RotorCode:
    """Return the device functions of rotors for numbers and a tree of arms."""
    types, code = device_types(numbers, tree), number_code(numbers)
    Flight, Load = flight_code(numbers, tree).Flight, load_code(numbers, tree).Load
    Real, State, Push, Plant = types.Real, types.State, types.Push, types.Plant
    PerRotor = wp.types.vector(term.count, types.Real)
    Along, attitude_of, vec3 = types.Along, types.attitude_of, types.vec3
    force_of, moment_of = types.force_of, types.moment_of
    above, finite, of_row = code.above, code.finite, code.of_row
    rotors, prompt = term.count, term.prompt
    speeds, commands = types.layout.rotor_speed.start, types.layout.of_input["rotor_command"].start
    zero, one, two, four = Real(0.0), Real(1.0), Real(2.0), Real(4.0)

    @wp.func
    def asked_of(y: State, flight: Flight, row: int, push: Push):
        """Return the demanded thrusts, without those for yaw, and those for yaw."""
        plant = flight.plant
        force = wp.quat_rotate_inv(attitude_of(y), force_of(push))
        moment = moment_of(push)
        out = PerRotor()
        yaw = PerRotor()
        for i in range(rotors):
            for j in range(3):
                out[i] = out[i] + plant.inverse[i, j] * force[j]
            for j in range(2):
                out[i] = out[i] + plant.inverse[i, 3 + j] * moment[j]
            yaw[i] = plant.inverse[i, 5] * moment[2]
        if (flight.groups & ROTORS) != 0:
            for i in range(rotors):
                out[i] = out[i] + of_row(flight.inputs, row, flight.run, commands + i)
        return out, yaw

    @wp.func
    def lowest_of(flight: Flight):
        """Return the lower thrust limits, which apply under a controller only, else 0."""
        out = PerRotor()
        if (flight.groups & COMMAND) != 0:
            for i in range(rotors):
                out[i] = flight.plant.lowest[i]
        return out

    @wp.func
    def commanded(y: State, flight: Flight, row: int, push: Push):
        """Return thrusts within the limits; yaw is reduced first."""
        asked, yaw = asked_of(y, flight, row, push)
        lowest = lowest_of(flight)
        highest = flight.plant.highest
        share = one
        for i in range(rotors):
            room = wp.max(above(yaw[i], zero, highest[i] - asked[i], asked[i] - lowest[i]), zero)
            size = wp.abs(yaw[i])
            fits = room / above(size, zero, size, one)
            share = wp.min(share, above(size, zero, fits, one))
        for i in range(rotors):
            wish = asked[i] + share * yaw[i]
            # NaN stays NaN.
            asked[i] = finite(wish, wp.min(wp.max(wish, lowest[i]), highest[i]), wish)
        return asked

    @wp.func
    def excess_of(y: State, flight: Flight, row: int, push: Push):
        asked, yaw = asked_of(y, flight, row, push)
        given = commanded(y, flight, row, push)
        lowest = lowest_of(flight)
        out = zero
        for i in range(rotors):
            beyond = wp.abs(asked[i] + yaw[i] - given[i])
            out = wp.max(out, beyond / (flight.plant.highest[i] - lowest[i]))
        return out

    if term.curved:

        @wp.func
        def share_of(speed: Real, plant: Plant):
            """Thrust over the greatest."""
            curve = plant.thrust_curve
            return speed * (curve * speed + (one - curve))

        @wp.func
        def speed_of(share: Real, plant: Plant):
            """The root of `share_of`, in a form that divides by no small number but at 0."""
            straight = one - plant.thrust_curve
            below = straight + wp.sqrt(straight * straight + four * plant.thrust_curve * share)
            return above(share, zero, two * share / above(below, zero, below, one), zero)

    else:

        @wp.func
        def share_of(speed: Real, plant: Plant):
            return speed * speed

        @wp.func
        def speed_of(share: Real, plant: Plant):
            return wp.sqrt(share)

    if term.uneven:

        @wp.func
        def lag_of(behind: Real, plant: Plant):
            return above(zero, behind, plant.lag_down, plant.lag)

    else:

        @wp.func
        def lag_of(behind: Real, plant: Plant):
            return plant.lag

    @wp.func
    def turning(y: State, plant: Plant):
        """Return the thrusts of the rotor speeds."""
        out = PerRotor()
        for i in range(rotors):
            out[i] = plant.highest[i] * share_of(y[speeds + i], plant)
        return out

    @wp.func
    def turning_or_commanded(y: State, flight: Flight, row: int, push: Push):
        out = turning(y, flight.plant)
        given = commanded(y, flight, row, push)
        for i in range(rotors):
            out[i] = above(flight.plant.lag, zero, out[i], given[i])
        return out

    @wp.func
    def turning_alone(y: State, flight: Flight, row: int, push: Push):
        return turning(y, flight.plant)

    thrusts_of = turning_or_commanded if prompt else turning_alone

    @wp.func
    def speeds_of(y: State, flight: Flight, row: int, push: Push):
        out = thrusts_of(y, flight, row, push)
        for i in range(rotors):
            out[i] = speed_of(out[i] / flight.plant.highest[i], flight.plant)
        return out

    @wp.func
    def rotor_load(y: State, along: Along, flight: Flight, row: int, push: Push):
        plant = flight.plant
        thrusts = thrusts_of(y, flight, row, push)
        force = vec3()
        moment = vec3()
        for i in range(rotors):
            for j in range(3):
                force[j] = force[j] + plant.allocation[j, i] * thrusts[i]
                moment[j] = moment[j] + plant.allocation[3 + j, i] * thrusts[i]
        out = Load()
        out.force = force
        out.moment = moment
        return out

    @wp.func
    def spun_up(rate: State, y: State, flight: Flight, row: int, push: Push):
        plant = flight.plant
        given = commanded(y, flight, row, push)
        for i in range(rotors):
            behind = speed_of(given[i] / plant.highest[i], plant) - y[speeds + i]
            lag = lag_of(behind, plant)
            change = behind / above(lag, zero, lag, one)
            rate[speeds + i] = above(lag, zero, change, zero)
        return rate

    return holding(RotorCode, locals())


def _wash(numbers: Numbers, tree: Tree, term: RotorThrusts) -> Stream:
    types, thrusts_of = device_types(numbers, tree), rotor_code(numbers, tree, term).thrusts_of
    Flight, Real, State, Plant = (
        flight_code(numbers, tree).Flight, types.Real, types.State, types.Plant,
    )  # fmt: skip
    Push, vec3, rotors = types.Push, types.vec3, term.count
    Induced = wp.types.vector(rotors, Real)
    edge, half, zero, one, three = Real(WASH_EDGE), Real(0.5), Real(0.0), Real(1.0), Real(3.0)

    @wp.func
    def risen(x: Real):
        """Return a smooth step from 0 at -1 to 1 at 1."""
        part = wp.min(wp.max(half * (x + one), zero), one)
        return part * part * (three - (one + one) * part)

    @wp.func
    def begun(y: State, flight: Flight, row: int, push: Push):
        """Return the induced velocities at the disks, by momentum theory in hover."""
        out = thrusts_of(y, flight, row, push)
        for i in range(rotors):
            out[i] = wp.sqrt(flight.plant.wash * out[i])
        return out

    @wp.func
    def velocity(plant: Plant, point: vec3, induced: Induced):
        """Return the downwash at a point, summed over the rotors above it.

        The smooth edge adds as much beyond the disk's area as it takes within.
        """
        out = vec3()
        thick = edge * wp.sqrt(plant.disk)
        for i in range(rotors):
            axis = vec3(plant.allocation[0, i], plant.allocation[1, i], plant.allocation[2, i])
            from_hub = point - vec3(plant.hubs[i, 0], plant.hubs[i, 1], plant.hubs[i, 2])
            height = wp.dot(from_hub, axis)
            aside = wp.length_sq(from_hub) - height * height
            within = risen((one - aside / plant.disk) / edge) * risen(-height / thick)
            out -= within * induced[i] * axis
        return out

    return Stream(Induced, begun, velocity)


def _thrusts_kernel(numbers: Numbers, tree: Tree, term: RotorThrusts) -> Any:
    """Return the kernel `thrusts`, for every model: columns rotor_thrust and saturation."""
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    code, of = number_code(numbers), rotor_code(numbers, tree, term)
    Cell, layout = types.Cell, types.layout
    Vehicles, Drive = structs.Vehicles, arguments(numbers.precision).Drive
    flight_of, load_state = structs.flight_of, types.load_state
    thrusts_of, excess_of = of.thrusts_of, of.excess_of
    keep, lanes, logged_push = code.keep, code.lanes, push_reader(numbers, tree)
    columns = layout.observed
    first, excess_at = columns["rotor_thrust"].start, columns["saturation"].start
    rotors = term.count

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def thrusts(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        """Write thrusts and saturation; drive: inputs, one row per sample or one for all."""
        pack, sample = wp.tid()
        run = pack * lanes
        flight = flight_of(vehicles, drive, run)
        y = load_state(log, run, sample, flight.plant.unit)
        row = sample * flight.stride
        push = logged_push(log, run, sample)
        given = thrusts_of(y, flight, row, push)
        for i in range(rotors):
            keep(out, run, sample, first + i, given[i])
        keep(out, run, sample, excess_at, excess_of(y, flight, row, push))

    return thrusts
