"""The vehicle: a multirotor UAV with continuum arms, and a camera at the tip of one.

SI units and radians. Body axes: x forward, y left, z up, at the UAV's centre of mass. All classes
are immutable and hold plain numbers and tuples. In a *batched* vehicle, made by `Vehicle.replace`,
fields that vary are NumPy arrays with a leading dimension (runs).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self, cast

import numpy as np
from pydantic import Field, SkipValidation, field_validator, model_validator

from continuair import checks
from continuair.errors import CannotHover, InputError, nearest, shown
from continuair.files import Presets
from continuair.typing import Array
from continuair.vehicle import replacing
from continuair.vehicle import runs as batch
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.camera import Camera
from continuair.vehicle.changes import implied
from continuair.vehicle.deviations import split_deviations
from continuair.vehicle.effect import Effect, check_effects
from continuair.vehicle.fields import Part, Title
from continuair.vehicle.layout import Layout
from continuair.vehicle.members import members
from continuair.vehicle.section import Section
from continuair.vehicle.slips import slips
from continuair.vehicle.uav import Uav

PAPER_VEHICLE = "paper"
"""Name of the preset whose results are compared with the numbers printed in the paper."""

BENCH = "bench"
"""Table of a vehicle's file that says how its arm was measured; it is no part of the vehicle."""

UNCERTAINTY = "uncertainty"
"""Table of a vehicle's file that says how well its fields are known; it is no part either."""

_GRAVITY = 9.81

_PRESETS = Presets("vehicle", Path(__file__).parents[1] / "presets")


class Vehicle(Part):
    """Aerial continuum manipulator: UAV, arms and camera.

    A vehicle describes one run, or, if made by `replace` with arrays, a batch of runs. It is
    immutable. `load_vehicle` reads one from a preset or a file.
    """

    refused: ClassVar[Mapping[str, str]] = {
        "tendons": "is not a known field; write [[arm.tendon]], below the [arm] that they bend"
    }

    name: Title
    """the name of the vehicle, for titles and provenance"""

    uav: Uav
    """the UAV's parameters, a table ([uav])"""

    arm_tables: Section | tuple[ArmChain, ...] = Field(default=(), alias="arm")
    """the arm's parameters, a table ([arm]), or those of several arms or sections ([[arm]]);
    without it the vehicle is a multirotor without arm"""

    camera: Camera = Camera()
    """the camera's parameters, a table ([camera])"""

    terms: SkipValidation[tuple[Effect, ...]] = ()
    """user-defined forces, a tuple of instances of subclasses of continuair.Term"""

    @field_validator("uav", "arm_tables", "camera", "terms", mode="before")
    @classmethod
    def _one_run(cls, value: object) -> object:
        if batch.count(tuple(value) if isinstance(value, list) else value) is not None:
            raise ValueError("must be of one run (a batched vehicle is made by vehicle.replace)")
        return value

    @field_validator("terms", mode="before")
    @classmethod
    def _are_effects(cls, value: object) -> tuple[Effect, ...]:
        return check_effects(value)

    @field_validator("arm_tables", mode="before")
    @classmethod
    def _table_or_list(cls, value: object) -> Section | tuple[ArmChain, ...]:
        if isinstance(value, (list, tuple)):
            return members(ArmChain, value, "arm") if value else ()
        section = Section(**value) if isinstance(value, Mapping) else value
        if not isinstance(section, Section):
            raise ValueError("must be a table of fields, or a list of them")
        if section.name:
            raise InputError(
                "name",
                f"is {section.name!r}, but only arms of a list have names",
                "leave it out, or write [[arm]]",
            )
        return section

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_mount()
        self._check_lift()
        names = [arm.name for arm in self.arms]
        valid = ["", *names, *(str(index) for index in range(len(names)))]
        if not self.arms and self.camera.arm:
            raise InputError(
                "camera.arm",
                f"is {self.camera.arm!r}, but the vehicle has no arm",
                "leave it out to put the camera at uav.mount",
            )
        if self.camera.arm not in valid:
            raise InputError(
                "camera.arm",
                f"is {self.camera.arm!r}, but no arm has that name",
                nearest(self.camera.arm, names),
            )
        self._check_camera()
        return self

    def _check_camera(self) -> None:
        """Raise InputError for a tip frame that spins with a bend the arm of the camera has not."""
        if self.camera.tip_frame != "frenet" or not self.arms:
            return
        if not all(section.polar for section in self.arms[self.camera_arm].section):
            raise InputError(
                "camera.tip_frame",
                "is 'frenet', which spins with a bend that is the same along a section",
                "give 'untwisted'",
            )

    def _check_mount(self) -> None:
        if self.arms and self.has_arm_list and np.any(self.uav.mount):
            raise InputError(
                "uav.mount",
                f"is {shown(self.uav.mount)}, but each arm of a list has its own mount",
                "give the mount in each [[arm]] instead",
            )

    def _check_lift(self) -> None:
        rotors = self.uav.rotors
        if rotors is None:
            return
        lift = rotors.greatest_lift
        weight = np.asarray(self.mass) * _GRAVITY
        heavy, lift, weight = (
            np.atleast_1d(x) for x in np.broadcast_arrays(lift <= weight, lift, weight)
        )
        if heavy.any():
            run = int(np.argmax(heavy))
            if likely := slips(self if self.runs is None else self.select(run)):
                heavier = CannotHover(likely[0].field, likely[0].problem, likely[0].remedy)
            else:
                limits = rotors.limits[run] if rotors.limits.ndim == 3 else rotors.limits
                weakest = int(np.argmin(limits[:, 1]))
                heavier = CannotHover(
                    rotors.limits_field(weakest),
                    (
                        f"is {shown(tuple(limits[weakest].tolist()))}: {rotors.count} rotors lift "
                        f"{lift[run]:.4g} N, but the vehicle weighs {weight[run]:.4g} N"
                    ),
                    "increase the thrust",
                )
            raise heavier.located(f"run {run}") if len(heavy) > 1 else heavier

    @property
    def has_arm_list(self) -> bool:
        """Return whether the arms are a list ([[arm]]), not one table ([arm])."""
        return isinstance(self.arm_tables, tuple)

    @property
    def arm(self) -> Section:
        """Return the section of an [arm] table; raise InputError if the arms are a list."""
        check_has_arms(self)
        if isinstance(self.arm_tables, tuple):
            raise InputError(
                "vehicle",
                (
                    f"{shown(self.name)} has [[arm]], but this needs the single section of "
                    "an [arm] table"
                ),
                "use a vehicle with [arm]",
            )
        return self.arm_tables

    @cached_property
    def arms(self) -> tuple[ArmChain, ...]:
        """Return the arms; that of an [arm] table is named "arm", and its section "0"."""
        if isinstance(self.arm_tables, tuple):
            return self.arm_tables
        section = self.arm_tables.having(name="0")
        arm = ArmChain.model_construct(
            name="arm", mount=self.uav.mount, section=(section,), tendon=section.tendon
        )
        return (arm,)

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the number of sections of each arm."""
        return tuple(len(arm.section) for arm in self.arms)

    @property
    def sections(self) -> int:
        """Return the number of sections of all arms."""
        return sum(self.shape)

    @cached_property
    def layout(self) -> Layout:
        """Return the columns of coordinates, of states without rotor speeds, and of inputs."""
        widths = tuple(tuple(part.coordinates for part in arm.section) for arm in self.arms)
        parts = enumerate(part for arm in self.arms for part in arm.section)
        return Layout(widths, strains=tuple(n for n, part in parts if not part.polar))

    @property
    def tendons(self) -> int:
        """Return the number of tendons of all arms."""
        return sum(group.count for arm in self.arms for group in arm.tendon)

    @property
    def limited(self) -> tuple[str, ...]:
        """Return which actuators have limits that commands may exceed: rotors, tendons."""
        there = {"rotors": self.uav.rotors is not None, "tendons": self.tendons > 0}
        return tuple(name for name, has in there.items() if has)

    @property
    def is_one_arc(self) -> bool:
        """Return whether the arm is the section of an [arm] table, of constant curvature."""
        return not self.has_arm_list and not self.layout.strains

    @property
    def camera_arm(self) -> int:
        """Return the index of the arm that carries the camera, 0 for a vehicle without arms."""
        names = [arm.name for arm in self.arms]
        given = self.camera.arm or "0"
        return names.index(given) if given in names else int(given)

    @property
    def mass(self) -> float:
        """Return the mass of UAV and arms [kg], an array (runs,) in a batched vehicle."""
        return self.uav.mass + sum(arm.mass for arm in self.arms)

    @property
    def kappa_s(self) -> Array:
        """Return κ_s of all sections (runs or 1, sections) [1/m]; Remark 1, Amiri et al. (2026)."""
        if not self.arms:
            return np.zeros((self.runs or 1, 0))
        each = np.broadcast_arrays(*(part.kappa_s for arm in self.arms for part in arm.section))
        return np.atleast_2d(np.stack(each, axis=-1))

    @property
    def reach(self) -> float | Array:
        """Return the length of the longest arm [m], an array (runs,) in a batched vehicle.

        Without arms it is the largest distance of a rotor from the origin, or else 1 m.
        """
        if not self.arms:
            longest: float = 1.0 if self.uav.rotors is None else self.uav.rotors.longest_lever
            return longest
        lengths = [sum(part.length for part in arm.section) for arm in self.arms]
        found: float | Array = np.max(np.stack(np.broadcast_arrays(*lengths)), axis=0)
        return found

    @property
    def runs(self) -> int | None:
        """Return the number of runs of a batched vehicle, None for a plain one."""
        return batch.count(self)

    def replace(self, changes: Mapping[str, object]) -> Vehicle:
        """Return a copy with some fields changed.

        Parameters
        ----------
        changes : mapping of str to object
            Dotted names of fields, and their values, as in ``{"arm.radius": 0.01, "uav.mass": 3}``.
            Entries of lists go by index or name: ``"arm.disks.0.mass"``,
            ``"arm.left.section.1.length"``. A value with one more leading dimension than its field
            is an array over runs, and makes the copy a batch.

        Returns
        -------
        Vehicle
            The changed copy, batched if a value is an array over runs.

        Raises
        ------
        InputError
            If a name is unknown, arrays over runs differ in length, or a run is not valid. The
            message names the run.

        Notes
        -----
        Disks keep their relative position in a section whose length changes, unless their positions
        are given too. A bending stiffness replaces Young's modulus, a mass per length the density,
        and a damping the damping ratio, and conversely. An inertia of shape (3, 3) is one matrix;
        give three runs of diagonals as (3, 3, 3).

        Examples
        --------
        >>> vehicle = ca.load_vehicle("paper")
        >>> vehicle.replace({"uav.mass": 3.0}).uav.mass
        3.0
        >>> vehicle.replace({"arm.radius": [0.004, 0.005]}).runs
        2
        """
        if not isinstance(changes, Mapping):
            text = "must be a mapping such as {'arm.radius': 0.01}"
            raise InputError(
                "changes", f"is {shown(changes)}, but {text}", "give the fields to change"
            )
        self._check_kinds(changes)
        self._check_shared(changes)
        found = replacing.replace(self, changes, implied(self, changes))
        found._check_camera()
        found._check_mount()
        found._check_lift()
        return found

    def _check_kinds(self, changes: Mapping[str, object]) -> None:
        """Raise InputError for a change of an arm with sections other than arcs."""
        sections = [section for arm in self.arms for section in arm.section]
        other = [type(each).__name__ for each in sections if type(each) is not Section]
        if other and any(str(path).partition(".")[0] == "arm" for path in changes):
            raise InputError(
                "arm",
                f"has a section of the kind {other[0]}, which replace does not support",
                "build a new vehicle with continuair.Vehicle(...)",
            )

    @staticmethod
    def _check_shared(changes: Mapping[str, object]) -> None:
        """Raise InputError for an array over runs of what gives arms their coordinates."""
        for path, value in changes.items():
            names = str(path).split(".")
            if ("strain" in names or names[-1] == "nodes") and np.ndim(cast(Any, value)) > 0:
                raise InputError(
                    str(path), f"is {shown(value)}, but must be the same in all runs",
                    "give one number, and a vehicle for each other",
                )  # fmt: skip

    def select(self, run: int) -> Vehicle:
        """Return the vehicle of one run.

        Parameters
        ----------
        run : int
            Index of the run, from 0. A plain vehicle is the same in every run.

        Returns
        -------
        Vehicle
            The plain vehicle.

        Raises
        ------
        InputError
            If the batch has no such run.
        """
        if self.runs is None:
            return self
        if not checks.is_whole(run) or not 0 <= run < self.runs:
            valid = f"give a whole number from 0 to {self.runs - 1}"
            raise InputError("run", f"is {shown(run)}, but the vehicle has {self.runs} runs", valid)
        selected: Vehicle = batch.pick(self, int(run))
        return selected

    def describe(self) -> dict[str, object]:
        """Return all parameters as nested dicts and lists.

        Returns
        -------
        dict of str to object
            The fields by name, as values for JSON; arrays over runs are lists. ``terms`` is left
            out if there are none.
        """
        description: dict[str, object] = batch.plain(self, self.runs)
        if not self.terms:
            del description["terms"]
        return description


def preset_names() -> tuple[str, ...]:
    """Return the names of the preset vehicles.

    Returns
    -------
    tuple of str
        Names that `load_vehicle` accepts, in alphabetical order.
    """
    return _PRESETS.names()


def preset_text(name: str) -> str:
    """Return the text of a preset's file, by one of `preset_names`."""
    return (_PRESETS.folder / f"{name}.toml").read_text(encoding="utf-8")


def is_paper(vehicle: Vehicle) -> bool:
    """Return whether a vehicle equals the preset `paper`.

    Parameters
    ----------
    vehicle : Vehicle
        Any vehicle.

    Returns
    -------
    bool
        True for the unchanged preset, with whose results the paper's numbers are compared.
    """
    named = vehicle.name == PAPER_VEHICLE
    return named and vehicle.describe() == load_vehicle(PAPER_VEHICLE).describe()


def load_vehicle(name_or_path: str | os.PathLike[str]) -> Vehicle:
    """Return a preset by name, or the vehicle of a TOML file.

    Parameters
    ----------
    name_or_path : str or path-like
        One of `preset_names`, or the path of a file.

    Returns
    -------
    Vehicle
        The vehicle of one run.

    Raises
    ------
    InputError
        If there is no such preset or file, or the file does not describe a valid vehicle.

    Examples
    --------
    >>> f"{ca.load_vehicle('paper').mass:.3f} kg"
    '2.617 kg'
    """
    return read_vehicle(name_or_path)[0]


def read_table(name_or_path: str | os.PathLike[str], name: str) -> tuple[object, str]:
    """Return a table of a vehicle's file that is no field of the vehicle, and the file's name.

    None if there is no such table. Raises InputError as `load_vehicle` if there is no such file.
    """
    file, fields = _PRESETS.read(name_or_path)
    return fields.get(name), f"{file}"


def read_vehicle(
    name_or_path: str | os.PathLike[str],
) -> tuple[Vehicle, dict[str, object], dict[str, Any], str]:
    """Return a file's vehicle, the standard deviations of fields, its `[uncertainty]`, its name.

    Raises InputError as `load_vehicle`.
    """
    file, fields = _PRESETS.read(name_or_path)
    fields.pop(BENCH, None)
    table = fields.pop(UNCERTAINTY, {})
    fields, deviations = split_deviations(fields)
    try:
        if not isinstance(table, dict):
            raise InputError(UNCERTAINTY, f"is {shown(table)}", "write it as a table")
        return Vehicle(**fields), deviations, table, f"{file}"
    except InputError as error:
        raise error.located(f"{file}") from None


def vehicle_of_run(description: Mapping[str, object], run: int | None) -> Vehicle:
    """Return the vehicle of a description by `Vehicle.describe`; of a batch, that of one run.

    Terms are left out: they are code, which a description does not contain, and they do not change
    the shape of the vehicle. Other input raises ValueError or any other exception.

    Parameters
    ----------
    description : mapping
        Of `Vehicle.describe`.
    run : int or None
        Index of the run of a batch; None for one vehicle.

    Returns
    -------
    Vehicle
        The vehicle.
    """
    description = {name: value for name, value in description.items() if name != "terms"}
    if run is not None:
        description = replacing.of_run(Vehicle, description, run)
    return Vehicle(**description)


def check_vehicle(value: object) -> Vehicle:
    """Return a vehicle, plain or batched, or raise InputError for anything else."""
    if not isinstance(value, Vehicle):
        raise InputError("vehicle", f"is {shown(value)}", "load one with continuair.load_vehicle")
    return value


def check_arcs(vehicle: Vehicle) -> None:
    """Raise InputError for a vehicle with a section whose strain varies.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle, plain or batched.
    """
    for arm in check_vehicle(vehicle).arms:
        for section in arm.section:
            if not section.polar:
                raise InputError(
                    "strain",
                    f"of section {arm.name}.{section.name} varies, which this cannot use",
                    "give the section bending = 0; the page on strain lists what can",
                )


def check_has_arms(vehicle: Vehicle) -> None:
    """Raise InputError for a vehicle without arms.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle, plain or batched.
    """
    if not vehicle.arms:
        raise InputError(
            "vehicle",
            f"{shown(vehicle.name)} has no arm, but this needs one",
            "give it a table [arm]",
        )


def check_one_section(value: object) -> Vehicle:
    """Return a vehicle of one run whose single arm is the section of an [arm] table.

    Parameters
    ----------
    value : object
        Argument to check.

    Returns
    -------
    Vehicle
        The same vehicle, as studies of the paper require it.

    Raises
    ------
    InputError
        If the value is anything else.
    """
    vehicle = check_single_vehicle(value)
    _ = vehicle.arm
    return vehicle


def as_rod(vehicle: Vehicle) -> Vehicle:
    """Return the same vehicle, its section given by radius, density and Young's modulus.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle with the single section of an [arm] table.

    Returns
    -------
    Vehicle
        The vehicle without bending stiffness and mass per length, so that both change with the
        radius and the material, as in the paper.

    Raises
    ------
    InputError
        If the section has no radius.
    """
    arm = vehicle.arm
    changes: dict[str, Any] = {}
    if arm.given_radius is None:
        raise InputError(
            "arm.radius",
            "is missing, but the paper's sentences need it",
            "give the radius of a round, solid backbone [m]",
        )
    if arm.given_density is None:
        changes["arm.density"] = arm.density
    if arm.given_youngs_modulus is None:
        changes["arm.youngs_modulus"] = arm.youngs_modulus
    return vehicle.replace(changes)


def check_single_vehicle(value: object, strain: bool = False) -> Vehicle:
    """Return a vehicle that must be of one run.

    Parameters
    ----------
    value : object
        Argument to check.
    strain : bool, default False
        Whether the caller uses sections of any kind.

    Returns
    -------
    Vehicle
        The same vehicle.

    Raises
    ------
    InputError
        If the value is a batch, not a vehicle, or has a section whose strain varies and `strain` is
        False.
    """
    vehicle = check_vehicle(value)
    if not strain:
        check_arcs(vehicle)
    if vehicle.runs is not None:
        raise InputError(
            "vehicle",
            f"{shown(vehicle.name)} holds {vehicle.runs} runs, but must be of one run",
            "choose one with vehicle.select(run)",
        )
    return vehicle
