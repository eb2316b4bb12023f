"""Published figures of the Aerial Elephant Trunk against the preset `aet`.

    python validation/aet.py --out docs

Figures are those of R. Peng et al., Nature Communications 16:889, 2025, and of the sheets of its
repository arclab-hku/AET. Writes validation/results/aet.json and below --out validation/aet.md.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pages import rms, save_results, table

import continuair as ca

POSES = (
    (0.00877, (0.899966, 45.2977, 10.4495), (0.000668069, 0.034438095, 0.133937145)),
    (1.00686, (26.9054, 52.1178, 23.4175), (0.01960497, 0.10478538, 0.2548125)),
    (2.00529, (47.5537, 54.9018, 35.2229), (0.033314355, 0.1456758, 0.29717415)),
    (3.0048, (58.7339, 53.9863, 45.689), (0.03990627, 0.16152345, 0.30121335)),
    (4.00355, (58.2198, 50.0116, 54.7188), (0.03961845, 0.16103745, 0.3001185)),
    (5.0049, (46.1139, 43.8515, 62.2835), (0.032417685, 0.14180265, 0.2880576)),
)
"""Sheet 10: time [s], turn of each section [degrees], all to one side, and its moment about the
arm's base, in the sheet without a unit, read as N m."""

LENGTH, WEIGHT = 0.126, 1.35
"""Of a section in sheet 10 [m, N], where a place is read in centimetres: see `published_rule`."""


FRICTIONS = (0.1, 0.2, 0.4)


@dataclass(frozen=True)
class Torque:
    """A winch's torque at the least and at the greatest length taken in [kg cm]."""

    loading: tuple[float, float] = (0.46, 0.71)
    unloading: tuple[float, float] = (-0.24, 0.07)

    @property
    def middle(self) -> np.ndarray:
        """Return what is elastic, the mean of both (2,) [kg cm]."""
        return 0.5 * (np.array(self.loading) + np.array(self.unloading))

    @property
    def half_gap(self) -> np.ndarray:
        """Return half the gap between both (2,) [kg cm]."""
        return 0.5 * (np.array(self.loading) - np.array(self.unloading))


def published_rule(turns: tuple[float, ...]) -> np.ndarray:
    """Return the moments (sections,) [N m] by the rule that the sheet follows.

    Every section is an arc of `LENGTH` whose `WEIGHT` acts at the middle of its chord.
    """
    place, heading, found = 0.0, 0.0, []
    for turn in np.radians(turns):
        out, down = LENGTH / turn * (1.0 - np.cos(turn)), LENGTH / turn * np.sin(turn)
        aside = np.cos(heading) * out + np.sin(heading) * down
        found.append(WEIGHT * (place + 0.5 * aside))
        place, heading = place + aside, heading + turn
    return np.array(found)


def lighter(vehicle: ca.Vehicle) -> ca.Vehicle:
    """Return the preset with the sheet's lengths and weights, and without its gripper."""
    changes: dict[str, Any] = {"arm.trunk.tip": None}
    for section in vehicle.arms[0].section:
        at = f"arm.trunk.section.{section.name}"
        changes |= {f"{at}.disks": (), f"{at}.length": LENGTH,
                    f"{at}.mass_per_length": WEIGHT / 9.81 / LENGTH}  # fmt: skip
    return vehicle.replace({"arm.trunk.tendon": ()}).replace(changes)


def moment(vehicle: ca.Vehicle, turns: tuple[float, ...]) -> float:
    """Return the moment about the arm's base that holds the level UAV in hover [N m]."""
    bends = [
        [turn / section.length, 0.0]
        for turn, section in zip(np.radians(turns), vehicle.arms[0].section, strict=True)
    ]
    bare = vehicle.replace({"arm.trunk.tendon": ()}) if vehicle.tendons else vehicle
    return float(np.linalg.norm(ca.trim(bare, bend=np.ravel(bends)).moment[:2]))


def moments() -> list[dict[str, Any]]:
    """Return published and predicted moments of all poses [N m]."""
    preset = ca.load_vehicle("aet")
    empty = preset.replace({"arm.trunk.tip": None})
    found = []
    for time, turns, published in POSES:
        found.append({
            "time": time, "turns": list(turns), "published": round(sum(published), 4),
            "rule": round(float(published_rule(turns).sum()), 4),
            "arcs": round(moment(lighter(preset), turns), 4),
            "preset": round(moment(preset, turns), 4),
            "without_gripper": round(moment(empty, turns), 4),
        })  # fmt: skip
    return found


def capstan() -> dict[str, Any]:
    """Return what friction on guides alone says of the winch's torque.

    With an arc of the turn θ that is bent alike on both branches, the tension at the winch is
    (μθ)/(1 - exp(-μθ)) of the mean while it is taken in, and (μθ)/(exp(μθ) - 1) while it is let
    go: their ratio is exp(μθ).
    """
    torque = Torque()
    ratio = torque.loading[1] / torque.unloading[1]
    exponent = float(np.log(ratio))
    turns = {
        f"{degrees:g}": round(exponent / np.radians(degrees), 2) for degrees in (60, 90, 180, 270)
    }
    own = {f"{degrees:g}": round(torque.loading[1] * float(np.exp(-0.2 * np.radians(degrees))), 2)
           for degrees in (60, 90, 180, 270)}  # fmt: skip
    return {"ratio": round(ratio, 1), "mu_theta": round(exponent, 2), "friction": turns,
            "unloading_of_preset": own}  # fmt: skip


def motor() -> dict[str, Any]:
    """Return the fit of a friction of the motor to the short end, and its prediction of the long.

    Torques in kg cm. The long end's loading is given to it: it is what the elastic part is found
    from.
    """
    torque = Torque()
    friction = float(torque.half_gap[0])
    predicted = torque.loading[1] - 2.0 * friction
    return {
        "friction": round(friction, 2), "friction_nm": round(friction * 0.0980665, 3),
        "predicted": round(predicted, 2), "measured": torque.unloading[1],
        "off": round(predicted - torque.unloading[1], 2),
    }  # fmt: skip


def loops() -> list[dict[str, float]]:
    """Return the turn of the preset's arm and its winch's ratio, of slow pulls with some μ.

    One of the outer tendons is pulled with 20 N and let go within 12 s, without gravity; the ratio
    of both tensions is taken where 0.9 of the greatest length is taken in.
    """
    preset = ca.load_vehicle("aet").replace({"uav.rotors": None, "uav.drag": None})
    (arm,), duration, share = preset.arms, 12.0, 0.9
    names = [f"arm.trunk.tendon.{group.name}.friction" for group in arm.tendon]
    pulled = sum(group.count for group in arm.tendon[:-1])

    def command(t: float) -> np.ndarray:
        found = np.zeros(preset.tendons)
        found[pulled] = 20.0 * np.sin(np.pi * t / duration) ** 2
        return found

    slow = ca.Scenario("pulled", np.zeros(preset.layout.coordinates), gravity=0.0,
                       duration=duration, tendon_command=command)  # fmt: skip
    flight = ca.simulate(
        preset.replace(dict.fromkeys(names, np.array(FRICTIONS))), slow, sample=0.06
    )
    found = []
    for run, friction in enumerate(FRICTIONS):
        own = flight.isel(run=run)
        tension = own["tendon_tension"].to_numpy()[:, pulled]
        length = own["tendon_length"].to_numpy()[:, pulled]
        taken = length[0] - length
        most = int(np.argmax(taken))
        bends = np.linalg.norm(own["bend"].to_numpy(), axis=-1)
        turns = bends @ [section.length for section in arm.section]
        at = share * taken[most]
        up, back = slice(None, most + 1), slice(None, most - 1 if most else None, -1)
        ratio = np.interp(at, taken[up], tension[up]) / np.interp(at, taken[back], tension[back])
        turn = float(np.interp(at, taken[up], turns[up]))
        found.append({"friction": friction, "turn": round(float(np.degrees(turn)), 1),
                      "ratio": round(float(ratio), 3),
                      "capstan": round(float(np.exp(friction * turn)), 3)})  # fmt: skip
    return found


def main() -> None:
    """Write results and page."""
    parser = argparse.ArgumentParser(description="Compare with the Aerial Elephant Trunk.")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the pages")
    given = parser.parse_args()
    rows, guides, gears, torque = moments(), capstan(), motor(), Torque()
    pulls = loops()
    published = np.array([row["published"] for row in rows])

    def off(name: str) -> float:
        return rms(np.array([row[name] for row in rows]) / published - 1.0)

    save_results("aet", {"source": "Nature Communications 16:889, 2025; arclab-hku/AET",
                         "moments": rows, "relative_rms": {name: round(off(name), 4) for name in
                         ("rule", "arcs", "preset", "without_gripper")},
                         "guides": guides, "simulated": pulls, "motor": gears})  # fmt: skip
    text = (Path(__file__).parent / "aet.md.in").read_text(encoding="utf-8").format(
        moments=table(
            ("turns of the sections [°]", "published [N m]", "their rule", "arcs of that weight",
             "preset, no gripper", "preset"),
            [[", ".join(f"{turn:.0f}" for turn in row["turns"]),
              *(f"{row[name]:.3f}" for name in
                ("published", "rule", "arcs", "without_gripper", "preset"))] for row in rows]),
        rule=f"{100 * max(off('rule'), 1e-4):.2g}", arcs=f"{100 * off('arcs'):.0f}",
        preset=f"{100 * off('preset'):.0f}", empty=f"{100 * off('without_gripper'):.0f}",
        torques=table(
            ("", "short end [kg cm]", "long end [kg cm]"),
            [["loading, published", *(f"{x:.2f}" for x in torque.loading)],
             ["unloading, published", *(f"{x:.2f}" for x in torque.unloading)],
             ["elastic: their mean", *(f"{x:.3f}" for x in torque.middle)],
             ["half the gap", *(f"{x:.3f}" for x in torque.half_gap)]]),
        guides=table(
            ("turn of the arm θ [°]", "μ that gives the ratio at the long end",
             "unloading predicted with the preset's μ 0.2 [kg cm]"),
            [[degrees, f"{mu:.2f}", f"{guides['unloading_of_preset'][degrees]:.2f}"]
             for degrees, mu in guides["friction"].items()]),
        pulls=table(
            ("μ", "turn of the arm [°]", "loading over unloading, simulated", "exp(μθ)"),
            [[f"{row['friction']:g}", f"{row['turn']:.0f}", f"{row['ratio']:.2f}",
              f"{row['capstan']:.2f}"] for row in pulls]),
        ratio=guides["ratio"], mu_theta=guides["mu_theta"],
        short=f"{torque.loading[0]:.2f}", short_off=f"{2.0 * torque.half_gap[0]:.2f}",
        short_unloading=f"{torque.unloading[0]:.2f}",
        friction=gears["friction"], friction_nm=gears["friction_nm"],
        predicted=f"{gears['predicted']:.2f}", measured=f"{gears['measured']:.2f}",
        off=f"{abs(gears['off']):.2f}",
    )  # fmt: skip
    page = given.out / "validation" / "aet.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
