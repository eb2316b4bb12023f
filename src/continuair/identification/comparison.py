"""Models of an arm compared by their errors on parts of recordings that they were not fitted to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from continuair import checks
from continuair.errors import InputError, shown
from continuair.identification.joint import FreeStarts, Measurement, check_recordings
from continuair.progress import Progress, Steps
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

FitOf: TypeAlias = Callable[[Sequence[Measurement]], Vehicle]
"""Returns the vehicle that is fitted to recordings."""


@dataclass(frozen=True)
class HeldOut:
    """Errors of models on groups, such as releases or poses, that they were not fitted to.

    Parameters
    ----------
    errors : dict of str to ndarray, shape (groups,)
        Of each model: root mean square distance of the markers of each group from where they were
        measured [m]; inf where the model's flight stops, NaN for a group without measurements.
        Groups count through all recordings.
    refused : dict of str to str
        Models that cannot be fitted, and why.
    """

    errors: dict[str, Array]
    refused: dict[str, str]

    def rms(self, model: str) -> float:
        """Return the root mean square distance over all groups [m].

        Parameters
        ----------
        model : str
            One of `errors`.

        Returns
        -------
        float
            Distance [m].
        """
        return float(np.sqrt(np.nanmean(self.errors[model] ** 2)))

    @property
    def best(self) -> str:
        """Return the model with the least error."""
        return min(self.errors, key=self.rms)

    @property
    def as_good(self) -> list[str]:
        """Return the models that these groups cannot tell from the best one, itself included.

        Their mean squared error is larger by no more than its standard error, from the groups'
        differences. A single group tells nothing; a model whose flight stops is not as good.
        """
        best = self.errors[self.best]
        found = []
        for model, errors in self.errors.items():
            known = ~np.isnan(best)
            if model == self.best:
                found.append(model)
            elif np.isfinite(self.rms(model)):
                more = errors[known] ** 2 - best[known] ** 2
                spread = np.std(more, ddof=1) / np.sqrt(len(more)) if len(more) > 1 else np.inf
                if np.mean(more) <= spread:
                    found.append(model)
        return found


def held_out_errors(
    models: Mapping[str, FitOf],
    recordings: Sequence[Measurement],
    *,
    folds: int = 5,
    progress: Progress | None = None,
) -> HeldOut:
    """Compare models by cross-validation: each is fitted to some groups, and predicts the others.

    Parameters
    ----------
    models : mapping of str to callable
        Of each model the function that fits it, as ``lambda parts: fit_jointly(start, parts,
        fields).vehicle``.
    recordings : sequence of Measurement
        As `fit_jointly` takes them. Their groups are releases, poses, or parts of a driven motion.
    folds : int, default 5
        Parts into which the groups are dealt, as cards are. Each part is held out once; as many
        parts as groups leave out one group at a time.
    progress : callable, optional
        Called with (done, total, description).

    Returns
    -------
    HeldOut
        Errors of each model on each group.

    Raises
    ------
    InputError
        If there are fewer groups than folds, or no model can be fitted.

    Notes
    -----
    Predictions of releases start from what their first samples say, as in `validate_releases`. In a
    fit to parts of a driven motion its start, at rest, is that which fits all parts best.
    The error of the best of many models is a little too small, as it was chosen by it.
    """
    check_recordings("recordings", recordings)
    folds = checks.whole("folds", folds, 2)
    dealt = _dealt(recordings, folds)
    errors: dict[str, Array] = {}
    refused: dict[str, str] = {}
    steps = Steps(progress, len(models) * folds)
    for name, fit in models.items():
        found = np.empty(len(dealt))
        try:
            for fold in range(folds):
                steps.begin(f"{name}, part {fold + 1} of {folds}")
                vehicle = fit(_parts(recordings, dealt != fold))
                if not isinstance(vehicle, Vehicle):
                    raise InputError("model", f"returns {shown(vehicle)}", "return a Vehicle")
                found[dealt == fold] = _errors(vehicle, _parts(recordings, dealt == fold))
        except InputError as error:
            refused[name] = str(error)
        else:
            errors[name] = found
    if not errors:
        raise InputError("models", f"cannot be fitted: {refused}", "give others")
    return HeldOut(errors, refused)


@dataclass(frozen=True)
class _Part:
    """Some groups of a recording."""

    of: Measurement
    chosen: NDArray[np.intp]

    @property
    def name(self) -> str:
        return self.of.name

    @property
    def groups(self) -> int:
        return len(self.chosen)

    def measured(self, vehicle: Vehicle) -> Array:
        return self.of.measured(vehicle)[self.chosen]

    def predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        predict = self.of.predictor(vehicle)
        return lambda vehicles: predict(vehicles)[:, self.chosen]

    def free_predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        if not isinstance(self.of, FreeStarts):
            return self.predictor(vehicle)
        predict = self.of.free_predictor(vehicle)
        return lambda vehicles: predict(vehicles)[:, self.chosen]


def _dealt(recordings: Sequence[Measurement], folds: int) -> NDArray[np.intp]:
    """Return the fold of each group, through all recordings."""
    count = sum(each.groups for each in recordings)
    if count < folds:
        raise InputError("folds", f"is {folds}, but there are {count} groups", "give fewer")
    return np.arange(count) % folds


def _parts(recordings: Sequence[Measurement], chosen: NDArray[np.bool_]) -> list[_Part]:
    """Return the chosen groups of each recording that has any."""
    parts, first = [], 0
    for each in recordings:
        own = np.flatnonzero(chosen[first : first + each.groups])
        first += each.groups
        if len(own):
            parts.append(_Part(each, own))
    return parts


def _errors(vehicle: Vehicle, parts: Sequence[_Part]) -> Array:
    """Return the RMS distance of the markers of each group [m]."""
    found = []
    for part in parts:
        measured = part.measured(vehicle)
        off = (part.predictor(vehicle)(vehicle)[0] - measured) ** 2
        square = off.reshape(part.groups, -1, off.shape[-1]).sum(axis=2)
        there = np.asarray(np.isfinite(measured).reshape(*square.shape, -1).all(axis=2))
        found += [
            np.sqrt(np.mean(np.nan_to_num(one[seen], nan=np.inf))) if seen.any() else np.nan
            for one, seen in zip(square, there, strict=True)
        ]
    return np.array(found)
