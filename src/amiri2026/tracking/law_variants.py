"""Effects of the choices within the paper's law: one letter, each variant on two plants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import xarray as xr

from continuair import Controller, Gains, Vehicle, classic, servoing, simulate, stack
from continuair.analysis import TRANSIENT, excited_arm, feature_rms, norm_difference
from continuair.flight import unresolved
from continuair.kernels import PLANTS
from continuair.progress import Progress, Steps
from continuair.scenario import SETTINGS, equipped, task
from continuair.warning import untold

Compensation: TypeAlias = Literal["gravity_only", "literal"]

STIFFNESS = np.geomspace(1.0, 1000.0, 10)
LEAD = np.geomspace(0.03, 3.0, 8)
"""Scalar gains that are tried: K_p, and C_d [s]; K_d = K_p / 1000, C_p = 1."""

POSTURE = 0.3
"""Posture damping that is tried [N m³ s]: 10 1/s of the straight arm of the preset `paper`."""

PLAIN = {
    "damping": "camera",
    "feed_forward": True,
    "compensation": "gravity_only",
    "posture_damping": 0.0,
    "integral": 0.0,
}
"""The choices of the law that variants depart from, whatever the gains' file chooses."""


@dataclass(frozen=True)
class Variant:
    """A law and whether the arm has the structural damping of the task."""

    name: str
    controller: Controller
    damped: bool = True


def law_variants(
    vehicle: Vehicle, gains: Gains, letter: str = "M", *, progress: Progress | None = None
) -> list[dict[str, Any]]:
    """Return the results of each variant; raises InputError.

    They are RMS and largest feature error, bend, tilt, DS and error_estimate, the larger of both
    plants.
    """
    setting = SETTINGS["nominal"]
    damped = equipped(vehicle, setting)
    bare = damped.replace(_without_damping(damped))
    steps = Steps(progress, 3)
    steps.begin("scalar gains")
    scalar = {c: best_scalar(damped, letter, c) for c in ("gravity_only", "literal")}
    rows = []
    steps.begin("variants of the law")
    chosen = _variants(damped, gains, scalar)
    for of_damped, flown in ((True, damped), (False, bare)):
        # Scalar gains fly another law than gains of the image of now; a batch has one integral.
        for kind in dict.fromkeys((v.controller.law, v.controller.integral) for v in chosen):
            same = [
                v
                for v in chosen
                if v.damped is of_damped and (v.controller.law, v.controller.integral) == kind
            ]
            if same:
                rows += _fly(flown, same, stack([v.controller for v in same]), letter)
    steps.begin("classic image-based servoing")
    baseline = Variant("classic IBVS, v = λ L⁺ e, rate 1.5 /s", classic(damped, 1.5, 6.0))
    return rows + _fly(damped, [baseline], stack([baseline.controller]), letter)


@untold("error_estimate")
def best_scalar(vehicle: Vehicle, letter: str, compensation: Compensation) -> dict[str, Any]:
    """Scalar gains with the least RMS error of a grid on the coupled plant, of resolved flights."""
    grid: list[dict[str, Any]] = [
        {"Kp": float(k), "Kd": 1e-3 * float(k), "Cd": float(lead)}
        for k in STIFFNESS
        for lead in LEAD
    ]
    laws = stack([servoing(**gains, compensation=compensation) for gains in grid])
    scenario = task(vehicle, [letter], laws, SETTINGS["nominal"].duration)
    data = simulate(vehicle, scenario, sample=5e-2, variables=["feature_error"], check=True)
    rms = np.nan_to_num(feature_rms(_settled(data)), nan=np.inf)
    rms[unresolved(data.error_estimate.to_numpy())] = np.inf
    return grid[int(np.argmin(rms))]


def _without_damping(vehicle: Vehicle) -> dict[str, float]:
    """Changes that take the structural damping of every section."""
    if not vehicle.has_arm_list:
        each = {"arm": vehicle.arm}
    else:
        each = {
            f"arm.{arm.name}.section.{part.name}": part
            for arm in vehicle.arms
            for part in arm.section
        }
    return {
        f"{path}.{'damping' if part.damping_ratio is None else 'damping_ratio'}": 0.0
        for path, part in each.items()
    }


def _variants(vehicle: Vehicle, gains: Gains, scalar: dict[str, dict[str, Any]]) -> list[Variant]:
    def designed(damped: bool = True, **changed: Any) -> Variant:
        law = Gains("variant", {**gains.settings, **PLAIN, **changed}).controller(vehicle)
        return Variant(_told(changed, damped), law, damped)

    def of_scalars(compensation: Compensation, damped: bool = True) -> Variant:
        chosen = scalar[compensation]
        name = _told({"compensation": compensation}, damped)
        told = f"scalar gains, K_p {chosen['Kp']:.3g}, C_d {chosen['Cd']:.3g} s, {name}"
        return Variant(told, servoing(**chosen, compensation=compensation), damped)

    return [
        Variant(
            f"as flown: {_kind(gains)} gains, {_told(gains.settings)}", gains.controller(vehicle)
        ),
        designed(feed_forward=False),
        designed(damping="feature"),
        designed(compensation="literal"),
        designed(compensation="literal", posture_damping=POSTURE),
        designed(compensation="literal", damped=False),
        designed(damped=False),
        of_scalars("gravity_only"),
        of_scalars("literal"),
        of_scalars("literal", damped=False),
    ]


def _kind(gains: Gains) -> str:
    """Return the kind of gains in a word."""
    if not gains.constant:
        return "current"
    return "scalar" if np.ndim(gains.settings.get("Kp", ())) == 0 else "matrix"


def _told(changed: Mapping[str, Any], damped: bool = True) -> str:
    """Return the choices of a law in words."""
    chosen = {**PLAIN, **changed}
    literal, posture = chosen["compensation"] == "literal", chosen["posture_damping"]
    words = [
        "literal G (elasticity cancelled)" if literal else "gravity only",
        *([] if chosen["feed_forward"] else ["without target feed-forward"]),
        *(["damping on -ė instead of J_L q̇"] if chosen["damping"] == "feature" else []),
        *([f"posture damping {posture:g} N m³ s"] if posture else []),
        *([f"integral {chosen['integral']:g} 1/s"] if chosen["integral"] else []),
        *([] if damped else ["no structural damping"]),
    ]
    return ", ".join(words)


@untold("error_estimate")
def _fly(
    vehicle: Vehicle, variants: list[Variant], laws: Controller, letter: str
) -> list[dict[str, Any]]:
    scenario = task(vehicle, [letter], laws, SETTINGS["nominal"].duration)
    coupled, decoupled = (
        simulate(
            vehicle,
            scenario,
            model=plant,
            sample=1e-2,
            variables=["feature_error", "bend", "q"],
            check=True,
        )
        for plant in PLANTS
    )
    late = (flight.sel(time=slice(TRANSIENT, None)) for flight in (coupled, decoupled))
    ds, settled = np.abs(norm_difference(*late)), _settled(coupled)
    rms, bend = np.asarray(feature_rms(settled)), _bends(coupled)
    worst = np.abs(settled["feature_error"].to_numpy()).max(axis=(1, 2))
    upright = np.cos(coupled["q"].sel(coordinate=["roll", "pitch"]).to_numpy()).prod(axis=2)
    tilt = np.arccos(np.clip(upright, -1.0, 1.0))
    estimate = np.max([each["error_estimate"] for each in (coupled, decoupled)], axis=0)
    return [
        {
            "variant": variant.name,
            "letter": letter,
            "damping_ratio": float(excited_arm(vehicle).damping_ratio),
            "status": int(coupled["status"].to_numpy()[row]),
            "end_time_s": float(coupled["end_time"].to_numpy()[row]),
            "rms_px": float(rms[row]),
            "max_px": float(worst[row]),
            "largest_bend_1_m": _largest(bend[row]),
            "largest_tilt_rad": _largest(tilt[row]),
            "ds_max_px_after_2s": float(ds[row].max()),
            "error_estimate": float(estimate[row]),
        }
        for row, variant in enumerate(variants)
    ]


def _bends(flight: xr.Dataset) -> np.ndarray:
    """The largest bend of a section over (run, time) [1/m]."""
    bends = flight["bend"].transpose("run", "time", ..., "bend_axis").to_numpy()
    norms = np.linalg.norm(bends, axis=-1)
    return np.asarray(norms if norms.ndim == 2 else norms.max(axis=2))


def _largest(over_time: np.ndarray) -> float:
    """Return the largest over the samples of a flight; NaN if it ended before the second one."""
    seen = over_time[np.isfinite(over_time)]
    return float(seen.max()) if len(seen) > 1 else np.nan


def _settled(data: xr.Dataset) -> xr.Dataset:
    """Return the part of a flight in which errors count."""
    return data.sel(time=slice(SETTINGS["nominal"].settled, None))
