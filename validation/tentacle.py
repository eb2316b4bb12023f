"""Measured poses of a silicone tentacle against this package: fits on six, predictions of eight.

    python validation/tentacle.py DATA_FOLDER --out docs

DATA_FOLDER holds tentacle/poses.csv, derived from tud-phi/soromox (MIT licence),
paper_results/secVa_system_identification. Writes validation/results/tentacle.json, and below --out
images/validation_tentacle.png and validation/tentacle.md.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pages import Unknown, errors, fitted, rms, save_results, table

import continuair as ca
from continuair.identification import HeldOut, Marker, StaticPoses, held_out_errors
from continuair.identification.comparison import FitOf
from continuair.identification.joint import Measurement
from continuair.typing import Array

FITTED = ("m1_u01", "m1_u02", "m1_u025", "m2_u01", "m2_u02", "m2_u025")
WINCH = 0.0325
"""Radius of the winches [m]: tension = torque / radius."""

THEIRS = {"youngs_modulus": 315e3, "density": 1318.0, "poisson_ratio": 0.45}
PEER = 15.8
"""Their error after their fit, over 22 poses [mm]."""

LINKS = (0.305, 0.055)
RADII = (0.01541, 0.00642, 0.0048)
ANGLE = np.radians(60.0)
"""Tendons from the x axis of poses.csv: at 30 and 150 degrees of y and z of the peer's model, whose
z is that x."""

UNKNOWNS = (
    Unknown("youngs_modulus", 315e3, 1e4, 1e6),
    Unknown("density", 1318.0, 500.0, 2500.0),
    Unknown("poisson_ratio", 0.45, 0.4, 0.4999),
)


@dataclass(frozen=True)
class Kind:
    """A model of the tentacle: title, and strain of link 1, or its number of arcs."""

    title: str
    strain: dict[str, int] | None = None
    arcs: int = 0

    @property
    def sections(self) -> list[dict[str, Any]]:
        """Return the sections, with the peer's fitted values."""
        material = {name: THEIRS[name] for name in ("density", "youngs_modulus")}
        last = {"name": "end", "length": LINKS[1], "radius": sum(RADII[1:]) / 2} | material
        if self.strain is None:
            edges = np.linspace(RADII[0], RADII[1], self.arcs + 1)
            first = [
                {"name": f"arc{index}", "length": LINKS[0] / self.arcs,
                 "radius": float(edges[index : index + 2].mean())} | material
                for index in range(self.arcs)
            ]  # fmt: skip
            return [*first, last]
        link = {"name": "link", "length": LINKS[0], "radius": list(RADII[:2]),
                "strain": self.strain} | material  # fmt: skip
        if "twist" in self.strain:
            link["poisson_ratio"] = THEIRS["poisson_ratio"]
        return [link, last]

    @property
    def vehicle(self) -> ca.Vehicle:
        """Return a vehicle with the tentacle."""
        sections = self.sections
        tendon = {"section": sections[-2]["name"], "angles": [ANGLE, -ANGLE],
                  "offset": [0.0114, 0.0114 - 0.0295 * LINKS[0]]}  # fmt: skip
        uav = {"mass": 1.8, "inertia": [0.02, 0.02, 0.035]}
        arm = {"name": "arm", "section": sections, "tendon": [tendon]}
        return ca.Vehicle(name="tentacle", uav=uav, arm=[arm])

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Return the unknowns of the material."""
        return UNKNOWNS[: 3 if self.strain and "twist" in self.strain else 2]

    def with_material(self, values: np.ndarray) -> ca.Vehicle:
        """Return a batch with the unknowns' values (runs, n)."""
        return self.vehicle.replace(
            {f"arm.arm.section.{section['name']}.{each.name}": values[:, column]
             for column, each in enumerate(self.unknowns) for section in self.sections
             if each.name in section}
        )  # fmt: skip

    def marker(self, s: float, offset: Sequence[float]) -> Marker:
        """Return the marker at an arc length from the tentacle's base [m]."""
        for section in self.sections:
            if s <= section["length"] + 1e-12:
                return Marker(section["name"], min(s, section["length"]), offset)
            s -= section["length"]
        raise ValueError(f"{s} m beyond the tip")

    @property
    def markers(self) -> list[Marker]:
        """Return the four markers, by the peer's source."""
        places = (0.1291, (0.025, 0, 0)), (0.2195, (-0.021, 0, 0)), (0.28, (0.02, 0, 0))
        return [*(self.marker(*each) for each in places), self.marker(sum(LINKS), (0, 0, -0.008))]


KINDS = (
    Kind("one arc per link, mean radius", arcs=1),
    Kind("two arcs in link 1, mean radii", arcs=2),
    Kind("linear bend, tapered", {"bending": 1}),
    Kind("linear bend, tapered, twist 0, stretch 1 (the peer's strains)",
         {"bending": 1, "twist": 0, "stretch": 1}),
    Kind("quadratic bend, tapered", {"bending": 2}),
    Kind("quadratic bend, tapered, twist 0, stretch 1", {"bending": 2, "twist": 0, "stretch": 1}),
    Kind("cubic bend, tapered, twist 0, stretch 1", {"bending": 3, "twist": 0, "stretch": 1}),
)  # fmt: skip
PEERS = KINDS[3]


def read(path: Path, markers: Sequence[Marker]) -> StaticPoses:
    """Return the measured poses."""
    with open(path, newline="", encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    torques = [[float(row[f"motor{k}_Nm"]) for k in (1, 2)] for row in rows]
    points = [[[float(row[f"p{k}_{axis}"]) for axis in "xyz"] for k in (1, 2, 3, 4)]
              for row in rows]  # fmt: skip
    return StaticPoses(
        path.name, np.array(torques) / WINCH, np.array(points), markers,
        spread=[1e-3 * float(row["spread_mm"]) for row in rows],
        labels=[row["pose"] for row in rows],
    )  # fmt: skip


def some(poses: StaticPoses, fit: bool) -> StaticPoses:
    """Return the poses of the fit, or the others."""
    at = [index for index, label in enumerate(poses.labels) if (label in FITTED) == fit]
    return replace(
        poses, tensions=poses.tensions[at], points=poses.points[at],
        spread=np.asarray(poses.spread)[at], labels=[poses.labels[index] for index in at],
    )  # fmt: skip


def summary(poses: StaticPoses, vehicle: ca.Vehicle) -> dict[str, Any]:
    """Return errors [mm] over all markers, of each, and of the tip."""
    off = 1e3 * errors(poses, vehicle)
    return {"all": round(rms(off), 2), "tip": round(rms(off[:, -1]), 2),
            "markers": [round(rms(column), 2) for column in off.T]}  # fmt: skip


def judged(poses: StaticPoses, vehicle: ca.Vehicle) -> dict[str, Any]:
    """Return the errors on the fitted and on the unseen poses."""
    return {"fitted": summary(some(poses, True), vehicle),
            "unseen": summary(some(poses, False), vehicle)}  # fmt: skip


def fitting(kind: Kind) -> FitOf:
    """Return the function that fits a model's material to poses."""

    def fit(parts: Sequence[Measurement]) -> ca.Vehicle:
        found = fitted(kind.with_material, lambda _: parts, kind.unknowns)
        return kind.with_material(found[None]).select(0)

    return fit


def left_out(path: Path) -> HeldOut:
    """Return the errors of the models on each of the fitted poses, left out of the fit in turn."""
    found: dict[str, Array] = {}
    for kind in KINDS:
        known = some(read(path, kind.markers), True)
        found |= held_out_errors({kind.title: fitting(kind)}, [known], folds=len(FITTED)).errors
    return HeldOut(found, {})


def fit_of(path: Path, kind: Kind) -> dict[str, Any]:
    """Return the fit of a model's material, and its errors."""
    poses = read(path, kind.markers)
    known = some(poses, True)
    found = fitted(kind.with_material, lambda _: [known], kind.unknowns)
    values = {each.name: float(x) for each, x in zip(kind.unknowns, found, strict=True)}
    vehicle = kind.with_material(found[None]).select(0)
    return {"title": kind.title, "values": values, **judged(poses, vehicle)}


def with_base(path: Path, kind: Kind) -> dict[str, Any]:
    """Return the fit with an unknown place of the base besides, which nobody measured."""
    poses, count = read(path, kind.markers), len(kind.unknowns)
    known = some(poses, True)
    moved = [Unknown(f"base_{axis}", 0.0, -0.03, 0.03) for axis in "xyz"]

    def placed(x: np.ndarray, of: StaticPoses = known) -> StaticPoses:
        return replace(of, position=x[count:])

    found = fitted(
        lambda x: kind.with_material(x[:, :count]), lambda x: [placed(x)], [*kind.unknowns, *moved]
    )
    vehicle = kind.with_material(found[None, :count]).select(0)
    names = [each.name for each in (*kind.unknowns, *moved)]
    return {"title": kind.title + ", and the place of the base",
            "values": dict(zip(names, map(float, found), strict=True)),
            **judged(placed(found, poses), vehicle)}  # fmt: skip


def other_axes(path: Path, kind: Kind, values: dict[str, float]) -> dict[str, float | None]:
    """Return the error [mm] on the fitted poses with other readings of the data.

    None where a pose has no stable equilibrium.
    """
    poses = some(read(path, kind.markers), True)
    row = np.array([[values[each.name] for each in kind.unknowns]])
    vehicle = kind.with_material(row).select(0)
    turned = vehicle.replace({"arm.arm.tendon": [
        {"section": "link", "angles": list(np.radians([30.0, 150.0])),
         "offset": [0.0114, 0.0114 - 0.0295 * LINKS[0]]}]})  # fmt: skip
    readings = {
        "as read": (poses, vehicle),
        "motors in the other order": (replace(poses, tensions=poses.tensions[:, ::-1]), vehicle),
        "tendons at 30 and 150 degrees of x and y": (poses, turned),
        "gravity upwards": (replace(poses, gravity=(0, 0, 9.81)), vehicle),
        "0.0325 m is the winches' diameter": (replace(poses, tensions=2 * poses.tensions), vehicle),
    }
    found = {name: round(1e3 * rms(errors(*each)), 1) for name, each in readings.items()}
    return {name: value if np.isfinite(value) else None for name, value in found.items()}


def pairs(poses: StaticPoses) -> list[tuple[str, float, float, float]]:
    """Return, of each torque, direction of the tip for both motors [degrees], and their mismatch.

    The mismatch is the RMS distance of the markers of motor 2 from those of motor 1, mirrored [mm].
    """
    found = []
    for one, label in enumerate(poses.labels):
        if not label.startswith("m1"):
            continue
        other = list(poses.labels).index("m2" + label[2:])
        points = poses.points[one], poses.points[other]
        ways = [float(np.degrees(np.arctan2(each[3, 1], each[3, 0]))) for each in points]
        off = np.linalg.norm(points[0] - points[1] * [1, -1, 1], axis=-1)
        found.append((f"{poses.tensions[one].max() * WINCH:.2f}", *ways, 1e3 * rms(off)))
    return sorted(found)


def unseen_mismatch(results: dict[str, Any]) -> np.ndarray:
    """Return the mismatches of the pairs of unseen poses [mm], which are named as m1_u005."""
    torques = {f"{float(name[4] + '.' + name[5:]):.2f}" for name in results["unseen_poses"]}
    return np.array([each[3] for each in results["pairs"] if each[0] in torques])


def draw(path: Path, to: Path, kind: Kind, values: dict[str, float]) -> None:
    """Draw measured and predicted markers from the side."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams.update({"font.size": 8})
    poses = read(path, kind.markers)
    row = np.array([[values[each.name] for each in kind.unknowns]])
    found = poses.predict(kind.with_material(row).select(0))[0]
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    for index, (axes, motor) in enumerate(zip(figure.subplots(1, 2, sharey=True), "12",
                                              strict=True)):  # fmt: skip
        # Along the direction of the motor's tendon, seen from the side.
        way = np.array([np.cos(ANGLE), (-1.0) ** index * np.sin(ANGLE)])
        own = sorted((p for p, label in enumerate(poses.labels) if label[1] == motor),
                     key=lambda p: float(poses.tensions[p].max()))  # fmt: skip
        for shade, pose in zip(np.linspace(0.75, 0.0, len(own)), own, strict=True):
            colour = mpl.colormaps["viridis"](shade)
            torque = poses.tensions[pose].max() * WINCH
            seen = "fitted" if poses.labels[pose] in FITTED else "unseen"
            for points, mark, face in ((poses.points[pose], "o", colour), (found[pose], "x", None)):
                across = points[:, :2] @ way
                label = f"{torque:.2f} N m, {seen}" if mark == "o" else None
                axes.plot(1e3 * across, 1e3 * points[:, 2], mark, color=colour, markersize=5,
                          markerfacecolor=face, label=label)  # fmt: skip
        axes.set_title(f"Motor {motor}: measured (o) and predicted (x)")
        axes.set_xlabel("towards the tendon [mm]")
        axes.set_aspect("equal")
        axes.legend(fontsize=6, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("height [mm]")
    to.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(to, dpi=110)


def main() -> None:
    """Run all fits, and write results, figure and page."""
    parser = argparse.ArgumentParser(description="Compare with measured poses of a tentacle.")
    parser.add_argument("data", type=Path, help="folder that holds tentacle/poses.csv")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the pages")
    given = parser.parse_args()
    path = given.data / "tentacle" / "poses.csv"
    if not path.is_file():
        print(f"Skipped: {path} is missing; it is derived from tud-phi/soromox, see the docstring.")
        return
    held = left_out(path)
    chosen = next(kind for kind in KINDS if kind.title == held.best)
    poses = read(path, chosen.markers)
    preset = ca.load_vehicle("tentacle")
    of_preset = replace(
        poses,
        markers=[Marker("middle", 0.1291 - 0.1017, (0.025, 0, 0)),
                 Marker("outer", 0.2195 - 0.2034, (-0.021, 0, 0)),
                 Marker("outer", 0.28 - 0.2034, (0.02, 0, 0)), Marker("tip", None, (0, 0, -0.008))],
    )  # fmt: skip
    results: dict[str, Any] = {
        "source": "tud-phi/soromox, paper_results/secVa_system_identification (MIT licence)",
        "fitted_poses": list(FITTED),
        "unseen_poses": [label for label in poses.labels if label not in FITTED],
        "spread_mm": round(1e3 * float(np.max(poses.spread)), 3),
        "peer_mm": PEER,
        "pairs": pairs(poses),
        "with_the_peers_values": [
            {"title": "preset `tentacle`: three arcs in link 1", **judged(of_preset, preset)},
            *({"title": kind.title, **judged(read(path, kind.markers), kind.vehicle)}
              for kind in (KINDS[0], PEERS, chosen)),
        ],
        "left_out_mm": {title: np.round(1e3 * off, 1).tolist()
                        for title, off in held.errors.items()},
        "chosen": chosen.title,
        "fits": [fit_of(path, kind) for kind in KINDS],
        "fits_with_base": [with_base(path, kind) for kind in (PEERS, chosen)],
    }  # fmt: skip
    best = results["fits"][KINDS.index(chosen)]["values"]
    results["readings"] = other_axes(path, chosen, best)
    draw(path, given.out / "images" / "validation_tentacle.png", chosen, best)
    save_results("tentacle", results)
    page = given.out / "validation" / "tentacle.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(text_of(results), encoding="utf-8")
    print(page.read_text(encoding="utf-8"))


def _row(each: dict[str, Any]) -> list[str]:
    values = each.get("values", {})
    material = (f"{1e-3 * values['youngs_modulus']:.0f}", f"{values['density']:.0f}") if values \
        else ("315", "1318")  # fmt: skip
    return [each["title"], *material,
            *(f"{each[which][what]:.1f}" for which in ("fitted", "unseen")
              for what in ("all", "tip"))]  # fmt: skip


_HEADINGS = ("model", "E [kPa]", "density [kg/m³]", "fitted: all [mm]", "fitted: tip [mm]",
             "unseen: all [mm]", "unseen: tip [mm]")  # fmt: skip


def over_all(each: dict[str, Any], what: str) -> float:
    """Return the error of the tip, or of all markers, over fitted and unseen poses [mm]."""
    count = np.array([len(FITTED), 14 - len(FITTED)])
    off = np.array([each["fitted"][what], each["unseen"][what]])
    return float(np.sqrt(count @ off**2 / count.sum()))


def text_of(results: dict[str, Any]) -> str:
    """Return the page."""
    best = next(each for each in results["fits"] if each["title"] == results["chosen"])
    return (Path(__file__).parent / "tentacle.md.in").read_text(encoding="utf-8").format(
        fits=table(_HEADINGS, [_row(each) for each in results["fits"]]),
        based=table(_HEADINGS, [_row(each) for each in results["fits_with_base"]]),
        unfitted=table(_HEADINGS, [_row(each) for each in results["with_the_peers_values"]]),
        pairs=table(
            ("torque [N m]", "tip, motor 1 [°]", "tip, motor 2 [°]", "mismatch [mm]"),
            [[torque, f"{one:.0f}", f"{two:.0f}", f"{off:.1f}"]
             for torque, one, two, off in results["pairs"]],
        ),
        readings=table(("reading", "error on the fitted poses [mm]"),
                       [[name, "no equilibrium" if value is None else f"{value:.0f}"]
                        for name, value in results["readings"].items()]),
        chosen=results["chosen"],
        left_out=table(
            ("model", *FITTED, "all"),
            [[title, *(f"{off:.1f}" for off in errors), f"{rms(np.array(errors)):.1f}"]
             for title, errors in results["left_out_mm"].items()],
        ),
        markers=", ".join(f"{value:.1f}" for value in best["unseen"]["markers"]),
        best=f"{best['unseen']['all']:.1f}",
        best_tip=f"{best['unseen']['tip']:.1f}",
        peers=f"{results['fits'][3]['unseen']['all']:.1f}",
        arc=f"{results['fits'][0]['unseen']['all']:.1f}",
        spread=f"{results['spread_mm']:.2f}",
        floor=f"{0.5 * rms(unseen_mismatch(results)):.1f}",
        all_theirs=f"{over_all(results['with_the_peers_values'][2], 'all'):.1f}",
        moved=", ".join(
            f"{1e3 * results['fits_with_base'][1]['values'][f'base_{axis}']:.0f}" for axis in "xyz"
        ),
    )  # fmt: skip


if __name__ == "__main__":
    main()
