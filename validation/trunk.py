"""Releases of a tendon-driven trunk with a payload (StanfordASL/trunk-stack), held against arms of
several orders: fitted to releases by hand with 200 g, held against those with 300 g.

Writes the page docs/validation/trunk.md, its figure, validation/results/trunk.json and the best
fit, validation/results/trunk.toml:  python validation/trunk.py DATA
"""

from __future__ import annotations

import argparse
import gzip
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from pages import RESULTS, ROOT, save_results, table

import continuair as ca
from continuair.identification import (
    Bench,
    HeldOut,
    JointFit,
    Releases,
    fit_jointly,
    held_out_errors,
    load_releases,
    validate_releases,
)
from continuair.identification.comparison import FitOf
from continuair.vehicle.vehicle import BENCH, UNCERTAINTY
from continuair.vehicle.vehicle_file import as_toml

PAGE, FIGURE = ROOT / "docs" / "validation" / "trunk.md", "validation_trunk.png"

BENCH_OF_TRUNK = Bench(
    markers=(0.106, 0.203, 0.323),
    base=(0.1005, 0.0, 0.1042),
    up="y",
    payload_centre=(0.0, 0.0, 0.02),
)
"""Distances along the arm from the data's description; across, the base is above the first disk at
rest in the releases with 200 g; the payload's centre is a guess."""

START = """
name = "trunk"

[uav]                             # any: the base of the recording does not move
mass = 1.5
inertia = [0.02, 0.02, 0.035]

[[arm]]
name = "trunk"
mount = [0.0, 0.0, 0.0]
{sections}
[arm.tip]
mass = 0.05                       # kg, the gripper, a guess
inertia = [1e-5, 1e-5, 1e-5]
centre = [0.0, 0.0, 0.02]
"""

SECTION = """
[[arm.section]]
name = "{name}"
length = {length}
radius = 0.02
mass_per_length = 0.3             # kg/m, a guess
bending_stiffness = 0.05
damping = 0.01
{strain}
"""

LENGTH = 0.323
ORDERS = {
    "constant curvature": [("body", LENGTH, "")],
    "two arcs": [("upper", LENGTH / 2, ""), ("lower", LENGTH / 2, "")],
    "linear strain": [("body", LENGTH, "strain = { bending = 1 }")],
    "quadratic strain": [("body", LENGTH, "strain = { bending = 2 }")],
}
PATH = "arm.trunk.section."
LINEAR = "linear strain"
MASSES = (0.1, 1.0)
FITTED, UNSEEN, CIRCLE = "manual_decay_200g", "manual_decay_300g", "circle_decay_200g"
PAYLOADS = {FITTED: 0.2, UNSEEN: 0.3, CIRCLE: 0.2}


def vehicle_of(order: str) -> ca.Vehicle:
    """Return the start of the fit."""
    sections = "".join(
        SECTION.format(name=name, length=length, strain=strain)
        for name, length, strain in ORDERS[order]
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "start.toml"
        path.write_text(START.format(sections=sections))
        return ca.load_vehicle(path)


def read(data: Path) -> dict[str, Releases]:
    """Return the recordings by name."""
    found = {}
    for name, payload in PAYLOADS.items():
        packed = data / "trunk" / f"observations_{name}.csv.gz"
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{name}.csv"
            path.write_bytes(gzip.decompress(packed.read_bytes()))
            found[name] = load_releases(path, BENCH_OF_TRUNK, payload=payload)
    return found


def fields_of(order: str) -> list[str]:
    """Return the fields that are fitted: stiffness and damping of every section."""
    names = [name for name, _, _ in ORDERS[order]]
    return [f"{PATH}{name}.{of}" for name in names for of in ("bending_stiffness", "damping")]


def compare(
    order: str, recordings: dict[str, Releases], changes: dict[str, Any]
) -> dict[str, Any] | None:
    """Fit an order to the first recording, and return what it says of all; None if it stops."""
    start = vehicle_of(order).replace(changes)
    try:
        fit = fit_jointly(start, [recordings[FITTED]], fields_of(order))
    except ca.InputError as error:
        print(order, error)
        return None
    rows = {name: predicted(fit.vehicle, each) for name, each in recordings.items()}
    estimates = {
        name.removeprefix(PATH): [value, error]
        for name, value, error in zip(
            fit.fields, fit.values.tolist(), fit.errors.tolist(), strict=True
        )
    }
    print(order, changes, estimates)
    return {"fit": fit, "estimates": estimates, "recordings": rows}


def fitting(order: str) -> FitOf:
    """Return the function that fits an order to recordings."""
    return lambda parts: fit_jointly(vehicle_of(order), parts, fields_of(order)).vehicle


def write_vehicle(name: str, fit: JointFit, told: str) -> None:
    """Write a fitted vehicle with its bench and its errors."""
    beside = {BENCH: BENCH_OF_TRUNK.describe(), UNCERTAINTY: fit.uncertainty}
    text = as_toml(fit.vehicle, [f"Fitted to {told} by validation/trunk.py."], beside)
    (RESULTS / name).write_text(text, encoding="utf-8")


def predicted(vehicle: ca.Vehicle, releases: Releases) -> dict[str, Any] | None:
    """Return what a vehicle says of a recording, or None where one of its flights stops."""
    try:
        return validate_releases(vehicle, releases).describe() | {"recording": ""}
    except ca.InputError as error:
        print(error)
        return None


def judged(row: dict[str, Any]) -> tuple[str, str]:
    """Return whether frequency and damping of the unseen releases are predicted, in words."""
    frequency, damping = row["frequency_hz"], row["damping_ratio"]
    off = frequency["predicted"] - frequency["measured"]
    near = max(2.0 * frequency["standard_error"], 0.1 * frequency["measured"])
    apart = damping["predicted"] - damping["measured"]
    return (
        f"{'holds' if abs(off) <= near else 'fails'} ({100 * off / frequency['measured']:+.1f} %)",
        f"{'holds' if abs(apart) <= 0.08 else 'fails'} ({apart:+.3f})",
    )


def by_model(found: dict[str, Any], name: str) -> str:
    """Return a table of all models for one recording, below what was measured."""
    rows: list[list[str]] = []
    for label, each in found.items():
        row = each["recordings"][name]
        if row is None:
            rows.append([label, "stops", "", "", ""])
            continue
        three = [row[key] for key in ("frequency_hz", "damping_ratio", "rms_mm")]
        if not rows:
            measured = [f"{x['measured']:.3g} ± {x['standard_error']:.2g}" for x in three]
            rows.append(["*measured*", *measured, ""])
        predicted = [f"{x['predicted']:.3g}" for x in three]
        rows.append([label, *predicted, f"{row['error_mm']:.1f}"])
    return table(
        ["", "frequency [Hz]", "damping ratio", "motion, RMS [mm]", "error of the markers [mm]"],
        rows,
    )


def page(
    found: dict[str, Any], masses: dict[float, Any], recordings: dict[str, Releases], held: HeldOut
) -> str:
    """Return the page."""
    order = held.best
    best = found[order]["recordings"]
    estimates = [
        [label, field, f"{value:.3g} ± {error:.2g}"]
        for label, each in found.items()
        for field, (value, error) in each["estimates"].items()
    ]
    by_mass = [
        [
            f"{mass:g}",
            f"{each['estimates']['body.bending_stiffness'][0]:.3g}",
            f"{each['recordings'][FITTED]['error_mm']:.2f}",
            f"{each['recordings'][UNSEEN]['frequency_hz']['predicted']:.3g}",
            f"{each['recordings'][UNSEEN]['damping_ratio']['predicted']:.3g}",
        ]
        for mass, each in masses.items()
    ]
    stops = [label for label, each in found.items() if each["recordings"][CIRCLE] is None]
    row, frequency = best[UNSEEN], best[UNSEEN]["frequency_hz"]
    return (
        (ROOT / "validation" / "trunk.md.in")
        .read_text(encoding="utf-8")
        .format(
            best=order,
            unfitted=", ".join(name for name in ORDERS if name not in found) or "none",
            frequency=f"{frequency['predicted']:.3g}",
            frequency_measured=f"{frequency['measured']:.3g} ± {frequency['standard_error']:.2g}",
            damping=f"{row['damping_ratio']['predicted']:.3g}",
            damping_measured=f"{row['damping_ratio']['measured']:.3g}",
            error=f"{row['error_mm']:.0f}",
            motion=f"{row['rms_mm']['measured']:.0f}",
            own_off=_percent(best[FITTED]["frequency_hz"]),
            circle_off=_percent(best[CIRCLE]["frequency_hz"]),
            counts=", ".join(f"{len(each.motions)} of {name}" for name, each in recordings.items()),
            estimates=table(["model", "field", "estimate"], estimates),
            held_out=table(
                ["model", "error of the markers [mm]"],
                [[name, f"{1e3 * held.rms(name):.2f}"] for name in held.errors],
            ),
            as_good=", ".join(name for name in held.as_good if name != order) or "none",
            unseen=by_model(found, UNSEEN),
            judged=table(
                ["model", "frequency", "damping ratio"],
                [[label, *judged(each["recordings"][UNSEEN])] for label, each in found.items()],
            ),
            fitted=by_model(found, FITTED),
            circle=by_model(found, CIRCLE),
            stops=", ".join(stops) or "none",
            masses=table(
                [
                    "mass per length [kg/m]",
                    "bending stiffness [N m²]",
                    "error with 200 g [mm]",
                    "frequency with 300 g [Hz]",
                    "damping ratio with 300 g",
                ],
                by_mass,
            ),
            circle_measured=f"{best[CIRCLE]['frequency_hz']['measured']:.3g}",
            fitted_measured=f"{best[FITTED]['frequency_hz']['measured']:.3g}",
            circle_predicted=f"{best[CIRCLE]['frequency_hz']['predicted']:.3g}",
        )
    )


def _percent(row: dict[str, float]) -> str:
    return f"{100 * (row['predicted'] / row['measured'] - 1):+.0f} %"


def draw(found: dict[str, Any], releases: Releases) -> None:
    """Draw the tip of six unseen releases, along the main direction of each."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(9.0, 5.0), sharex=True, sharey=True)
    models = {label: each["fit"].vehicle for label, each in found.items()}
    measured = releases.measured(models[LINEAR])
    predicted = {
        label: releases.predictor(vehicle)(vehicle)[0] for label, vehicle in models.items()
    }
    chosen = np.linspace(0, len(measured) - 1, axes.size).astype(int)
    for ax, index in zip(axes.flat, chosen, strict=True):
        count = len(releases.motions[index])
        tip = measured[index, :count, -1]
        rest = tip[-20:].mean(axis=0)
        direction = np.linalg.svd(tip - rest, full_matrices=False)[2][0]
        direction *= np.sign((tip[0] - rest) @ direction)
        t = np.arange(count) / releases.rate
        for label, every in predicted.items():
            along = (every[index, :count, -1] - rest) @ direction
            ax.plot(t, 1e3 * along, lw=1.0, label=label)
        ax.plot(t, 1e3 * ((tip - rest) @ direction), "k", lw=1.6, label="measured")
        ax.set_title(f"release {releases.names[index]}", fontsize=9)
    for ax in axes[-1]:
        ax.set_xlabel("time since the onset of motion [s]")
    for ax in axes[:, 0]:
        ax.set_ylabel("tip along its motion [mm]")
    axes[0, -1].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "images" / FIGURE, dpi=110)


def main() -> None:
    """Fit, predict and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder of the data sets, with trunk/ in it")
    data = parser.parse_args().data
    if not (data / "trunk").is_dir():
        print(f"Skips the releases of the trunk: {data} has no folder trunk.")
        return
    recordings = read(data)
    held = held_out_errors({order: fitting(order) for order in ORDERS}, [recordings[FITTED]])
    tried = {order: compare(order, recordings, {}) for order in ORDERS}
    found = {order: each for order, each in tried.items() if each is not None}
    masses = {0.3: found[LINEAR]}
    for mass in MASSES:
        change = {f"{PATH}body.mass_per_length": mass}
        masses[mass] = compare(LINEAR, recordings, change) or masses[0.3]
    PAGE.parent.mkdir(exist_ok=True)
    text = page(found, dict(sorted(masses.items())), recordings, held)
    PAGE.write_text(text, encoding="utf-8")
    draw(found, recordings[UNSEEN])
    kept = {
        label: {key: each[key] for key in ("estimates", "recordings")}
        for label, each in found.items()
    }
    save_results("trunk", kept)
    order = held.best
    write_vehicle("trunk_200g.toml", found[order]["fit"], "releases by hand with 200 g")
    by_hand = [recordings[FITTED], recordings[UNSEEN]]
    both = fit_jointly(vehicle_of(order), by_hand, fields_of(order))
    write_vehicle("trunk.toml", both, "releases by hand with 200 g and 300 g")


if __name__ == "__main__":
    main()
