"""Whether a verdict holds for the vehicles that an uncertain one may be.

Drawn vehicles fly the excitations at the frequencies that decide the verdict on the medians, under
the controller that is made for the medians. The medians' own flights are checked for their
resolution; the draws' are not again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import rankdata

from continuair.analysis.excited import excited_arm
from continuair.analysis.shares import percent
from continuair.kernels.dynamics import SIMPLER
from continuair.studies.advise.excitations import MODERATE, together
from continuair.studies.advise.verdicts import TASKS
from continuair.studies.excited_flights import Loop, flown_errors
from continuair.studies.tables import number_below
from continuair.typing import Array, Model
from continuair.vehicle.runs import take
from continuair.vehicle.uncertain import DRAWS, UncertainVehicle, band

AGREE = 0.95
"""Share of the draws that must agree for a verdict."""

_FARTHEST = 4.0
"""Largest factor of a draw's limit from that of the medians."""

_FLOWN = 1.5
"""Largest factor at which a draw is flown: a batch flies as long as its lowest frequency needs."""

_LONG, _FEW = 200.0, 32
"""Clamped periods of a flight from which so few draws fly it."""

_CLASSES = 16
"""Classes of a field over whose means its share of the variance is taken."""

_SHORT = 1e-3
"""Logarithm of a factor of frequencies too short for a secant."""

_LEAST_SLOPE = 0.5
"""Least slope of log error over log frequency that a step towards the tolerance uses."""


class Drawn:
    """Draws of an uncertain vehicle, and their errors beside those of the medians."""

    def __init__(
        self, uncertain: UncertainVehicle, loop: Loop, tolerance: float, seed: int = 0
    ) -> None:
        self.uncertain, self.loop, self.tolerance = uncertain, loop, tolerance
        self.batch, self.inputs = uncertain.draws(DRAWS, seed), uncertain.values(DRAWS, seed)
        self.clamped = np.asarray(excited_arm(self.batch).frequency) / (2.0 * np.pi)

    def errors(self, name: str, hertz: Any, models: Sequence[Model]) -> dict[Model, Array]:
        """Return the errors of models at frequencies [Hz], one for all or one for each draw.

        Of all draws (draws,), or of the first few where a flight is long.
        """
        ratio = np.broadcast_to(np.asarray(hertz) / self.clamped, (DRAWS,))
        (_, periods), *_rest = together(name, np.array([ratio.min()]), self.loop)
        batch = self.batch
        if periods > _LONG:
            batch, ratio = take(batch, np.arange(_FEW)), ratio[:_FEW]
        found = flown_errors(batch, name, ratio, self.loop, periods, models, check=False)
        return {model: found[model] for model in models}

    def excitation(self, name: str, parts: dict[Model, Any]) -> dict[Model, dict[str, Any]]:
        """Return what the draws say of an excitation, by model.

        parts: what the medians' flights found of each model.
        """
        found: dict[Model, dict[str, Any]] = {}
        for models in _alike(parts):
            first = parts[models[0]]["limit_hz"]
            if first is not None and np.isfinite(first):
                errors, limits = self._limits(name, parts, models)
                agree = {model: np.ones(1, bool) for model in models}
                found |= {m: self._told(errors[m], agree[m], limits[m]) for m in models}
                continue
            at = deciding(parts[models[0]], self.clamped)
            none = first is None
            medians = {m: parts[m]["tolerable"] if none else np.isinf(first) for m in models}
            found |= self._agreed(name, at, medians)
        return {model: found[model] for model in parts}

    def _agreed(self, name: str, hertz: Any, medians: dict[Model, Any]) -> dict[Model, Any]:
        """Return what draws say of what the medians tolerate, or do not, at a frequency [Hz]."""
        errors = self.errors(name, hertz, tuple(medians))
        return {
            model: self._told(errors[model], (errors[model] <= self.tolerance) == each, None)
            for model, each in medians.items()
        }

    def _told(self, errors: Array, agree: Array, limits: Array | None) -> dict[str, Any]:
        """Return errors, agreement and limits (draws,) as plain numbers."""
        decides = errors if limits is None else limits
        shares = zip(self.uncertain.fields, self._first_order(decides).tolist(), strict=True)
        return {
            "error_band": band(np.where(np.isfinite(errors), errors, np.nan)).tolist(),
            "limit_band_hz": None if limits is None else band(limits).tolist(),
            "limits_hz": None if limits is None else np.resize(limits, DRAWS).tolist(),
            "agree": np.resize(agree, DRAWS).tolist(),
            "sensitivity": dict(shares),
        }

    def _limits(
        self, name: str, parts: dict[Model, Any], models: Sequence[Model]
    ) -> tuple[dict[Model, Array], dict[Model, Array]]:
        """Return errors near the medians' limits, and each draw's own limits [Hz], by model.

        By one secant step in logarithms; the flight that it starts from is one step along the slope
        of the medians' error over frequency away.
        """
        goal, most = np.log(self.tolerance), np.log(_FARTHEST)
        first = float(np.exp(np.mean([np.log(parts[model]["limit_hz"]) for model in models])))
        errors = self.errors(name, first, models)
        value = {model: _log(each) for model, each in errors.items()}
        slopes = {m: max(_slope(parts[m], parts[m]["limit_hz"]), _LEAST_SLOPE) for m in models}
        steps = [(goal - value[model]) / slopes[model] for model in models]
        step = np.clip(np.mean(steps, axis=0), -np.log(_FLOWN), np.log(_FLOWN))
        second = self.errors(name, first * np.exp(np.resize(step, DRAWS)), models)
        limits = {}
        for model in models:
            # Either flight may be a long one, which only the first draws fly.
            some = min(len(step), len(second[model]))
            start, aside = value[model][:some], step[:some]
            rise = _log(second[model][:some]) - start
            usual = np.full(some, slopes[model])
            secant = np.divide(rise, aside, out=usual, where=np.abs(aside) > _SHORT)
            moved = (goal - start) / np.maximum(secant, _LEAST_SLOPE)
            limits[model] = first * np.exp(np.clip(moved, -most, most))
        return errors, limits

    def _first_order(self, values: Array) -> Array:
        """Return the first-order share (fields,) of each field in the variance of ranks (draws,).

        It is the variance of the means over equal classes of the field, less what classes of random
        draws have (Plischke, Borgonovo and Smith 2013, doi:10.1016/j.ejor.2012.11.047).
        """
        ranks = rankdata(np.nan_to_num(values, nan=np.inf))
        if np.ptp(ranks) == 0.0:
            return np.zeros(self.inputs.shape[1])
        order = np.argsort(self.inputs[: len(ranks)], axis=0).T
        means = ranks[order].reshape(len(order), _CLASSES, -1).mean(axis=-1)
        share = np.var(means, axis=1) / np.var(ranks)
        chance = (_CLASSES - 1) / (len(ranks) - 1)
        return np.clip((share - chance) / (1.0 - chance), 0.0, 1.0)


def _alike(parts: dict[Model, Any]) -> list[list[Model]]:
    """Return the models in groups that fly at equal frequencies: with limits that are near."""
    groups: dict[object, list[Model]] = {}
    finite = [part["limit_hz"] for part in parts.values() if _is_finite(part["limit_hz"])]
    near = bool(finite) and max(finite) <= _FLOWN * min(finite)
    for model, part in parts.items():
        limit = part["limit_hz"]
        shared = limit is None or np.isnan(limit) or (near and np.isfinite(limit))
        key = f"{_is_finite(limit)}" if shared else model
        groups.setdefault(key, []).append(model)
    return list(groups.values())


def _is_finite(limit: float | None) -> bool:
    return limit is not None and bool(np.isfinite(limit))


def deciding(part: dict[str, Any], clamped: Array) -> Any:
    """Return the frequency [Hz] at which draws may contradict: of the largest error of the medians
    where all are tolerable, the lowest where none is; for a release or a fall, no matter which."""
    if part["limit_hz"] is None:
        return MODERATE * clamped
    return part["hz"][int(np.nanargmax(part["errors"])) if np.isinf(part["limit_hz"]) else 0]


def _log(errors: Array) -> Array:
    """Return logarithms of errors, of flights that ended early too."""
    found: Array = np.log(np.clip(np.nan_to_num(errors, nan=1e12), 1e-12, 1e12))
    return found


def _slope(part: dict[str, Any], limit: float) -> float:
    """Return the slope of log error over log frequency of the medians, next to their limit."""
    hertz, errors = np.array(part["hz"]), np.array(part["errors"])
    order = np.argsort(hertz)
    hertz, errors = hertz[order], errors[order]
    at = int(np.searchsorted(hertz, limit))
    pair = slice(min(at, len(hertz) - 2), min(at, len(hertz) - 2) + 2)
    rise, run = np.diff(_log(errors[pair])), np.diff(np.log(hertz[pair]))
    return float(rise[0] / run[0])


def draw_all(
    uncertain: UncertainVehicle, loop: Loop, tolerance: float, excitations: dict[str, Any]
) -> dict[str, Any]:
    """Return what draws say of each excitation and model; excitations: of the medians."""
    drawn = Drawn(uncertain, loop, tolerance)
    return {
        name: drawn.excitation(name, {model: part["models"][model] for model in SIMPLER})
        for name, part in excitations.items()
    }


def cautious(excitations: dict[str, Any], draws: dict[str, Any]) -> dict[str, Any]:
    """Return the medians' findings with the limits that 95 % of the draws exceed."""
    found = {}
    for name, part in excitations.items():
        models = {}
        for model, entry in part["models"].items():
            limits = draws[name][model]["limit_band_hz"]
            models[model] = entry if limits is None else entry | {"limit_hz": limits[0]}
        found[name] = part | {"models": models}
    return found


def settle_verdicts(verdicts: dict[str, dict[Model, Any]], draws: dict[str, Any]) -> None:
    """Add to each verdict what the draws say, and withdraw those on which too few agree.

    Adds ``agree``, the share of the draws that agree, ``hangs_on``, the field that decides most,
    and ``limit_band``, the 5 and 95 % limits of the draws where there is a limit. Tracking is not
    drawn.
    """
    for task, models in verdicts.items():
        if task in TASKS:
            for model, entry in models.items():
                _settle(entry, {name: draws[name][model] for name in TASKS[task]})


def _settle(entry: dict[str, Any], parts: dict[str, Any]) -> None:
    """Change one verdict by the draws of its excitations."""
    agree = np.all([part["agree"] for part in parts.values()], axis=0)
    share = float(np.mean(agree))
    limits = {name: part["limits_hz"] for name, part in parts.items() if part["limits_hz"]}
    decides = min(parts, key=lambda name: np.mean(parts[name]["agree"]))
    if share >= AGREE and limits:
        decides = min(limits, key=lambda name: float(np.median(limits[name])))
    shares = parts[decides]["sensitivity"]
    field = max(shares, key=lambda name: shares[name])
    entry |= {"agree": share, "hangs_on": field, "decided_by": decides}
    if entry["scope"] == "undecided":
        return
    if share < AGREE:
        entry["scope"] = "undecided"
        entry["text"] = (
            f'cannot tell: {percent(share)} of the draws agree on "{entry["text"]}"; measure '
            f"{field} better, on which {decides} hangs most"
        )
        return
    entry["text"] += f"; {percent(share)} of the draws agree"
    if entry["scope"] == "below":
        least = band(np.min(list(limits.values()), axis=0))
        entry["limit_band"] = least.tolist()
        entry["text"] += f", their limits {number_below(least[0])} to {number_below(least[1])} Hz"
