"""Several fits of one vehicle, weighted into one."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import chi2

from continuair.errors import InputError, shown
from continuair.typing import Array
from continuair.vehicle.deviations import is_place
from continuair.vehicle.uncertain import UncertainVehicle
from continuair.warning import untold, warn

_DISAGREE = 0.01
"""Level of the test whether fits differ by more than their errors allow."""

_SINGULAR = 1e12
"""Condition of a matrix of correlations above which it is singular."""


def combine_fits(fits: Sequence[UncertainVehicle]) -> UncertainVehicle:
    """Return what fits of one vehicle, each to data of its own, say together.

    Parameters
    ----------
    fits : sequence of UncertainVehicle
        Of the same fields or of different ones, such as one of a flight and one of releases on a
        bench. A field that only one of them has may be its own, such as a payload.

    Returns
    -------
    UncertainVehicle
        The first vehicle with the weighted means of all fields, and their covariance. The model's
        error is the largest one given.

    Raises
    ------
    InputError
        If fits are no list of two or more, or the covariance of one is singular.

    Warns
    -----
    UserWarning
        If the fits differ by more than their errors allow, at a level of 1 %, or their arms differ
        in fields that none of them estimates.

    Notes
    -----
    Generalised least squares of independent estimates, whose inverse covariances add up. A joint
    fit gives the same where recordings are linear in the fields within their errors.
    """
    if not isinstance(fits, list | tuple) or not all(
        isinstance(each, UncertainVehicle) for each in fits
    ):
        raise InputError("fits", f"is {shown(fits)}", "give a list of UncertainVehicle")
    if len(fits) < 2:
        raise InputError("fits", f"holds {len(fits)}", "give two or more")
    named = [name for each in fits for name in each.fields]
    fields = tuple(dict.fromkeys(named))
    at = np.array([fields.index(name) for name in named])
    places = np.array([is_place(name) for name in fields])
    given = np.concatenate([each.medians for each in fits])
    estimates = np.where(places[at], given, np.log(np.where(places[at], 1.0, given)))
    select, weight = np.eye(len(fields))[at], block_diag(*map(_inverse, fits))
    covariance = np.linalg.inv(select.T @ weight @ select)
    mean = covariance @ select.T @ weight @ estimates
    _tell_if_apart(estimates - mean[at], weight, len(named) - len(fields))
    values = np.where(places, mean, np.exp(np.where(places, 0.0, mean))).tolist()
    vehicle = fits[0].vehicle.replace(dict(zip(fields, values, strict=True)))
    _tell_of_other_arms(fits, dict(zip(fields, values, strict=True)))
    errors = [each.model_error for each in fits if each.model_error is not None]
    return UncertainVehicle(vehicle, fields, covariance, max(errors, default=None))


def _inverse(fit: UncertainVehicle) -> Array:
    """Return the inverse covariance (fields, fields) of a fit; raise InputError if it has none."""
    covariance = np.asarray(fit.covariance)
    scale = np.sqrt(np.diag(covariance))
    if not scale.all() or np.linalg.cond(covariance / np.outer(scale, scale)) > _SINGULAR:
        raise InputError(
            "uncertainty.covariance",
            f"of {', '.join(fit.fields)} is singular",
            "leave out a field that follows from the others",
        )
    found: Array = np.linalg.inv(covariance)
    return found


def _tell_of_other_arms(fits: Sequence[UncertainVehicle], values: dict[str, float]) -> None:
    """Warn if arms with the same values of all fields still differ; UAVs may, as on a bench."""
    arms = {}
    for index, fit in enumerate(fits):
        # A vehicle that lacks a field of another one, such as a payload's, cannot be compared.
        with untold(), suppress(InputError):
            arms[index] = fit.vehicle.replace(values).arm_tables
    other = [index for index, arm in arms.items() if arm != arms[0]]
    if other:
        warn(
            f"Fits 0 and {other[0]} are of arms that differ in fields which no fit estimates; give "
            "both fits the same values, or fit the fields.",
            3,
        )


def _tell_if_apart(apart: Array, weight: Array, freedom: int) -> None:
    """Warn if estimates differ from their means by more than chance explains."""
    squares = float(apart @ weight @ apart)
    if freedom and chi2.sf(squares, freedom) < _DISAGREE:
        warn(
            f"The fits differ by more than their errors allow: chi-squared is {squares:.3g} for "
            f"{freedom} degrees of freedom. Their errors are too small, or they are not of one "
            "vehicle.",
            3,
        )
