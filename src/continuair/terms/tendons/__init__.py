"""Tendons: tensions along paths beside the backbone, with friction, slack, and motors that lag.

With λ the length of a tendon in a stretch, tensions T act on the coordinates q as -T ∂λ/∂q, after
F. Renda et al., IEEE RA-L 5(3), 2020. Nothing acts on the UAV: motors and guides are internal.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types
from continuair.kernels.device import Device
from continuair.kernels.term_sum import Acting
from continuair.terms.tendons.route import NUMBERS, Route
from continuair.terms.tendons.tension import observer_of, tendon_code
from continuair.terms.term import Term
from continuair.typing import Array
from continuair.vehicle.layout import TENDON_VARIABLES
from continuair.vehicle.runs import per_run
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.tendon_allocation import lifts_of, pulls_of, shares_of
from continuair.vehicle.tendon_path import (
    GEOMETRY,
    highest_order,
    pieces,
    straight_lengths,
    stretches,
)
from continuair.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Tendons(Term):
    """Tendons of all arms.

    Parameters
    ----------
    routes : tuple of Route
        Paths of the groups, arm by arm.
    """

    field: ClassVar[str] = "arm.tendon"
    flown: ClassVar[tuple[str, ...]] = ("tendon", "tendon_share", "tendon_lift", "tendon_bent")

    routes: tuple[Route, ...]

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return the term if an arm has tendons, else None.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle, plain or batched.

        Returns
        -------
        Tendons or None
            The term.
        """
        found, first = [], 0
        for arm in vehicle.arms:
            for group in arm.tendon:
                parts = stretches(group, arm)
                found.append(
                    Route(
                        tuple(first + part.section for part in parts),
                        tuple(part.pieces for part in parts),
                        highest_order(group, arm),
                        group.count,
                        straight=group.guides == "disks",
                        by_length=group.command == "length",
                        lags=group.lags,
                        prompt=bool((np.asarray(group.lag) == 0.0).any()),
                        damps=bool(np.any(group.damping)),
                        rubs=group.rubs,
                        turns=group.turns,
                    )
                )
            first += len(arm.section)
        return cls(tuple(found)) if found else None

    @property
    def stiff(self) -> bool:  # type: ignore[override]
        """Return whether tendons are faster than their arms: by lengths, friction or lag."""
        return any(each.by_length or each.rubs or each.lags for each in self.routes)

    @property
    def kinked(self) -> bool:  # type: ignore[override]
        """Return whether tendons can be slack, or stick and slip."""
        return any(each.by_length or each.rubs for each in self.routes)

    @property
    def states(self) -> dict[str, int]:
        """Return the states of motors, and of the friction before each stretch."""
        motors, slips = (sum(getattr(each, name) for each in self.routes)
                         for name in ("motors", "slips"))  # fmt: skip
        return {"tendon_motor": motors, "tendon_slip": slips}

    def state_units(self, vehicle: Vehicle, runs: int) -> dict[str, Array]:
        """Return what bends the softest section by a radian, by tension or by length.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, plain or batched.
        runs : int
            Number of runs.

        Returns
        -------
        dict of str to ndarray
            Tensions [N] or lengths [m] of motors, and deflections of guides [m] (runs, n).
        """
        motors, slips = [np.zeros((runs, 0))], [np.zeros((runs, 0))]
        units = self._slip_units(vehicle, runs)
        for route, (_, group), unit in zip(self.routes, groups_of(vehicle), units, strict=True):
            held = per_run(group.friction_stiffness, runs)
            motor = per_run(group.offset, runs, 2)[:, 0] if route.by_length else unit * held
            motors.append(np.repeat(motor[:, None], route.motors, axis=1))
            slips.append(np.repeat(unit[:, None], route.slips, axis=1))
        return {"tendon_motor": np.hstack(motors), "tendon_slip": np.hstack(slips)}

    def _slip_units(self, vehicle: Vehicle, runs: int) -> list[Array]:
        """Return deflections of guides (runs,) [m] whose force bends by a radian, per group."""
        found = []
        for arm, group in groups_of(vehicle):
            sections = [per_run(part.bending_stiffness / part.length, runs) for part in arm.section]
            offset = per_run(group.offset, runs, 2)[:, 0]
            force = np.min(sections, axis=0) / offset
            found.append(force / per_run(group.friction_stiffness, runs))
        return found

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of tendons."""
        return {"tendon": sum(each.tendons for each in self.routes)}

    @property
    def variables(self) -> dict[str, int]:
        """Return the variables of each tendon."""
        return dict.fromkeys(TENDON_VARIABLES, self.counts["tendon"])

    @property
    def rows(self) -> int:
        """Return the number of pieces of all tendons."""
        return sum(each.rows for each in self.routes)

    @property
    def columns(self) -> int:
        """Return the numbers of a piece."""
        return GEOMETRY + 2 * max(each.highest for each in self.routes)

    def table(self, vehicle: Vehicle, runs: int, at: slice) -> Array:
        """Return the pieces of all tendons.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, plain or batched.
        runs : int
            Number of runs.
        at : slice
            The requested runs.

        Returns
        -------
        ndarray, shape (n, rows, columns)
            The pieces, group by group and tendon by tendon.
        """
        found = []
        for arm, group in groups_of(vehicle):
            each = pieces(group, arm, runs)[at]
            each = each.reshape(len(each), -1, each.shape[-1])
            missing = self.columns - each.shape[-1]
            found.append(np.pad(each, ((0, 0), (0, 0), (0, missing))))
        return np.concatenate(found, axis=1)

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return the fields ``tendon``, NUMBERS per group, and three of how tendons share moments.

        Parameters
        ----------
        tree : Tree
            The arms.

        Returns
        -------
        dict of str to tuple of int
            Shape of each field. ``tendon_share`` maps bend moments to tensions [1/m²], and tensions
            ``tendon_lift`` bend no arm. ``tendon_bent`` are those that bend it as pretensions do.
        """
        return {
            "tendon": (len(self.routes), len(NUMBERS)),
            "tendon_share": (self.counts["tendon"], tree.layout.bends),
            "tendon_lift": (self.counts["tendon"],),
            "tendon_bent": (self.counts["tendon"],),
        }

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill the fields of `parameters`.

        Parameters
        ----------
        plants : structured ndarray, shape (runs,)
            Parameters of the vehicles, changed in place.
        vehicle : Vehicle
            The vehicle.
        """
        runs = len(plants)
        units = self._slip_units(vehicle, runs)
        plants["tendon_share"] = shares_of(vehicle, runs)
        plants["tendon_lift"] = lifts_of(vehicle, runs)
        held = [
            np.repeat(per_run(group.pretension, runs)[:, None], group.count, axis=1)
            for _, group in groups_of(vehicle)
        ]
        moments = pulls_of(vehicle, runs) @ np.hstack(held)[..., None]
        plants["tendon_bent"] = (plants["tendon_share"] @ moments)[..., 0]
        for index, (arm, group) in enumerate(groups_of(vehicle)):
            straight = straight_lengths(pieces(group, arm, runs))[:, 0]
            limits, strokes = (
                per_run(group.tension_limits, runs, 2),
                per_run(group.strokes, runs, 2),
            )
            rest = {
                "stiffness": 1.0 if group.stiffness is None else group.stiffness,
                "rate": np.inf if group.rate is None else group.rate,
                "least": limits[:, 0], "most": limits[:, 1],
                "least_taken": strokes[:, 0], "most_taken": strokes[:, 1],
                "holding": group.friction_stiffness, "slip_unit": units[index],
                "straight": straight,
            }  # fmt: skip
            for column, name in enumerate(NUMBERS):
                value = rest[name] if name in rest else getattr(group, name)
                plants["tendon"][:, index, column] = per_run(value, runs)

    def device(self, code: Device) -> Acting:
        """Return the device functions of the tendons.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on the bends, rates of motors and of slips, and the step memory of friction.
        """
        found = tendon_code(code.numbers, code.tree, self)
        with_states, rubs = any(self.states.values()), any(each.rubs for each in self.routes)
        return Acting(
            on_uav=found.load,
            rates=found.rates if with_states else None,
            misdirected=found.misdirected if rubs else None,
            settled=found.settled if rubs else None,
            excess=found.excess,
        )

    def left(self, numbers: Numbers, tree: Tree) -> wp.Function:
        """Return the device function that removes the bend moments from an actuator wrench.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Function
            ``straight(push) -> Push``. Tendons exert the bend moments that a controller asks for.
        """
        types = device_types(numbers, tree)
        Push, Bends = types.Push, types.Bends
        push_of, force_of, moment_of = types.push_of, types.force_of, types.moment_of

        @wp.func
        def straight(push: Push):
            return push_of(force_of(push), moment_of(push), Bends())

        return straight

    def observer(self, numbers: Numbers, tree: Tree) -> wp.Kernel:
        """Return the kernel of the variables of tendons along a log.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Kernel
            The kernel, which writes the columns of TENDON_VARIABLES.
        """
        return observer_of(numbers, tree, self)


def groups_of(vehicle: Vehicle) -> list[tuple[Any, Tendon]]:
    """Return the groups of tendons of a vehicle, each with its arm, in order."""
    return [(arm, group) for arm in vehicle.arms for group in arm.tendon]
