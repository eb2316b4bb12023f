"""Table I beside ours in Markdown."""

from __future__ import annotations

from typing import Any

import numpy as np

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from continuair.studies import ResultFolder, as_markdown, number

CAUTION = (
    "This is not known to be the authors' vehicle: nine free parameters and thousands of readings "
    "face eight numbers, and steel and titanium arms fit about as well. With every off-diagonal "
    "element zero, ψa of the decoupled model makes over a thousand turns in Test C."
)


def write(results: dict[str, Any], folder: ResultFolder) -> None:
    """Write table.json and table.md to the folder."""
    folder.store(results, as_table(results))


def as_table(results: dict[str, Any]) -> str:
    """Return the study in Markdown: the table, plain errors, sampling, tolerances, ablations."""
    title = "# Table I of the paper, and ours"
    parts = [beside(results), [reading(results)], [message(results)], sampling(results)]
    parts += [ablations(results), [CAUTION]]
    return "\n\n".join([title, *("\n".join(lines) for lines in parts)]) + "\n"


def beside(results: dict[str, Any]) -> list[str]:
    """Return the lines of the table: printed and ours with the ratio, and ours in m and rad."""
    plain = results["in_metres_and_radians"]
    rows = []
    for row, name in enumerate(("NRMSE_T", "NRMSE_R")):
        rows.append([f"{name}, paper", *(f"{x:.4f}" for x in results["printed"][row])])
        pairs = zip(results["ours"][row], results["ratios"][row], strict=True)
        rows.append([f"{name}, ours (ratio)", *(_with_ratio(*pair) for pair in pairs)])
    for name, key in (("position, RMSE [m]", "rmse_t_m"), ("rotation, RMS [rad]", "angle_rad")):
        rows.append([f"ours, {name}", *(f"{plain[test][key]:.3f}" for test in OPEN_LOOP_TESTS)])
    return as_markdown(("tip error in Test", *OPEN_LOOP_TESTS), rows, ("tip error in Test",))


def reading(results: dict[str, Any]) -> str:
    """Return the vehicle and the reading in sentences."""
    vehicle, arm = results["vehicle"], results["vehicle"]["arm"]
    return (
        f"All eight numbers agree within a factor of {results['factor']:.3f}. Vehicle `table1`: "
        f"UAV of {vehicle['uav']['mass']:g} kg, arm of {arm['length']:.4g} m, radius "
        f"{1e3 * arm['radius']:g} mm, {arm['density']:g} kg/m³, {arm['youngs_modulus'] / 1e9:g} "
        f"GPa, damping ratio {arm['damping_ratio']:.4g}, κ_s {arm['kappa_s']:.4g} 1/m. Reading: "
        "every off-diagonal element of M and C is zero, and Remark 1, -J_tᵀ F_e, starts and inputs "
        "are those printed. The rest is ours: the error of each axis is divided by the range of "
        "that axis in the coupled run, and the squares are added; x and y count for translation, "
        "principal ZYX angles for rotation; damping acts on κ alone, and cross-sections have no "
        "rotary inertia."
    )


def message(results: dict[str, Any]) -> str:
    """Return the meaning of the table, in sentences with the numbers of this run."""
    plain = results["in_metres_and_radians"]
    metres = {test: plain[test]["rmse_t_m"] for test in OPEN_LOOP_TESTS}
    normalised = dict(zip(OPEN_LOOP_TESTS, results["ours"][0], strict=True))
    order, other = (
        ", ".join(sorted(found, key=lambda test: -found[test])) for found in (normalised, metres)
    )
    first, last = order[0], order[-1]
    if order == other:
        return f"In metres the tests have the same order as normalised: {order}."
    return (
        "For this vehicle the normalisation makes the order of the tests. Normalised, translation "
        f"errs most in the order {order}; in metres the order is {other}. Test {first}, first "
        f"when normalised, errs by {1e3 * metres[first]:.0f} mm, and Test {last}, the last, by "
        f"{1e3 * metres[last]:.0f} mm."
    )


def sampling(results: dict[str, Any]) -> list[str]:
    """Return the lines of two tables: factors by sampling period, numbers by tolerance."""
    periods = [[name, f"{value:.3f}"] for name, value in results["factor_by_sample"].items()]
    lines = as_markdown(("sampled every", "factor"), periods, ("sampled every",))
    names = [f"{row} {test}" for row in "TR" for test in OPEN_LOOP_TESTS]
    rows = [
        [tolerance, *(number(x) for row in numbers for x in row)]
        for tolerance, numbers in results["ours_by_tolerance"].items()
    ]
    note = (
        "The numbers of Test D change most with the tolerance, as its arm passes the jump of "
        "Remark 1, after which ψa of the decoupled model spins."
    )
    return [*lines, "", *as_markdown(("tolerance", *names), rows, ("tolerance",)), "", note]


def ablations(results: dict[str, Any]) -> list[str]:
    """Return the lines of a table: the ratios to the paper with one choice changed at a time."""
    names = [f"{row} {test}" for row in "TR" for test in OPEN_LOOP_TESTS]
    rows = []
    for entry in results["ablations"]:
        pairs = zip(entry["ours"], results["printed"], strict=True)
        cells = [
            _ratio(a, b) for ours, printed in pairs for a, b in zip(ours, printed, strict=True)
        ]
        rows.append([entry["change"], _ratio(entry["factor"], 1.0), *cells])
    heading = "one choice changed, ours / paper"
    lines = as_markdown((heading, "factor", *names), rows, (heading,))
    ended = [
        f"{entry['change']}: {', '.join(f'{name}: {why}' for name, why in entry['ended'].items())}."
        for entry in results["ablations"]
        if entry["ended"]
    ]
    dash = "A dash marks a test in which a flight stops early, or an axis has no range."
    return [*lines, "", " ".join([dash, *ended])]


def _with_ratio(ours: float | None, ratio: float | None) -> str:
    """Return a number and its ratio; a dash if a flight ended early or an axis has no range."""
    told = ours is not None and ratio is not None and np.isfinite(ours)
    return f"{ours:.4f} ({ratio:.2f})" if told else "-"


def _ratio(ours: float | None, printed: float) -> str:
    return "-" if ours is None else number(ours / printed, 3)
