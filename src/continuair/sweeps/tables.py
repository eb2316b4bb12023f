"""Tables of a design: fields that all runs of a sweep share, or that vary between runs."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, model_validator

from continuair import checks
from continuair.errors import InputError, nearest, shown
from continuair.flight.prepare import DEFAULT_TOLERANCE, step_for, tolerance_for
from continuair.scenario.letters import LETTERS
from continuair.vehicle.fields import Count, Finite, NotNegative, Part, Positive, Title, Whole
from continuair.vehicle.layout import CHANNELS
from continuair.vehicle.vehicle import Vehicle


def _positive_or_auto(value: Any) -> float | Literal["auto"]:
    """Return a step, or raise ValueError."""
    if isinstance(value, str) and value == "auto":
        return "auto"
    if not checks.is_number(value) or not value > 0.0:
        raise ValueError("must be a finite number above 0, or 'auto'")
    return float(value)


Step = Annotated[float | Literal["auto"], BeforeValidator(_positive_or_auto)]


def _channel(value: Any) -> str:
    """Return a channel, or raise ValueError."""
    if not isinstance(value, str) or value not in CHANNELS:
        raise ValueError(f"must be one of {', '.join(CHANNELS)}")
    return value


Channel = Annotated[str, BeforeValidator(_channel)]


def _letters(value: Any) -> str:
    """Return letters, or raise ValueError."""
    if not isinstance(value, str) or not value or any(x not in LETTERS for x in value.upper()):
        raise ValueError(f"must be text of the letters {', '.join(LETTERS)}")
    return value


Letters = Annotated[str, BeforeValidator(_letters)]


class ScenarioTable(Part):
    """Initial state, excitation and duration of the runs."""

    test: Literal["A", "B", "C", "D"] | None = None
    """open-loop test of the paper, whose inputs are multiplied by amplitude"""

    f1: NotNegative = 1.0
    """the chirp's frequency at 10 s in Test D [Hz]"""

    excitation: Literal["none", "constant", "sine", "chirp"] = "none"
    """instead of a test, a named excitation on one channel"""

    on: Channel = "force_x"
    """the excitation's channel: force and tip in world axes, moment in body axes, bend in those of
    the section's base"""

    amplitude: Finite = 1.0
    """the excitation's amplitude [N, N m or N m²], or the factor on a test's inputs [-]"""

    frequency: NotNegative = 1.0
    """the frequency of a sine, or of a chirp at its start [Hz]"""

    end_frequency: NotNegative = 1.0
    """the frequency of a chirp at the end of the flight [Hz]"""

    phase: Finite = 0.0
    """the phase of a sine or chirp [rad]"""

    lift: Finite = 0.0
    """an upward force on the UAV, in weights of the vehicle [-]"""

    duration: Positive = 1.0
    """the duration of the flight [s]"""

    gravity: NotNegative = 9.81
    """the acceleration of gravity [m/s²]"""

    x: Finite | None = None
    """the initial position [m]; with a target, relative to that of the desired image"""

    y: Finite | None = None
    """the initial position, as x [m]"""

    z: Finite | None = None
    """the initial position, as x [m]"""

    roll: Finite = 0.0
    """the initial roll [rad]; with a target, relative to that of the desired image"""

    pitch: Finite = 0.0
    """the initial pitch, as roll [rad]"""

    yaw: Finite = 0.0
    """the initial yaw, as roll [rad]"""

    kappa: Finite = 0.1
    """the initial bend [1/m]"""

    psi_a: Finite = 0.0
    """the initial direction of the bend [rad]"""

    x_rate: Finite = 0.0
    """the initial velocity [m/s]"""

    y_rate: Finite = 0.0
    """the initial velocity [m/s]"""

    z_rate: Finite = 0.0
    """the initial velocity [m/s]"""

    roll_rate: Finite = 0.0
    """the initial rate of the roll angle [rad/s]"""

    pitch_rate: Finite = 0.0
    """the initial rate of the pitch angle [rad/s]"""

    yaw_rate: Finite = 0.0
    """the initial rate of the yaw angle [rad/s]"""

    kappa_rate: Finite = 0.0
    """the initial rate of the bend [1/(m s)]"""

    psi_a_rate: Finite = 0.0
    """the initial rate of the bend's direction [rad/s]"""

    @model_validator(mode="after")
    def _one_excitation(self) -> ScenarioTable:
        """Raise InputError for both a test and an excitation."""
        if self.test is not None and self.excitation != "none":
            raise InputError(
                "excitation",
                f"is '{self.excitation}' while test is '{self.test}'",
                "keep one of them",
            )
        return self


class ControllerTable(Part):
    """The controller, tuned for the vehicle of each run."""

    law: Literal["servoing", "classic"] = "servoing"
    """the paper's law with designed gains, or classic image-based servoing"""

    gains: Literal["constant", "current"] = "constant"
    """for the desired image, or recomputed for the current image, in the paper's law"""

    bandwidth: Positive = 3.0
    """the bandwidth of the paper's law [rad/s]"""

    damping_ratio: Positive = 1.0
    """the damping ratio of each direction that the image shows, in the paper's law [-]"""

    conditioning: NotNegative = 1.5e-3
    """slows directions that the image hardly shows, in the paper's law [-]"""

    rate_gain: Positive = 1e-4
    """the share of K_d in the weights of the paper's law [s]"""

    sliding: Positive = 1e-6
    """C_s of the paper's law [-]"""

    posture_damping: NotNegative = 0.0
    """a moment against the bend rate, in the paper's law [N m³ s]"""

    integral: NotNegative = 0.0
    """the rate at which the time integral of the error adds to it in the paper's law [1/s]"""

    rate: Positive = 0.5
    """the rate of classic servoing [1/s]"""

    inner: Positive = 6.0
    """the rate of the velocity loop of classic servoing [1/s]"""


class TargetTable(Part):
    """The target: a square whose centre writes letters in the world's xy plane."""

    letter: Letters = "M"
    """the letters to write, of M, R, A, L"""

    height: Positive = 0.8
    """the height of the letters [m]"""

    duration: Positive = 50.0
    """the time that the letters take [s]"""

    side: Positive = 0.5
    """the side of the square [m]"""

    distance: Positive = 2.0
    """the distance of the camera from the square [m]"""


class Base(Part):
    """Fields that all runs of a sweep share."""

    name: Title = "sweep"
    """the name of the sweep"""

    vehicle: str = "paper"
    """a preset's name, or the path of a .toml file, from the design's folder"""

    models: tuple[Literal["decoupled", "independent"], ...] = ("decoupled",)
    """the models to compare with the coupled one"""

    metrics: tuple[str, ...] | None = None
    """the metrics to keep; all that the scenario has by default"""

    method: Literal["Tsit5", "RK4", "implicit"] = "Tsit5"
    """the integration method: steps controlled by their error, or of one length"""

    rtol: Positive = DEFAULT_TOLERANCE
    """the error tolerance of a step of Tsit5, in natural units [-]"""

    step: Step | None = None
    """the step of the other methods [s], or 'auto'"""

    check: bool = False
    """whether Tsit5 runs twice and keeps error_estimate, in arm lengths"""

    sample: Positive = 2e-3
    """the time between the samples that are compared [s]"""

    settle: NotNegative = 0.0
    """the time at the start that metrics in pixels exclude [s]"""

    seed: Whole = 0
    """the seed of sampled variables and of the camera's noise"""

    chunk: Count | None = None
    """the number of runs in a unit of work, chosen by default"""

    scenario: ScenarioTable = ScenarioTable()
    """the scenario, a table ([scenario])"""

    controller: ControllerTable | None = None
    """the controller, a table ([controller])"""

    target: TargetTable | None = None
    """the target of the camera, a table ([target])"""

    @model_validator(mode="after")
    def _steps_together(self) -> Base:
        """Raise InputError for options that do not fit the method."""
        fixed = tolerance_for(self.method, self.rtol) is None
        step_for(self.method, self.step)
        if fixed and self.check:
            raise InputError(
                "check", f"is true, but method is {shown(self.method)}", "omit one of them"
            )
        return self

    @model_validator(mode="after")
    def _closed_together(self) -> Base:
        """Raise InputError for a controller without a target, or the reverse."""
        if (self.controller is None) != (self.target is None):
            absent = "controller" if self.controller is None else "target"
            raise InputError(absent, "is missing, but a closed loop needs both", f"add [{absent}]")
        return self


TABLES: dict[str, type[Part]] = {
    "scenario": ScenarioTable,
    "controller": ControllerTable,
    "target": TargetTable,
}


def changed(table: Any, fields: dict[str, Any]) -> Any:
    """Return a copy of a table, or of a vehicle, with some fields changed; raises InputError."""
    if isinstance(table, Vehicle):
        return table.replace(fields)
    return type(table)(**{name: getattr(table, name) for name in type(table).model_fields} | fields)


def check_field(field: str, base: Base) -> None:
    """Raise InputError unless a table of the design has the field, such as `scenario.x`."""
    table, _, name = field.partition(".")
    if table not in TABLES:
        remedy = f"start it with vehicle, {', '.join(TABLES)}, as in vehicle.arm.radius"
        if field in ("model", "models"):
            remedy = "list the models in models: each run flies all of them"
        raise InputError(f"{field or repr(field)}", "is not a field that can vary", remedy)
    known = [f"{table}.{other}" for other in TABLES[table].model_fields]
    if field not in known:
        raise InputError(field, "is not a known field", nearest(field, known))
    if getattr(base, table) is None:
        raise InputError(field, f"varies, but the design has no [{table}]", "add that table")
