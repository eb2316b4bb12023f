"""Columns of states, inputs and logs, for any number of sections of any kind."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from continuair.typing import Array, ArrayLike
from continuair.vehicle import arc

GENERAL, PAPER, TIP, COMMAND, AIR, ROTORS, TENDONS, BENDING = 1, 2, 4, 8, 16, 32, 64, 128
"""Groups of inputs, as bits: along the state's axes, along the paper's coordinates, tip wrenches, a
controller's actuator wrench (not a column of the inputs), wind, commanded rotor thrusts, commands
of tendons, and a controller that bends tendon-driven arms (no column either)."""


@dataclass(frozen=True)
class Input:
    """Input of a simulation, with its columns per vehicle, section, arm, rotor or tendon.

    axes: letters of the components; of an input per section, those of an arc. channels: names in a
    design, one for each vector of components. bit: group of the input. An input per section has one
    column for each coordinate of the section.
    """

    name: str
    axes: str
    units: str
    meaning: str
    bit: int
    channels: tuple[str, ...] = ()
    per: str = "vehicle"

    @property
    def components(self) -> tuple[str, ...]:
        """Return the names of the components for one section, as in logs and recordings."""
        return tuple(f"{self.name}_{axis}" for axis in self.axes)

    def width(self, layout: Layout) -> int:
        """Return the number of columns."""
        if self.per == "section":
            return layout.bends
        counts = {"vehicle": 1, "arm": layout.arms, "air": int(layout.air)} | dict(layout.counts)
        return len(self.axes) * counts.get(self.per, 0)


INPUTS = (
    Input("force", "xyz", "N", "a force at the UAV's centre of mass in world axes [N]", GENERAL,
          ("force",)),
    Input("moment", "xyz", "N m", "a moment on the UAV in body axes [N m]", GENERAL, ("moment",)),
    Input("bend_moment", "xy", "N m²", "the generalised forces of the bend vector [N m²]", GENERAL,
          ("bend",), per="section"),
    Input("euler_torque", "xyz", "N m", "Euler torques [N m]", PAPER),
    Input("polar_torque", "κψ", "N m², N m", "Q_kappa [N m²] and Q_psi_a [N m]", PAPER,
          per="section"),
    Input("tip_wrench", "xyzxyz", "N, N m",
          "a force [N] and a moment [N m] at the tip in world axes", TIP,
          ("tip_force", "tip_moment"), per="arm"),
    Input("wind", "xyz", "m/s", "the velocity of the air in world axes [m/s]", AIR, per="air"),
    Input("rotor_command", "z", "N", "a thrust for each rotor [N]", ROTORS, per="rotor"),
    Input("tendon_command", "z", "N", "a tension above the pretension [N], or a length to take in "
          "[m], for each tendon", TENDONS, per="tendon"),
)  # fmt: skip
"""Table of inputs, in the order of their columns."""

OF_NAME = {each.name: each for each in INPUTS}

PUSH = ("force", "moment", "bend_moment")
"""Inputs that a controller's actuator wrench consists of, in order."""

ACTUATORS = tuple(name for each in PUSH for name in OF_NAME[each].components)
"""Names of the components of an actuator wrench, for one section."""

TAU = ("force", "euler_torque", "polar_torque")
"""Inputs that the paper's generalised forces τ, conjugate to q, consist of, in order."""

FIELDS = {"tau": TAU} | {
    name: (name,) for name in (*PUSH, "tip_wrench", "wind", "rotor_command", "tendon_command")
}
"""Field of a scenario -> inputs that it sets."""

CHANNELS = {
    f"{channel}_{axis}": (each.name, len(each.axes) // len(each.channels) * n + k)
    for each in INPUTS
    for n, channel in enumerate(each.channels)
    for k, axis in enumerate(each.axes[: len(each.axes) // len(each.channels)])
}
"""Channel of a design -> input, and index of its component."""


def numbered(names: Iterable[str], sections: int | None) -> tuple[str, ...]:
    """Return names of quantities per section, numbered from 1 if the arms are a list.

    sections: their number; None for the one section of an [arm] table, whose names have no number.
    """
    if sections is None:
        return tuple(names)
    names = tuple(names)
    return tuple(f"{name}_{k}" for k in range(1, sections + 1) for name in names)


OF_UAV = ("x", "y", "z", "roll", "pitch", "yaw")
"""Names of the paper's coordinates of the UAV, in order."""

COORDINATES = OF_UAV + arc.POLAR
"""Names of the paper's coordinates, in order, for one section."""


def columns(widths: Iterable[tuple[str, int]]) -> dict[str, slice]:
    """Return slices of adjacent columns by name, in the order given."""
    found: dict[str, slice] = {}
    first = 0
    for name, width in widths:
        found[name] = slice(first, first + width)
        first += width
    return found


@dataclass(frozen=True)
class Layout:
    """Columns of the states, log rows and inputs of a vehicle.

    An attribute with the name of a quantity is the slice of its columns. Sections follow one
    another arm by arm, each arm from its base.

    * State: position (world), attitude (x y z w, body to world), coordinates of the sections (bend
      vectors of arcs [1/m]), velocity of B's origin (world axes), angular velocity (body axes),
      rates of the coordinates, then what terms add, such as speeds of rotors over their maximum.
    * Log row: state, the paper's coordinates of each section ((κ, ψa) of an arc on its signed
      branch), Euler angles, a controller's actuator wrench.
    * Inputs: those of the table INPUTS.

    Parameters
    ----------
    widths : tuple of tuple of int
        Number of coordinates of each section of each arm.
    air : bool, default False
        Whether wind acts on the vehicle.
    energies : bool, default False
        Whether terms have a potential energy.
    counts : tuple of tuple of (str, int), default ()
        Actuators that have inputs, by name, such as "rotor", and their number.
    own_states : tuple of tuple of (str, int), default ()
        States that terms add, by name, and the columns of each.
    own_variables : tuple of tuple of (str, int), default ()
        Variables that terms compute along a log, by name, and the columns of each.
    strains : tuple of int, default ()
        Sections, by their index among those of all arms, whose coordinates are those of a strain
        field. All others are arcs, with the paper's polar coordinates.
    """

    widths: tuple[tuple[int, ...], ...]
    air: bool = False
    energies: bool = False
    counts: tuple[tuple[str, int], ...] = ()
    own_states: tuple[tuple[str, int], ...] = ()
    own_variables: tuple[tuple[str, int], ...] = ()
    strains: tuple[int, ...] = ()

    position = slice(0, 3)
    attitude = slice(3, 7)

    @classmethod
    def of_arcs(cls, *sections: int) -> Layout:
        """Return the layout of arms with the given numbers of arcs."""
        return cls(tuple((arc.COORDINATES,) * count for count in sections))

    @classmethod
    def of_coordinates(cls, count: int) -> Layout:
        """Return the layout of an arm with `count` coordinates q, with wind and one rotor."""
        return cls(((count - len(OF_UAV),),), air=True, counts=(("rotor", 1), ("tendon", 1)))

    @cached_property
    def sections(self) -> int:
        """Return the number of sections of all arms."""
        return len(self.of_section)

    @property
    def arcs(self) -> tuple[int, ...]:
        """Return the sections that are arcs."""
        return tuple(each for each in range(self.sections) if each not in self.strains)

    @cached_property
    def arc_coordinates(self) -> NDArray[np.intp]:
        """Return the two coordinates of each arc among those of all sections, (arcs, 2)."""
        firsts = [self.of_section[section].start for section in self.arcs]
        return np.add.outer(np.array(firsts, int), np.arange(arc.COORDINATES))

    @cached_property
    def strain_coordinates(self) -> tuple[int, ...]:
        """Return the coordinates of strain fields among those of all sections."""
        return tuple(
            coordinate
            for section in self.strains
            for coordinate in range(self.of_section[section].start, self.of_section[section].stop)
        )

    @cached_property
    def arms(self) -> int:
        """Return the number of arms."""
        return len(self.widths)

    @cached_property
    def bends(self) -> int:
        """Return the number of coordinates of all sections."""
        return sum(map(sum, self.widths))

    @cached_property
    def of_section(self) -> tuple[slice, ...]:
        """Return the slice of each section among the coordinates of all."""
        return _adjacent(width for arm in self.widths for width in arm)

    @cached_property
    def of_arm(self) -> tuple[slice, ...]:
        """Return the slice of each arm among the coordinates of all sections."""
        return _adjacent(map(sum, self.widths))

    @cached_property
    def owner(self) -> tuple[int, ...]:
        """Return the section of each coordinate."""
        widths = [width for arm in self.widths for width in arm]
        return tuple(section for section, width in enumerate(widths) for _ in range(width))

    def per_coordinate(self, of_sections: ArrayLike, axis: int = -1) -> Array:
        """Return values of the sections along an axis, repeated for each of their coordinates."""
        return np.take(np.asarray(of_sections), self.owner, axis)

    @cached_property
    def coordinates(self) -> int:
        """Return the number of the paper's coordinates: [x y z φ θ ψ] and those of each section."""
        return len(OF_UAV) + self.bends

    @cached_property
    def polar(self) -> slice:
        """Return the slice of the sections' coordinates among the paper's."""
        return slice(len(OF_UAV), self.coordinates)

    def polar_of(self, section: int) -> slice:
        """Return the slice of a section's coordinates among the paper's."""
        return _within(self.polar, self.of_section[section])

    @cached_property
    def bend(self) -> slice:
        """Return the columns of the sections' coordinates in a state: bend vectors of arcs."""
        return _after(self.attitude, self.bends)

    def bend_of(self, section: int) -> slice:
        """Return the columns of a section's coordinates in a state."""
        return _within(self.bend, self.of_section[section])

    def bend_rate_of(self, section: int) -> slice:
        """Return the columns of the rates of a section's coordinates in a state."""
        return _within(self.bend_rate, self.of_section[section])

    @cached_property
    def velocity(self) -> slice:
        """Return the columns of the velocity of B's origin in a state."""
        return _after(self.bend, 3)

    @cached_property
    def angular_velocity(self) -> slice:
        """Return the columns of the angular velocity in a state."""
        return _after(self.velocity, 3)

    @cached_property
    def bend_rate(self) -> slice:
        """Return the columns of the rates of the sections' coordinates in a state."""
        return _after(self.angular_velocity, self.bends)

    @property
    def rotors(self) -> int:
        """Return the number of rotors."""
        return dict(self.counts).get("rotor", 0)

    @property
    def tendons(self) -> int:
        """Return the number of tendons."""
        return dict(self.counts).get("tendon", 0)

    @cached_property
    def of_state(self) -> dict[str, slice]:
        """Return the columns of the states that terms add, by name."""
        first = self.bend_rate.stop
        return {name: _shifted(part, first) for name, part in columns(self.own_states).items()}

    @property
    def rotor_speed(self) -> slice:
        """Return the columns of the rotor speeds, over their maximum, in a state."""
        return self.of_state.get("rotor_speed", _after(self.bend_rate, 0))

    @cached_property
    def state(self) -> int:
        """Return the number of columns of a state."""
        return self.bend_rate.stop + sum(width for _, width in self.own_states)

    @cached_property
    def branch(self) -> slice:
        """Return the columns of the paper's coordinates of all sections in a log row."""
        return slice(self.state, self.state + self.bends)

    @cached_property
    def euler(self) -> slice:
        """Return the columns of roll, pitch and yaw in a log row, whole turns included."""
        return _after(self.branch, 3)

    @property
    def branch_angles(self) -> int:
        """Return the number of angles that fix the branches: ψa of each section, and 3."""
        return self.sections + 3

    @cached_property
    def command(self) -> slice:
        """Return the columns of a controller's actuator wrench in a log row."""
        return _after(self.euler, self.push.stop)

    @cached_property
    def log(self) -> int:
        """Return the number of columns of a log row."""
        return self.command.stop

    @cached_property
    def of_input(self) -> dict[str, slice]:
        """Return the columns of each input of the vehicle in a row of inputs."""
        there = [each for each in INPUTS if each.width(self) or each.per in ("section", "arm")]
        return columns((each.name, each.width(self)) for each in there)

    @property
    def force(self) -> slice:
        """Return the columns of the world force in a row of inputs."""
        return self.of_input["force"]

    @property
    def moment(self) -> slice:
        """Return the columns of the body moment in a row of inputs."""
        return self.of_input["moment"]

    @property
    def bend_moment(self) -> slice:
        """Return the columns of the bend moments in a row of inputs."""
        return self.of_input["bend_moment"]

    @property
    def push(self) -> slice:
        """Return the columns of world force, body moment and bend moments in a row of inputs."""
        return _joined([self.of_input[name] for name in PUSH])

    @property
    def tip_wrench(self) -> slice:
        """Return the columns of the tip wrenches in a row of inputs, arm by arm."""
        return self.of_input["tip_wrench"]

    @cached_property
    def inputs(self) -> int:
        """Return the number of columns of a row of inputs."""
        return width_of(self.of_input)

    @property
    def observed(self) -> dict[str, slice]:
        """Return the columns of the quantities computed along a log."""
        return observed_columns(self.arms, self.own_variables, self.energies)

    def alike(self, names: Iterable[str]) -> list[slice]:
        """Return the columns, of adjacent inputs, with one unit and one arm or section."""
        found: list[slice] = []
        for name in names:
            of, where = OF_NAME[name], self.of_input[name]
            all_of_it = where.stop - where.start
            each = len(of.axes) // len(of.units.split(", "))
            width = all_of_it if of.per in dict(self.counts) else each
            first = found[-1].stop if found else 0
            found += [slice(first + n, first + n + width) for n in range(0, all_of_it, width)]
        return found

    def add(self, table: Array, names: Iterable[str], values: Array) -> None:
        """Add values (..., n) of adjacent inputs to a table of inputs (..., inputs), in place."""
        first = 0
        for name in names:
            where = self.of_input[name]
            width = where.stop - where.start
            table[..., where] += values[..., first : first + width]
            first += width


def _after(previous: slice, width: int) -> slice:
    return slice(previous.stop, previous.stop + width)


def _shifted(part: slice, first: int) -> slice:
    return slice(first + part.start, first + part.stop)


def _within(whole: slice, part: slice) -> slice:
    """Return the columns of a part, given relative to the whole."""
    return _shifted(part, whole.start)


def _adjacent(widths: Iterable[int]) -> tuple[slice, ...]:
    """Return slices of adjacent columns, in the order given."""
    return tuple(columns((str(n), width) for n, width in enumerate(widths)).values())


def _joined(parts: list[slice]) -> slice:
    """Return the columns of adjacent parts together."""
    return slice(parts[0].start, parts[-1].stop)


ONE_SECTION = Layout.of_arcs(1)
"""Layout of the paper's vehicle: eight coordinates, 17 numbers in a state."""

OF_TIPS = ("tip_position", "tip_attitude", "tip_velocity", "tip_angular_velocity")
"""Quantities of each arm's tip along a log, computed alike for every model."""

OF_ARM = (*OF_TIPS, "base_force", "base_moment")
"""Quantities computed for each arm along a log."""

OF_BODIES = ("base_force", "base_moment", "kinetic_energy", "gravity_energy", "elastic_energy",
             "linear_momentum", "angular_momentum")  # fmt: skip
"""Quantities along a log that depend on the model."""


TENDON_VARIABLES = (
    "tendon_tension", "tendon_end_tension", "tendon_length", "tendon_slack",
    "tendon_friction_power", "tendon_energy",
)  # fmt: skip
"""Quantities of each tendon along a log, in order."""


def observed_columns(
    arms: int, own: tuple[tuple[str, int], ...] = (), energies: bool = False
) -> dict[str, slice]:
    """Return the columns of the quantities computed along a log, those of arms in order."""
    widths = [
        ("tip_position", 3), ("tip_attitude", 4), ("tip_velocity", 3), ("tip_angular_velocity", 3),
        ("base_force", 3), ("base_moment", 3), ("kinetic_energy", 1), ("gravity_energy", 1),
        ("elastic_energy", 1), ("linear_momentum", 3), ("angular_momentum", 3),
    ]  # fmt: skip
    widths += [*own, *([("term_energy", 1)] if energies else [])]
    return columns((name, width * (arms if name in OF_ARM else 1)) for name, width in widths)


TIP_POSE = columns([("position", 3), ("attitude", 4)])
"""Columns of a logged tip pose; attitude: tip frame to world, x y z w."""

DEVIATIONS = ("nrmse_t", "nrmse_r", "rmse_t_m", "rmse_r_rad", "angle_rad")
EULER_DEVIATIONS = ("nrmse_r", "rmse_r_rad")
"""Columns of the deviations between two logs of the tip, named as by `continuair.compare`."""


def watched_columns(points: int) -> dict[str, slice]:
    """Return the columns of the camera pose, its twist and its image features along a log."""
    return columns([
        ("camera_position", 3), ("camera_attitude", 4), ("camera_twist", 6),
        ("image", 2 * points), ("depth", points), ("in_view", points),
    ])  # fmt: skip


def setpoint_columns(bends: int) -> dict[str, slice]:
    """Return the columns of setpoints; follows: whether the position is controlled."""
    return columns([
        ("position", 3), ("follows", 1), ("velocity", 3), ("yaw", 1), ("yaw_rate", 1),
        ("bend", bends),
    ])  # fmt: skip


def frame_columns(points: int) -> dict[str, slice]:
    """Return the columns of a camera frame on its way to the controller."""
    return columns([("image", 2 * points), ("seen", 2 * points), ("depth", points)])


def summed_columns(points: int) -> dict[str, slice]:
    """Return the columns of a frame and of the integral of the image error.

    sum: integral of the error over time [s]; time: of the last update [s]; rate: integral gain
    [1/s].
    """
    frame = [("frame", width_of(frame_columns(points)))]
    return columns([*frame, ("sum", 2 * points), ("time", 1), ("rate", 1)])


MOTION = columns([("position", 3), ("velocity", 3)])
"""Columns of the motion of a target's centroid, in world axes."""


def width_of(named: dict[str, slice]) -> int:
    """Return the number of named columns."""
    return max(where.stop for where in named.values())
