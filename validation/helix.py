"""The helical robot of Aarhus University by this package: a tendon that winds around the backbone.

    python validation/helix.py --out docs

Numbers of the robot are those of the repository rasdm/A-Quantitative-Comparison-of-Analytical-
Models-for-Helical-Tendon-Driven-Continuum-Robots. Its measured positions are in spreadsheets that
are not here, so that the page holds predictions, and checks of the helix against closed forms.
Writes validation/results/helix.json and below --out validation/helix.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from pages import save_results, table

import continuair as ca
from continuair.equations import rod_curve, tendon_lengths
from continuair.identification import Marker, StaticPoses

LENGTH, RADIUS, OFFSET, DISKS = 0.245, 0.002, 0.021, 3
YOUNGS, SHEAR, DENSITY = 2.31e9, 849e6, 726.6
TURN = np.radians(120.0)
STEPS = (100, 400, 1600)
"""Steps along the rod of the independent sums."""

TENSIONS = (1.0, 2.0, 4.0)
STRAINS = {"bending": 2, "twist": 1}


def robot(turn: float = TURN, guides: str = "disks", **changes: Any) -> ca.Vehicle:
    """Return a vehicle with the robot, which hangs below it."""
    section = {
        "name": "rod", "length": LENGTH, "radius": RADIUS, "density": DENSITY,
        "youngs_modulus": YOUNGS, "poisson_ratio": YOUNGS / (2.0 * SHEAR) - 1.0,
        "strain": STRAINS, "disks": {"count": DISKS, "mass": 0.0075},
    }  # fmt: skip
    tendon = {"angles": [0.0], "offset": OFFSET, "turn": turn, "guides": guides}
    arm = {"name": "robot", "section": [section | changes], "tendon": [tendon]}
    return ca.Vehicle(name="helix", uav={"mass": 1.2, "inertia": [0.01] * 3}, arm=[arm])


def closed_forms() -> list[tuple[str, float, float]]:
    """Return name, length by `tendon_lengths`, and length by a closed form [m], straight rods."""
    gaps, at = DISKS, np.zeros(robot().layout.bends)
    chord = 2.0 * gaps * OFFSET * np.sin(0.5 * TURN / gaps)
    expected = {
        "channel": ("in a channel, √(L² + (α d)²)", TURN * OFFSET),
        "disks": ("from disk to disk, √(L² + (2 n d sin(α/2n))²)", chord),
    }
    return [
        (name, float(tendon_lengths(robot(guides=guides), at)[0]), float(np.hypot(LENGTH, around)))
        for guides, (name, around) in expected.items()
    ]


def summed_length(vehicle: ca.Vehicle, q: np.ndarray, steps: int) -> float:
    """Return the length of the polygon of points of the helix along a bent rod [m]."""
    (section,) = vehicle.arms[0].section
    s = np.linspace(0.0, LENGTH, steps + 1)
    points, frames = rod_curve(section.orders, LENGTH, q, s[1:])
    points, frames = np.vstack([np.zeros(3), points]), np.concatenate([[np.eye(3)], frames])
    angle = TURN * s / LENGTH
    offset = OFFSET * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * s])
    places = points + np.einsum("sij,sj->si", frames, offset)
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def convergence() -> list[tuple[int, float]]:
    """Return steps, and how far the polygon's length is from ours [m], of one bent pose."""
    vehicle = robot(guides="channel")
    q = 4.0 * np.random.default_rng(0).normal(size=vehicle.layout.bends)
    own = float(tendon_lengths(vehicle, q)[0])
    return [(steps, abs(summed_length(vehicle, q, steps) - own)) for steps in STEPS]


def tip(vehicle: ca.Vehicle, tension: float) -> np.ndarray:
    """Return where the tip rests, z down [m]."""
    poses = StaticPoses("helix", np.array([[tension]]), np.zeros((1, 1, 3)), [Marker("rod")])
    return np.asarray(poses.predict(vehicle)[0, 0, 0] * [1.0, 1.0, -1.0])


def predictions() -> list[dict[str, Any]]:
    """Return the tip for each tension, with a helical and with a straight tendon."""
    return [
        {"tension": tension, "route": name, "tip": tip(robot(turn), tension).round(6).tolist()}
        for tension in TENSIONS
        for name, turn in (("helix, 120°", TURN), ("straight", 0.0))
    ]


def _off(difference: float) -> str:
    """Return a difference [m] in millimetres, without the digits of rounding."""
    return "below 1e-9" if difference < 1e-12 else f"{1e3 * difference:.0e}"


def main() -> None:
    """Write results and page."""
    parser = argparse.ArgumentParser(description="Predict the helical robot of Aarhus University.")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the pages")
    given = parser.parse_args()
    forms, sums, found = closed_forms(), convergence(), predictions()
    save_results("helix", {
        "source": "rasdm/A-Quantitative-Comparison-of-Analytical-Models-for-Helical-Tendon-Driven-"
                  "Continuum-Robots (Apache-2.0)",
        "lengths": [{"route": name, "ours": round(ours, 12), "closed_form": round(form, 12)}
                    for name, ours, form in forms],
        "polygons": [{"steps": steps, "off_m": round(off, 13)} for steps, off in sums],
        "predicted": found,
    })  # fmt: skip
    text = (Path(__file__).parent / "helix.md.in").read_text(encoding="utf-8").format(
        forms=table(("route along the straight rod", "ours [mm]", "closed form [mm]", "off [mm]"),
                    [[name, f"{1e3 * ours:.6f}", f"{1e3 * form:.6f}", _off(abs(ours - form))]
                     for name, ours, form in forms]),
        sums=table(("steps of the polygon", "shorter or longer than ours [µm]"),
                   [[str(steps), f"{1e6 * off:.3g}"] for steps, off in sums]),
        predicted=table(("tension [N]", "route", "tip [mm], z down"),
                        [[f"{row['tension']:g}", row["route"],
                          ", ".join(f"{1e3 * x:.1f}" for x in row["tip"])] for row in found]),
    )  # fmt: skip
    page = given.out / "validation" / "helix.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
