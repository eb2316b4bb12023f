"""Where each quantity sits in states, inputs and logs, for any number of sections of any kind."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from continuair.vehicle import arc

GENERAL, PAPER, TIP, COMMAND, AIR, ROTORS = 1, 2, 4, 8, 16, 32
"""What acts, as bits: inputs along the state's own axes, those along the paper's coordinates, the
wrench at the tip; a controller's push, which is no column of the inputs; wind; and thrusts that are
commanded of the rotors."""


@dataclass(frozen=True)
class Input:
    """An input of a flight: its columns per vehicle, section, arm or rotor, and what they mean.

    Inputs of a section have as many columns as it has coordinates; axes names those of an arc.
    axes: letters of the components. channel: what a design calls each run of components, if it has
    names for them. bit: of the group that it belongs to.
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
        """Names of the components for one section, as logs and recordings call them."""
        return tuple(f"{self.name}_{axis}" for axis in self.axes)

    def width(self, layout: Layout) -> int:
        """Number of columns."""
        if self.per == "section":
            return layout.bends
        counts = {"vehicle": 1, "arm": layout.arms, "rotor": layout.rotors, "air": int(layout.air)}
        return len(self.axes) * counts[self.per]


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
)  # fmt: skip
"""The table of inputs, in the order of their columns; all that has inputs follows it."""

OF_NAME = {each.name: each for each in INPUTS}

PUSH = ("force", "moment", "bend_moment")
"""Inputs that actuators can give too: those of a controller's push, in order."""

ACTUATORS = tuple(name for each in PUSH for name in OF_NAME[each].components)
"""Names of a push's components, for one section."""

TAU = ("force", "euler_torque", "polar_torque")
"""Inputs that the paper's generalised forces τ, conjugate to q, consist of, in order."""

FIELDS = {"tau": TAU} | {name: (name,) for name in (*PUSH, "tip_wrench", "wind", "rotor_command")}
"""Field of a scenario -> the inputs that it gives."""

CHANNELS = {
    f"{channel}_{axis}": (each.name, len(each.axes) // len(each.channels) * n + k)
    for each in INPUTS
    for n, channel in enumerate(each.channels)
    for k, axis in enumerate(each.axes[: len(each.axes) // len(each.channels)])
}
"""Channel of a design -> input, and which component of it."""


def numbered(names: Iterable[str], sections: int | None) -> tuple[str, ...]:
    """Names of what every section has: by its number, from 1 on, where the arms are a list.

    sections: how many there are; None for the one of an [arm] table, whose names stay as they are.
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
    """Slices of adjacent columns, by name, in the order given."""
    found: dict[str, slice] = {}
    first = 0
    for name, width in widths:
        found[name] = slice(first, first + width)
        first += width
    return found


@dataclass(frozen=True)
class Layout:
    """Slices of the columns of a vehicle, by the number of coordinates of each of its sections.

    Sections go arm by arm, each from its base out. State: position (world), attitude (x y z w, body
    to world), coordinates of the sections (of arcs bend vectors [1/m]), velocity of B's origin
    (world axes), angular velocity (body axes), rates of these coordinates, speeds of the rotors
    over their greatest. A log row is a state, then the paper's coordinates of each section ((κ, ψa)
    of an arc on its signed branch), the Euler angles, and a controller's push. Inputs: those of the
    table INPUTS. Attributes named after a quantity are the slice of its columns. widths: the number
    of coordinates of each section of each arm. rotors: how many there are; air: whether it acts;
    energies: whether terms have a potential energy.
    """

    widths: tuple[tuple[int, ...], ...]
    rotors: int = 0
    air: bool = False
    energies: bool = False

    position = slice(0, 3)
    attitude = slice(3, 7)

    @classmethod
    def of_arcs(cls, *sections: int) -> Layout:
        """Return the layout of arms of so many arcs each."""
        return cls(tuple((arc.COORDINATES,) * count for count in sections))

    @classmethod
    def of_coordinates(cls, count: int) -> Layout:
        """Return that of an arm with so many coordinates q, in air and with a rotor."""
        return cls(((count - len(OF_UAV),),), rotors=1, air=True)

    @cached_property
    def sections(self) -> int:
        """The number of sections of all arms."""
        return len(self.of_section)

    @cached_property
    def arms(self) -> int:
        """The number of arms."""
        return len(self.widths)

    @cached_property
    def bends(self) -> int:
        """The number of coordinates of all sections."""
        return sum(map(sum, self.widths))

    @cached_property
    def of_section(self) -> tuple[slice, ...]:
        """The coordinates of each section among those of all."""
        return _adjacent(width for arm in self.widths for width in arm)

    @cached_property
    def of_arm(self) -> tuple[slice, ...]:
        """The coordinates of each arm among those of all sections."""
        return _adjacent(map(sum, self.widths))

    @cached_property
    def owner(self) -> tuple[int, ...]:
        """The section of each coordinate."""
        widths = [width for arm in self.widths for width in arm]
        return tuple(section for section, width in enumerate(widths) for _ in range(width))

    def per_coordinate(self, of_sections: Any, axis: int = -1) -> np.ndarray:
        """Return what is given of each section along an axis for each of its coordinates."""
        return np.take(np.asarray(of_sections), self.owner, axis)

    @cached_property
    def coordinates(self) -> int:
        """The number of the paper's coordinates, [x y z φ θ ψ] and those of each section."""
        return len(OF_UAV) + self.bends

    @cached_property
    def polar(self) -> slice:
        """The sections' coordinates among the paper's."""
        return slice(len(OF_UAV), self.coordinates)

    def polar_of(self, section: int) -> slice:
        """The coordinates of a section among the paper's."""
        return _within(self.polar, self.of_section[section])

    @cached_property
    def bend(self) -> slice:
        """Coordinates of the sections in a state, of arcs the bend vectors."""
        return _after(self.attitude, self.bends)

    def bend_of(self, section: int) -> slice:
        """Coordinates of a section in a state."""
        return _within(self.bend, self.of_section[section])

    def bend_rate_of(self, section: int) -> slice:
        """Rates of a section's coordinates in a state."""
        return _within(self.bend_rate, self.of_section[section])

    @cached_property
    def velocity(self) -> slice:
        """Velocity of B's origin in a state."""
        return _after(self.bend, 3)

    @cached_property
    def angular_velocity(self) -> slice:
        """Angular velocity in a state."""
        return _after(self.velocity, 3)

    @cached_property
    def bend_rate(self) -> slice:
        """Rates of the sections' coordinates in a state."""
        return _after(self.angular_velocity, self.bends)

    @cached_property
    def rotor_speed(self) -> slice:
        """Speeds of the rotors over their greatest, in a state."""
        return _after(self.bend_rate, self.rotors)

    @cached_property
    def state(self) -> int:
        """Columns of a state."""
        return self.rotor_speed.stop

    @cached_property
    def branch(self) -> slice:
        """The paper's coordinates of each section in a log row."""
        return _after(self.rotor_speed, self.bends)

    @cached_property
    def euler(self) -> slice:
        """Roll, pitch and yaw in a log row, whole turns included, as they are followed."""
        return _after(self.branch, 3)

    @property
    def branch_angles(self) -> int:
        """Number of angles that name the branches of a state: ψa of each section, and three."""
        return self.sections + 3

    @cached_property
    def command(self) -> slice:
        """A controller's push in a log row."""
        return _after(self.euler, self.push.stop)

    @cached_property
    def log(self) -> int:
        """Columns of a log row."""
        return self.command.stop

    @cached_property
    def of_input(self) -> dict[str, slice]:
        """Columns of each input that there is in a row of inputs."""
        there = [each for each in INPUTS if each.width(self) or each.per in ("section", "arm")]
        return columns((each.name, each.width(self)) for each in there)

    @property
    def force(self) -> slice:
        """World force in a row of inputs."""
        return self.of_input["force"]

    @property
    def moment(self) -> slice:
        """Body moment in a row of inputs."""
        return self.of_input["moment"]

    @property
    def bend_moment(self) -> slice:
        """Bend moments in a row of inputs."""
        return self.of_input["bend_moment"]

    @property
    def push(self) -> slice:
        """World force, body moment and bend moments in a row of inputs."""
        return _joined([self.of_input[name] for name in PUSH])

    @property
    def tip_wrench(self) -> slice:
        """Tip wrenches in a row of inputs, arm by arm."""
        return self.of_input["tip_wrench"]

    @cached_property
    def inputs(self) -> int:
        """Columns of a row of inputs."""
        return width_of(self.of_input)

    @property
    def observed(self) -> dict[str, slice]:
        """Columns of what is observed along a log."""
        return observed_columns(self.arms, self.rotors, self.energies)

    def alike(self, names: Iterable[str]) -> list[slice]:
        """Columns, of inputs side by side, that are of one unit and act on one arm or section."""
        found: list[slice] = []
        for name in names:
            of, where = OF_NAME[name], self.of_input[name]
            all_of_it = where.stop - where.start
            width = all_of_it if of.per == "rotor" else len(of.axes) // len(of.units.split(", "))
            first = found[-1].stop if found else 0
            found += [slice(first + n, first + n + width) for n in range(0, all_of_it, width)]
        return found

    def add(self, table: Any, names: Iterable[str], values: Any) -> None:
        """Add values (..., n) of some inputs, side by side, to a table of inputs (..., inputs)."""
        first = 0
        for name in names:
            where = self.of_input[name]
            width = where.stop - where.start
            table[..., where] += values[..., first : first + width]
            first += width


def _after(previous: slice, width: int) -> slice:
    return slice(previous.stop, previous.stop + width)


def _within(whole: slice, part: slice) -> slice:
    """The columns of a part of adjacent ones."""
    return slice(whole.start + part.start, whole.start + part.stop)


def _adjacent(widths: Iterable[int]) -> tuple[slice, ...]:
    """Slices of adjacent columns, in the order given."""
    return tuple(columns((str(n), width) for n, width in enumerate(widths)).values())


def _joined(parts: list[slice]) -> slice:
    """The columns of adjacent parts together."""
    return slice(parts[0].start, parts[-1].stop)


ONE_SECTION = Layout.of_arcs(1)
"""The layout of the paper's vehicle: eight coordinates, 17 numbers in a state."""

OF_ARM = ("tip_position", "tip_attitude", "tip_velocity", "tip_angular_velocity", "base_force",
          "base_moment")  # fmt: skip
"""What is observed of each arm."""


def observed_columns(arms: int, rotors: int = 0, energies: bool = False) -> dict[str, slice]:
    """Columns of what is observed along a log; those of each arm follow one another."""
    widths = [
        ("tip_position", 3), ("tip_attitude", 4), ("tip_velocity", 3), ("tip_angular_velocity", 3),
        ("base_force", 3), ("base_moment", 3), ("kinetic_energy", 1), ("gravity_energy", 1),
        ("elastic_energy", 1), ("linear_momentum", 3), ("angular_momentum", 3),
    ]  # fmt: skip
    widths += [("rotor_thrust", rotors), ("saturation", 1)] if rotors else []
    widths += [("term_energy", 1)] if energies else []
    return columns((name, width * (arms if name in OF_ARM else 1)) for name, width in widths)


TIP_POSE = columns([("position", 3), ("attitude", 4)])
"""Columns of a logged tip: tip frame to world, x y z w."""

DEVIATIONS = ("nrmse_t", "nrmse_r", "rmse_t_m", "rmse_r_rad", "angle_rad")
EULER_DEVIATIONS = ("nrmse_r", "rmse_r_rad")
"""Columns of what two logs of the tip are compared by, as `continuair.compare` names them."""


def watched_columns(points: int) -> dict[str, slice]:
    """Columns of what is watched along a log: the camera, and the image of its feature points."""
    return columns([
        ("camera_position", 3), ("camera_attitude", 4), ("camera_twist", 6),
        ("image", 2 * points), ("depth", points), ("in_view", points),
    ])  # fmt: skip


def setpoint_columns(bends: int) -> dict[str, slice]:
    """Columns of set-points that a law follows; follows: whether the position counts."""
    return columns([
        ("position", 3), ("follows", 1), ("velocity", 3), ("yaw", 1), ("yaw_rate", 1),
        ("bend", bends),
    ])  # fmt: skip


def frame_columns(points: int) -> dict[str, slice]:
    """Columns of a camera's frame on its way to the controller."""
    return columns([("image", 2 * points), ("seen", 2 * points), ("depth", points)])


def summed_columns(points: int) -> dict[str, slice]:
    """Columns behind those of a frame: the image's error summed up over time [s], when that was
    done last [s], and the rate at which it adds to the error [1/s]."""
    frame = [("frame", width_of(frame_columns(points)))]
    return columns([*frame, ("sum", 2 * points), ("time", 1), ("rate", 1)])


MOTION = columns([("position", 3), ("velocity", 3)])
"""Columns of a target's motion: its centroid in world axes."""


def width_of(named: dict[str, slice]) -> int:
    """The number of columns that are named."""
    return max(where.stop for where in named.values())
