"""Flights of a letter by laws with a plant-model mismatch."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from amiri2026.robustness.mistakes import MISTAKES
from continuair import Controller, Vehicle, simulate
from continuair.analysis import feature_rms
from continuair.errors import CannotHover, InputError
from continuair.kernels import OK
from continuair.scenario import SETTINGS, task
from continuair.typing import Model
from continuair.warning import untold

Array = np.ndarray

LETTER, SETTING = "M", SETTINGS["nominal"]

DRAWS = 4
"""Of a camera's noise, of which the worst counts."""

GROUNDED = -1
"""Status of a vehicle that its rotors do not lift."""

_SAMPLE = 0.01
_SATURATION = "largest_saturation"


@dataclass(frozen=True)
class Wrong:
    """A mistake by its name, its value and one of its ways; the name None: there is none."""

    name: str | None
    value: float = 0.0
    way: str = ""

    def changes(self, nominal: Vehicle) -> dict[str, Any]:
        """Return the changed values of the simulated vehicle."""
        if self.name is None:
            return {}
        mistake = MISTAKES[self.name]
        return mistake.vehicle(nominal, self.value, mistake.ways[self.way])

    def acting(self) -> dict[str, Any]:
        """Return the forces that act on it."""
        if self.name is None:
            return {}
        mistake = MISTAKES[self.name]
        return mistake.scenario(self.value, mistake.ways[self.way])

    @property
    def alone(self) -> bool:
        """Whether it flies by itself."""
        return self.name is not None and MISTAKES[self.name].alone


def groups(wrong: list[Wrong]) -> list[list[Wrong]]:
    """Return mismatches of one batch."""
    together = [each for each in wrong if not each.alone]
    return [*([together] if together else []), *([each] for each in wrong if each.alone)]


def fly(
    nominal: Vehicle, law: Controller, model: Model, wrong: list[Wrong]
) -> list[dict[str, Any]]:
    """Simulate a letter under each mismatch of a batch.

    Returns status, end [s], error_estimate, and RMS and largest feature error [px], NaN of a flight
    that ended early; with rotors, the largest saturation. With camera noise it returns the worst of
    DRAWS. A vehicle that its rotors cannot lift is GROUNDED; raises InputError for others that
    cannot be simulated.
    """
    try:
        return _worst_draws(nominal, law, model, wrong)
    except InputError as error:
        if len(wrong) > 1:
            return [fly(nominal, law, model, [each])[0] for each in wrong]
        (one,) = wrong
        if one.name is None:
            raise
        if not isinstance(error, CannotHover):
            raise InputError(
                "mistakes",
                f"holds {one.name}, which is not flown: {str(error).rstrip('.')}",
                "leave it out, or give another vehicle",
            ) from None
    lost = {"rms_px": np.nan, "max_px": np.nan}
    if nominal.uav.rotors is not None:
        lost[_SATURATION] = np.nan
    return [{"status": GROUNDED, "end_time_s": 0.0, "error_estimate": 0.0, **lost}]


def harm(flight: dict[str, Any]) -> tuple[bool, float]:
    """Return a ranking of flights: failed ones by their end, the others by their error."""
    if flight["status"] != OK:
        return True, -flight["end_time_s"]
    # A point that has come behind the camera has no image, and its error no RMS.
    return False, np.inf if np.isnan(flight["rms_px"]) else flight["rms_px"]


def _worst_draws(
    nominal: Vehicle, law: Controller, model: Model, wrong: list[Wrong]
) -> list[dict[str, Any]]:
    draws = [DRAWS if np.any(vehicle.camera.noise) else 1 for vehicle in _single(nominal, wrong)]
    each = [one for one, many in zip(wrong, draws, strict=True) for _ in range(many)]
    seeds = [seed for many in draws for seed in range(many)]
    flights = iter(_fly_together(nominal, law, model, each, seeds))
    return [max((next(flights) for _ in range(many)), key=harm) for many in draws]


@untold("error_estimate")
def _fly_together(
    nominal: Vehicle, law: Controller, model: Model, wrong: list[Wrong], seeds: list[int]
) -> list[dict[str, Any]]:
    flown = _vehicles(nominal, wrong)
    believed = nominal
    if nominal.uav.drag is None and flown.uav.drag is not None:
        believed = nominal.replace({"uav.drag": flown.uav.drag.model_dump()})
    scenarios = [task(each, [LETTER], law, SETTING.duration) for each in _single(nominal, wrong)]
    acting = _acting(wrong)
    scenario = scenarios[0].replace(
        q=np.concatenate([each.q for each in scenarios]),
        controller=law.believing(believed),
        target=scenarios[0].targets[0],
        seed=seeds,
        **acting,
    )
    data = simulate(
        flown,
        scenario,
        model=model,
        sample=_SAMPLE,
        variables=["feature_error"],
        check=True,
    )
    found = []
    for run in range(len(wrong)):
        flight = data.isel(run=run)
        late = flight.sel(time=slice(SETTING.settled, None))
        good = int(flight["status"]) == OK
        largest = float(np.abs(late["feature_error"].to_numpy()).max()) if good else np.nan
        found.append(
            {
                "status": int(flight["status"]),
                "end_time_s": float(flight["end_time"]),
                "error_estimate": float(flight["error_estimate"]),
                "rms_px": feature_rms(late) if good else np.nan,
                "max_px": largest,
                **({_SATURATION: float(flight[_SATURATION])} if _SATURATION in flight else {}),
            }
        )
    return found


def _single(nominal: Vehicle, wrong: list[Wrong]) -> list[Vehicle]:
    changes = [each.changes(nominal) for each in wrong]
    return [nominal.replace(each) if each else nominal for each in changes]


def _vehicles(nominal: Vehicle, wrong: list[Wrong]) -> Vehicle:
    """Return the vehicles that fly, one batch; one, where all are alike."""
    if len(set(wrong)) == 1:
        return _single(nominal, wrong)[0]
    changes = [each.changes(nominal) for each in wrong]
    paths = dict.fromkeys(path for each in changes for path in each)
    rows = {
        path: np.array([each.get(path, attrgetter(path)(nominal)) for each in changes], float)
        for path in paths
    }
    return nominal.replace(rows)


def _acting(wrong: list[Wrong]) -> dict[str, Any]:
    """Return the loads of a batch: forces, a row for each; or common ones, if they are alike."""
    if len(set(wrong)) == 1:
        return wrong[0].acting()
    given = [each.acting() for each in wrong]
    return {"force": np.array([each.get("force", np.zeros(3)) for each in given])}
