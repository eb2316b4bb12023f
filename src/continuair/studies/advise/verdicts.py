"""Verdicts on a task from errors and limits: a sentence, its scope and its exceptions."""

from __future__ import annotations

import shlex
from typing import Any

import numpy as np

from continuair.studies.tables import number_below

TASKS = {
    "hover": ("bend", "moment", "release"),
    "fast-flight": ("force", "fall"),
    "contact": ("tip",),
}
"""Standard excitations that stand for a task; `track:M` tracks the letter M, or another."""

SAVED = 0.1
"""Share of a coupled step's time that a decoupled one saves at the least, to be a reason."""

_ONCE = {"release": "when the bent arm is let go", "fall": "in free fall"}


def cost_verdict(step_over_coupled: dict[str, float]) -> str:
    """Return a sentence where a decoupled step costs what a coupled one does; else nothing.

    step_over_coupled: time of a step of each simpler model over that of the coupled one.
    """
    ratio = step_over_coupled["decoupled"]
    if ratio <= 1.0 - SAVED:
        return ""
    measured = (
        f"its decoupled step was measured to take {ratio:.2f} times the time of a coupled one"
    )
    saving = {model: each for model, each in step_over_coupled.items() if each <= 1.0 - SAVED}
    if not saving:
        return f"There is no reason to decouple this vehicle: {measured}."
    others = " and ".join(f"{model} takes {each:.2f} times" for model, each in saving.items())
    return f"The decoupled model saves no time for this vehicle: {measured}; {others}."


def verdict(results: dict[str, Any], task: str, model: str) -> dict[str, Any]:
    """Return the verdict on a task and a model: a sentence, and its scope and exceptions.

    scope: "all" frequencies or speeds tried, those "below" the limit, "none", or "undecided" if the
    coupled model itself fails. limits, scopes: of each oscillating excitation [Hz]. except:
    excitations of the task, without a frequency, to which it does not apply.
    """
    if task in results["tracking"]:
        found = results["tracking"][task]
        limit = found["models"][model]["limit_m_s"]
        if np.isnan(found["rms_px"]) and not found["gains"]:
            text = (
                f"undecided: the controller {found['controller']} loses the target, or chatters; "
                "give one that tracks the slowest letter"
            )
            return {"scope": "undecided", "limit": limit, "unit": "m/s", "text": text}
        if np.isnan(found["rms_px"]):
            called = shlex.quote(results["called"])
            text = (
                f"undecided: gains {found['gains']} lose the target, or chatter; find gains with "
                f"`continuair tune --vehicle {called} --out gains.toml`, then "
                f"`continuair advise {called} --gains gains.toml`"
            )
            return {"scope": "undecided", "limit": limit, "unit": "m/s", "text": text}
        text = _sentence(limit, "a target slower than {} m/s", "a target as fast as was tried")
        if np.isfinite(found["lost_from_m_s"]) and not np.isnan(limit):
            fast = number_below(found["lost_from_m_s"])
            text += f" (from {fast} m/s on the coupled plant itself loses it, or chatters)"
        return {"scope": _scope(limit), "limit": limit, "unit": "m/s", "text": text}
    parts = {name: results["excitations"][name] for name in TASKS[task]}
    lost = " and ".join(name for name, part in parts.items() if _is_lost(part["models"][model]))
    if lost:
        text = (
            f"undecided: the coupled model itself does not complete {lost}; {_remedy(parts, model)}"
        )
        return {"scope": "undecided", "except": [], "limit": np.nan, "unit": "Hz", "text": text}
    once = [name for name, part in parts.items() if part["models"][model]["limit_hz"] is None]
    bad = [name for name in once if not parts[name]["models"][model]["tolerable"]]
    limits = {
        name: part["models"][model]["limit_hz"] for name, part in parts.items() if name not in once
    }
    worst = min(limits, key=lambda name: _rank(limits[name]))
    limit = limits[worst]
    highest = min(max(parts[name]["models"][model]["hz"]) for name in limits)
    tried = f"motion at every frequency tried, up to {number_below(highest)} Hz"
    text = _sentence(limit, "motion below {} Hz", tried)
    # The missing effect of `decoupled`: one coupling at a time is left out of the coupled model.
    missed = {
        name: _missed(parts[name]["responsible"]) if model == "decoupled" else ""
        for name in (worst, *bad)
    }
    bounded = missed[worst] if not np.isinf(limit) else ""
    if bad and not np.isnan(limit):
        alike = len({bounded or missed[bad[0]], *(missed[name] for name in bad)}) == 1
        each = [_ONCE[name] + missed[name] * (not alike) for name in bad]
        text += bounded * (not alike) + ", but not " + " or ".join(each)
        text += missed[bad[0]] * alike
    else:
        text += bounded
    found = {"scope": _scope(limit), "except": bad, "limit": limit, "unit": "Hz", "text": text}
    return found | {"limits": limits, "scopes": {name: _scope(limits[name]) for name in limits}}


def _remedy(parts: dict[str, Any], model: str) -> str:
    """Return the remedy for flights that fail; a contact's load grows with the arm's stiffness."""
    tip = parts.get("tip")
    if tip is not None and _is_lost(tip["models"][model]):
        load = f"its load, {tip['amplitude']:.3g} N, exceeds the capacity of the vehicle at the tip"
        return f"{load}; give a softer arm"
    return "give the vehicle a stiffer arm, or a loop that holds it"


def _missed(culprit: str) -> str:
    """Return a clause on the effect that a model lacks."""
    return f" (missing effect: {culprit})" if culprit else ""


def _is_lost(entry: dict[str, Any]) -> bool:
    """Whether there is no error, as the coupled model ended early: once, or at the lowest of the
    frequencies."""
    return bool(np.isnan(entry["error"] if entry["limit_hz"] is None else entry["errors"][0]))


def _scope(limit: float) -> str:
    if np.isnan(limit):
        return "none"
    return "all" if np.isinf(limit) else "below"


def _rank(limit: float) -> float:
    return -1.0 if np.isnan(limit) else limit


def _sentence(limit: float, below: str, everywhere: str) -> str:
    if np.isnan(limit):
        return "do not decouple"
    if np.isinf(limit):
        return f"decouple for {everywhere}"
    return f"decouple for {below.format(number_below(limit))}"
