"""Where each quantity sits in states, inputs and logs, for any number of bending sections."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class Layout:
    """Slices of the columns of a vehicle whose arm has `sections` sections of constant curvature.

    State: position (world), attitude (x y z w, body to world), bend vectors [1/m], velocity of B's
    origin (world axes), angular velocity (body axes), bend rates. A log row is a state, then
    (κ, ψa) of each section on its signed branch, then a controller's push. Inputs: a push (world
    force, body moment, bend moments); Euler torques and (Q_κ, Q_ψa); tip wrench (world axes).
    """

    sections: int

    position = slice(0, 3)
    attitude = slice(3, 7)

    @cached_property
    def bends(self) -> int:
        """The number of bend coordinates."""
        return 2 * self.sections

    @cached_property
    def coordinates(self) -> int:
        """The number of the paper's coordinates, [x y z φ θ ψ] and (κ, ψa) of each section."""
        return 6 + self.bends

    @cached_property
    def bend(self) -> slice:
        """Bend vectors in a state."""
        return slice(7, 7 + self.bends)

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
        """Bend rates in a state."""
        return _after(self.angular_velocity, self.bends)

    @cached_property
    def state(self) -> int:
        """Columns of a state."""
        return self.bend_rate.stop

    @cached_property
    def branch(self) -> slice:
        """(κ, ψa) of each section in a log row."""
        return _after(self.bend_rate, self.bends)

    @cached_property
    def command(self) -> slice:
        """A controller's push in a log row."""
        return _after(self.branch, self.coordinates)

    @cached_property
    def log(self) -> int:
        """Columns of a log row."""
        return self.command.stop

    force = slice(0, 3)
    moment = slice(3, 6)

    @cached_property
    def bend_moment(self) -> slice:
        """Bend moments in a row of inputs."""
        return _after(self.moment, self.bends)

    @cached_property
    def push(self) -> slice:
        """World force, body moment and bend moments in a row of inputs."""
        return slice(0, self.bend_moment.stop)

    @cached_property
    def euler_and_polar(self) -> slice:
        """Euler torques, then (Q_κ, Q_ψa) of each section, in a row of inputs."""
        return _after(self.bend_moment, 3 + self.bends)

    @cached_property
    def tip_wrench(self) -> slice:
        """Tip wrench in a row of inputs."""
        return _after(self.euler_and_polar, 6)

    @cached_property
    def inputs(self) -> int:
        """Columns of a row of inputs."""
        return self.tip_wrench.stop


def _after(previous: slice, width: int) -> slice:
    return slice(previous.stop, previous.stop + width)


ONE_SECTION = Layout(sections=1)
"""The layout of the paper's vehicle: eight coordinates, 17 numbers in a state."""
