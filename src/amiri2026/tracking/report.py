"""Storing the tracking study: JSON, CSV, a table, and the trajectories."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from amiri2026.tracking.study import SAMPLE, Tracking
from continuair.flight import RESOLVED, is_beyond_limits
from continuair.kernels import REFERENCE, STATUS
from continuair.studies import ResultFolder, as_markdown, number
from continuair.vehicle import vehicle_of_run

COLUMNS = {
    "rms_px": "coordinate, RMS [px]",
    "max_px": "coordinate, max [px]",
    "norm_max_px": "‖e‖, max [px]",
    "tip_rms_m": "off target, RMS [m]",
    "tip_max_m": "off target, max [m]",
    "ds_max_px_before_2s": "|DS| before 2 s, max [px]",
    "ds_max_px_after_2s": "|DS| from 2 s, max [px]",
    "converged_s": "below 5 px from [s]",
    "force_rms_n": "force [N]",
    "out_of_view_samples": "out of view",
    "error_estimate": "error estimate",
}
"""Columns of the tables, as keys of the results."""

STATEMENTS = {
    "theorem": "Theorem 1, as printed",
    "proof": "its proof, not said",
    "sound": "sound V",
}
"""Statements on stability, as the table calls them."""


def write(study: Tracking, folder: ResultFolder) -> None:
    """Write tracking.json, tracking.csv, table.md and tracking_<setting>.nc to the folder."""
    results = study.results
    folder.store(results, as_table(results), records(results), study.datasets)


def records(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row per setting, letter and model with every number of the entry."""
    for setting, letter, model, entry in rows(results):
        yield {"setting": setting, "letter": letter, "model": model, **entry}


def rows(results: dict[str, Any]) -> list[tuple[str, str, str, dict[str, Any]]]:
    """Return (setting, letter, model, entry) of every flight, in the order of the results."""
    settings = {results["setting"]: results, **results["settings"]}
    return [
        (setting, letter, model, entry)
        for setting, part in settings.items()
        for letter, entries in part["letters"].items()
        for model, entry in entries.items()
        if isinstance(entry, dict)
    ]


def _printed(results: dict[str, Any]) -> str:
    """Return the printed values, beside the paper's vehicle."""
    if not results["printed"]:
        return ""
    return f"; the paper prints |DS| below {results['printed']['ds_max_px']:g} px"


def counted_from(results: dict[str, Any]) -> str:
    """Return from when errors count [s] in the settings, in words."""
    parts = (results, *results["settings"].values())
    return " or ".join(dict.fromkeys(f"{part['settled_s']:g}" for part in parts))


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown, with their basis."""
    damping = _damping(results["damping_ratio"])
    lines = [
        f"# Visual tracking of letters, vehicle {results['vehicle']['name']}",
        "",
        f"One law (gains {results['gains']['name']}) on each plant; structural damping of the arm",
        f"{damping}. Errors count from {counted_from(results)} s on: RMS and max are of the",
        "coordinates of feature points, of their norm ‖e‖, and of the camera's horizontal distance",
        "from the target. DS is the difference of",
        f"‖e‖ from the coupled plant{_printed(results)}. Forces are the RMS, beyond the mean "
        f"thrust, of samples {1e3 * SAMPLE:g} ms apart,",
        "of which the first push, far from the target, is one. A camera's noise is one draw of it.",
        "Error estimate: of the tip, in arm lengths.",
        *of_sections(results),
    ]
    settings = {results["setting"]: results, **results["settings"]}
    for setting, part in settings.items():
        cells = [
            [letter, model, *(number(entry.get(key)) for key in COLUMNS)]
            for name, letter, model, entry in rows(results)
            if name == setting
        ]
        table = as_markdown(["letter", "model", *COLUMNS.values()], cells, ("letter", "model"))
        lines += ["", f"## {setting}: {part['setting_meaning']}", "", *table]
    lines += ["", *remarks(results)]
    return "\n".join([*lines, *_stability(results), *_variants(results)]) + "\n"


def _damping(ratio: Any) -> str:
    """The structural damping in words: of one section, or of those of each arm."""
    each = [one for arm in ratio.values() for one in arm] if isinstance(ratio, dict) else [ratio]
    told = dict.fromkeys("as in its file" if one is None else f"of ratio {one:g}" for one in each)
    if len(told) == 1:
        return next(iter(told))
    return "of its sections " + ", ".join(
        "as in its file" if one is None else f"of ratio {one:g}" for one in each
    )


def of_sections(results: dict[str, Any]) -> list[str]:
    """Say which arm carries the camera and how others start, of a vehicle with [[arm]]."""
    flown = vehicle_of_run(results["vehicle"], None)
    if not flown.has_arm_list:
        return []
    name = flown.arms[flown.camera_arm].name
    others = "; other arms start straight" if len(flown.arms) > 1 else ""
    return [
        f"The camera is at the tip of arm {name}, whose sections start with the bend of the "
        f"paper's one section (our choice){others}. The paper's proof of stability is of one "
        "section, and left out here.",
    ]


def remarks(results: dict[str, Any]) -> list[str]:
    """Return a sentence for the flights of a setting that ended early alike, about the first, and
    one each for those that are not resolved, and whose rotors saturate, about the worst."""
    lines = []
    for setting in (results["setting"], *results["settings"]):
        flights = {
            f"{setting}, {letter}, {model}": entry
            for name, letter, model, entry in rows(results)
            if name == setting
        }
        lines += [
            *_ended_early(flights),
            *_unresolved(flights),
            *_saturated(flights),
        ]
    return lines


def _ended_early(flights: dict[str, dict[str, Any]]) -> Iterator[str]:
    for status in sorted({entry["status"] for entry in flights.values()} - {0}):
        ends = {
            flight: entry["end_time_s"]
            for flight, entry in flights.items()
            if entry["status"] == status
        }
        first = min(ends, key=lambda flight: ends[flight])
        yield f"* {first}: ended at {ends[first]:.3g} s, {STATUS[status]}{_more(ends, flights)}."


def _unresolved(flights: dict[str, dict[str, Any]]) -> Iterator[str]:
    errors = {
        flight: entry["error_estimate"]
        for flight, entry in flights.items()
        if entry["error_estimate"] > RESOLVED
    }
    if errors:
        worst = max(errors, key=lambda flight: errors[flight])
        told = f"not resolved, its error_estimate is {errors[worst]:.2g} arm lengths"
        yield f"* {worst}: {told}{_more(errors, flights)}."


def _saturated(flights: dict[str, dict[str, Any]]) -> Iterator[str]:
    beyond = {
        flight: entry["largest_saturation"]
        for flight, entry in flights.items()
        if is_beyond_limits(entry.get("largest_saturation", 0.0))
    }
    if beyond:
        worst = max(beyond, key=lambda flight: beyond[flight])
        asked = f"rotors saturate, asked for up to {beyond[worst]:.1%} of their range beyond it"
        yield f"* {worst}: {asked}{_more(beyond, flights)}."


def _more(alike: dict[str, float], flights: dict[str, dict[str, Any]]) -> str:
    """Return how many other flights are like the one of a sentence."""
    return f"; likewise {len(alike) - 1} more of {len(flights)}" if len(alike) > 1 else ""


def _stability(results: dict[str, Any]) -> list[str]:
    """Return the bound of the proof, and the failing conditions of the theorem and the sound V.

    Both apply to constant gains.
    """
    if "ultimate_bound" not in results:
        return []
    bound = results["ultimate_bound"]
    lost = any(entry[REFERENCE]["status"] for entry in results["letters"].values())
    lasting = ", in flights that last to their end" if lost else ""
    cells = [
        [STATEMENTS[statement], each["name"], each["measure"], number(each["value"])]
        for statement, conditions in results["conditions"].items()
        for each in conditions
        if not each["holds"]
    ]
    headings = ["statement", "condition that does not hold", "measured", "value"]
    return [
        "",
        "## Stability",
        "",
        f"The target moves with at most {bound['target_speed_m_s']:.3g} m/s, "
        f"{bound['target_acceleration_m_s2']:.3g} m/s² and {bound['target_jerk_m_s3']:.3g} m/s³.",
        f"The proof bounds ‖e_a‖ by {bound['radius_least']:.3g} with the largest λ that it could "
        f"mean and by {bound['radius_provable']:.3g} with λ = λ_min(K_p); ‖e_a‖ stays "
        f"below {number(bound['reached'], 3)} from {results['settled_s']:g} s on{lasting}, "
        "whatever the letter.",
        "",
        "These gains and flights break the following. (A C_d that is positive definite, which the "
        "theorem asks for, is not 0, which its proof needs.)",
        "",
        *as_markdown(headings, cells, headings[:3]),
    ]


def _variants(results: dict[str, Any]) -> list[str]:
    """Return the table of the law's variants, if they were flown."""
    if "variants" not in results:
        return []
    columns = {
        "rms_px": "coordinate, RMS [px]",
        "max_px": "coordinate, max [px]",
        "largest_bend_1_m": "bend [1/m]",
        "largest_tilt_rad": "tilt [rad]",
        "ds_max_px_after_2s": "|DS| from 2 s, max [px]",
        "error_estimate": "error_estimate",
    }
    cells = [
        [
            row["variant"],
            number(row["damping_ratio"]),
            "at the end" if row["status"] == 0 else f"at {row['end_time_s']:.3g} s",
            *(number(row[key]) for key in columns),
        ]
        for row in results["variants"]
    ]
    headings = ["variant", "structural damping ratio", "ended", *columns.values()]
    return [
        "",
        "## Variants of the law",
        "",
        f"Letter {results['variants'][0]['letter']} on the coupled plant, nominal camera; DS "
        "against the decoupled plant. Bend and tilt are the",
        f"largest of samples {1e3 * SAMPLE:g} ms apart. Where error_estimate is above 1e-3, the "
        "numbers beside it are not resolved.",
        "",
        *as_markdown(headings, cells, ("variant", "ended")),
    ]
