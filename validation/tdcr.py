"""The two-section benchmark of Rao et al. (2021) against this package, with and without disks.

    python validation/tdcr.py --out docs

Numbers of the robot and of its tip are those of SvenLilge/tdcr-modeling (c++/main.cpp), by its
sub-segment Cosserat model, without gravity, as there. Writes validation/results/tdcr.json and
below --out validation/tdcr.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from pages import save_results, table

import continuair as ca
from continuair.identification import Marker, StaticPoses

TIP = np.array([0.129371, 0.145941, 0.334201])
"""Tip of the benchmark [m]; its z points along the straight robot."""

TENSIONS = [4.0, 0.0, 0.0, 0.0, 2.0, 0.0]
GOAL = 0.2
"""Distance that the model with disks has to reach [mm]."""

STRAINS: dict[str, dict[str, int] | None] = {
    "constant curvature": None,
    "linear bend": {"bending": 1},
    "quadratic bend": {"bending": 2},
    "cubic bend": {"bending": 3},
    "linear bend, twist 0, stretch 0": {"bending": 1, "twist": 0, "stretch": 0},
}


def robot(strain: dict[str, int] | None, disks: bool) -> ca.Vehicle:
    """Return a vehicle with the benchmark's robot."""
    section: dict[str, Any] = {
        "length": 0.2, "radius": 0.0007, "mass_per_length": 0.0115, "youngs_modulus": 54e9,
        "disks": {"count": 10, "mass": 0.0002},
    }  # fmt: skip
    if strain is not None:
        section |= {"strain": strain, "poisson_ratio": 0.3, "nodes": 12}
    angles = list(np.radians([90.0, -30.0, 210.0]))
    tendons = [
        {"section": name, "angles": angles, "offset": 0.01,
         "guides": "disks" if disks else "channel"}
        for name in ("proximal", "distal")
    ]  # fmt: skip
    sections = [{"name": name} | section for name in ("proximal", "distal")]
    uav = {"mass": 1.2, "inertia": [0.01, 0.01, 0.018]}
    arm = {"name": "robot", "section": sections, "tendon": tendons}
    return ca.Vehicle(name="benchmark", uav=uav, arm=[arm])


def tip(vehicle: ca.Vehicle) -> np.ndarray:
    """Return where the tip rests, in the benchmark's axes [m]."""
    poses = StaticPoses(
        "benchmark", np.array([TENSIONS]), np.zeros((1, 1, 3)), [Marker("distal")],
        gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    return poses.predict(vehicle)[0, 0, 0] * [1.0, 1.0, -1.0]


def main() -> None:
    """Write results and page."""
    parser = argparse.ArgumentParser(description="Compare with the benchmark of Rao et al.")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the pages")
    given = parser.parse_args()
    rows = []
    for title, strain in STRAINS.items():
        for disks in (True, False):
            at = tip(robot(strain, disks))
            rows.append({"strain": title, "disks": disks, "tip": at.round(7).tolist(),
                         "off_mm": round(1e3 * float(np.linalg.norm(at - TIP)), 4)})  # fmt: skip
    best = max(row["off_mm"] for row in rows if row["disks"])
    save_results("tdcr", {"tip": TIP.tolist(), "tensions": TENSIONS, "found": rows})
    listed = table(
        ("strain of each section", "tendons", "tip [m]", "off the benchmark's [mm]"),
        [[row["strain"], "straight between disks" if row["disks"] else "in a channel",
          ", ".join(f"{x:.6f}" for x in row["tip"]), f"{row['off_mm']:.3f}"] for row in rows],
    )  # fmt: skip
    page = given.out / "validation" / "tdcr.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    text = (Path(__file__).parent / "tdcr.md.in").read_text(encoding="utf-8")
    verdict = "within" if best <= GOAL else "**beyond**"
    page.write_text(
        text.format(rows=listed, best=f"{best:.2f}", goal=f"{GOAL:g}", verdict=verdict),
        encoding="utf-8",
    )
    print(listed)


if __name__ == "__main__":
    main()
