"""Writes `kane_cases.json`: random vehicles, states and inputs, and what `kane` says of them.

    python -m tests.oracles.make_kane_cases

Every case is drawn from its own name, so that the file is always the same, and cases that it holds
already are kept: after an interruption the rest is made. It takes 80 s in all.

The file is {"nodes", "digits", "step", "cases": [case, ...]}, and a case {"name", "vehicle",
"state", "inputs", "expected"}, the middle three as `kane` takes them. expected has for each of the
models "coupled" and "decoupled" {"acceleration" (3) of the UAV, world axes, inertial,
"angular_acceleration" (3), body axes, "bend_acceleration" (sections, 2)}: known to 1e-28, and
rounded to float64. Solving the exact equations in float64 would miss them by up to 1e-15 of the
norm of each with one section, and by 3e-13 with four.
"""

from __future__ import annotations

import json
import math
import random
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpmath import mp

from tests.oracles.kane import DIGITS, NODES, STEP, equations, solved

FILE = Path(__file__).with_name("kane_cases.json")
MODELS = ("coupled", "decoupled")
_NOTHING = 1e-25


@dataclass(frozen=True)
class Kind:
    """What cases have.

    bends: ranges of a section's bend [rad], which sections take in turn; rate: the largest spin
    and the largest rate of a section's bend [rad/s], per component.
    """

    bends: tuple[tuple[float, float], ...]
    rate: float = 0.0
    gravity: float = 9.81
    pushed: bool = False
    disks: bool = False
    tips: bool = False
    tilted: bool = False


STRAIGHT, BARELY, BENT, FAR = (0.0, 0.0), (1e-9, 1e-9), (0.2, 1.8), (3.5, 5.0)
ALL = {"pushed": True, "disks": True, "tips": True, "tilted": True}
SHAPES = ((1,), (2,), (3,), (4,), (1, 1), (2, 2), (1, 3))
KINDS = {
    "straight, at rest": Kind((STRAIGHT,)),
    "straight, pushed": Kind((STRAIGHT,), gravity=0.0, pushed=True, tips=True),
    "straight, swinging": Kind((STRAIGHT,), rate=4.0, disks=True),
    "nearly straight": Kind((BARELY,), rate=4.0, **ALL),
    "bent, at rest, pushed": Kind((BENT,), pushed=True, tilted=True),
    "bent, swinging": Kind((BENT,), rate=4.0, gravity=0.0, disks=True),
    "bent, all at once": Kind((BENT,), rate=4.0, **ALL),
    "far bent, all at once": Kind((FAR,), rate=15.0, **ALL),
    "of all bends": Kind((STRAIGHT, BARELY, BENT, FAR), rate=8.0, gravity=0.0, **ALL),
}
PLAIN_KINDS = {
    "nearly straight, level mount": Kind((BARELY,), rate=4.0, pushed=True, disks=True),
    "far bent, level mount": Kind((FAR,), rate=15.0, pushed=True, disks=True),
}
PLAIN_SHAPES = ((1,), (2,))


def main() -> None:
    """Make what the file lacks, one case after the other."""
    known = held() if FILE.exists() else {}
    cases = []
    for case in drawn():
        before = known.pop(case["name"], None)
        if before and all(before[part] == case[part] for part in ("vehicle", "state", "inputs")):
            case = before
        else:
            print(case["name"], flush=True)
            case["expected"] = expected(case)
        cases.append(case)
        write(cases + list(known.values()))
    write(cases)


def held() -> dict[str, Any]:
    """The cases of the file, by name."""
    return {case["name"]: case for case in json.loads(FILE.read_text())["cases"]}


def drawn() -> list[dict[str, Any]]:
    """All cases, without what is expected."""
    plan = [(shape, kind) for shape in SHAPES for kind in KINDS.items()]
    plan += [(shape, kind) for shape in PLAIN_SHAPES for kind in PLAIN_KINDS.items()]
    return [draw(shape, name, kind) for shape, (name, kind) in plan]


def expected(case: dict[str, Any]) -> dict[str, Any]:
    """What `kane` says of a case, by model, rounded to float64."""
    with mp.workdps(DIGITS):
        rows = equations(case["vehicle"], case["state"], case["inputs"])
        return {model: _named(solved(rows, model)) for model in MODELS}


def _named(found: list[Any]) -> dict[str, Any]:
    """By name; what is less than differences can tell is zero."""
    rows = [float(x) if abs(x) > _NOTHING else 0.0 for x in found]
    return {
        "acceleration": rows[:3],
        "angular_acceleration": rows[3:6],
        "bend_acceleration": [rows[i : i + 2] for i in range(6, len(rows), 2)],
    }


def write(cases: list[dict[str, Any]]) -> None:
    """The file, a line per case; it is replaced in one go."""
    lines = ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases)
    head = json.dumps({"nodes": NODES, "digits": DIGITS, "step": STEP})[:-1]
    part = FILE.with_suffix(".part")
    part.write_text(f'{head}, "cases": [\n{lines}\n]}}\n')
    part.replace(FILE)


def draw(shape: tuple[int, ...], kind_name: str, kind: Kind) -> dict[str, Any]:
    """A case of one or more arms of so many sections."""
    name = f"{'+'.join(map(str, shape))}: {kind_name}"
    rng = random.Random(f"kane {name}")
    vehicle = _vehicle(rng, shape, kind)
    sections = [section for arm in vehicle["arms"] for section in arm["sections"]]
    lengths = [section["length"] for section in sections]
    order = rng.sample(kind.bends, len(kind.bends))
    spread = [order[i % len(order)] for i in range(len(sections))]
    push = float(kind.pushed)
    state = {
        "attitude": _unit(rng, 4),
        "bend": [
            _scaled(rng.uniform(*ends) / length, _unit(rng, 2))
            for ends, length in zip(spread, lengths, strict=True)
        ],
        "velocity": _within(rng, 3, 5.0 * (kind.rate > 0)),
        "angular_velocity": _within(rng, 3, kind.rate),
        "bend_rate": [_within(rng, 2, kind.rate / length) for length in lengths],
    }
    inputs = {
        "force": _within(rng, 3, 30.0 * push),
        "moment": _within(rng, 3, push),
        "bend_moment": [
            _within(rng, 2, push * section["bending_stiffness"] * 2.0) for section in sections
        ],
        "tip_wrench": [[*_within(rng, 3, 5 * push), *_within(rng, 3, 0.2 * push)] for _ in shape],
        "gravity": kind.gravity,
    }
    return {"name": name, "vehicle": vehicle, "state": state, "inputs": inputs}


def _vehicle(rng: random.Random, shape: tuple[int, ...], kind: Kind) -> dict[str, Any]:
    mass = _digits(rng.uniform(0.5, 4.0))
    uav = {"mass": mass, "inertia": _inertia(rng, mass, 0.04 + 0.04 * mass)}
    return {"uav": uav, "arms": [_arm(rng, sections, kind) for sections in shape]}


def _arm(rng: random.Random, sections: int, kind: Kind) -> dict[str, Any]:
    """An arm whose sections are alike within 30 %, of 6 to 40 rad/s if it were a single one."""
    length, mass = rng.uniform(0.2, 1.0), rng.uniform(0.03, 0.3)
    frequency, damping_ratio = rng.uniform(6.0, 40.0), rng.uniform(0.0, 0.1)
    stiffness = frequency**2 * mass * length**4 / 20.0
    parts = []
    for _ in range(sections):
        part, heavy, stiff = (rng.uniform(0.7, 1.3) for _ in range(3))
        section_length = _digits(part * length / sections)
        section = {
            "length": section_length,
            "bending_stiffness": _digits(stiff * stiffness),
            "mass_per_length": _digits(heavy * mass),
            "radius": _digits(rng.uniform(0.002, 0.012)),
            "damping": _digits(2.0 * damping_ratio * stiff * stiffness / frequency),
            "disks": _disks(rng, section_length) if kind.disks else [],
        }
        parts.append(section)
    attitude = _unit(rng, 4) if kind.tilted else [0.0, 0.0, 0.0, 1.0]
    tip = _tip(rng) if kind.tips else None
    return {"mount": _within(rng, 3, 0.15), "attitude": attitude, "sections": parts, "tip": tip}


def _disks(rng: random.Random, length: float) -> list[dict[str, Any]]:
    """Up to three disks of 5 mm thickness, the last at the end in half of the sections."""
    places = sorted(_digits(rng.uniform(0.0, 0.99) * length) for _ in range(rng.randint(0, 2)))
    places += [length] if rng.random() < 0.5 else []
    found = []
    for place in places:
        mass, square = rng.uniform(0.005, 0.05), rng.uniform(0.01, 0.03) ** 2
        transverse = _digits(mass * (square / 4.0 + 0.005**2 / 12.0))
        inertia = [transverse, _digits(mass * square / 2.0)]
        found.append({"position": place, "mass": _digits(mass), "inertia": inertia})
    return found


def _tip(rng: random.Random) -> dict[str, Any]:
    """A rigid body on the tip, off its axis."""
    mass = _digits(rng.uniform(0.03, 0.4))
    centre = [*_within(rng, 2, 0.04), _digits(rng.uniform(0.0, 0.08))]
    return {"mass": mass, "centre": centre, "inertia": _inertia(rng, mass, 0.03)}


def _inertia(rng: random.Random, mass: float, size: float) -> list[list[float]]:
    """Of a cloud of eight points: a full matrix that a rigid body can have."""
    points = [[rng.gauss(0.0, size) for _ in range(3)] for _ in range(8)]
    share = mass / len(points)
    square = share * sum(x * x for point in points for x in point)
    second = [[share * sum(p[i] * p[j] for p in points) for j in range(3)] for i in range(3)]
    return [[_digits(square * (i == j) - second[i][j]) for j in range(3)] for i in range(3)]


def _unit(rng: random.Random, n: int) -> list[float]:
    """A direction, or an attitude as x y z w."""
    # Short numbers, a square root and a quotient are the same on every machine.
    numbers = [_digits(rng.gauss(0.0, 1.0)) for _ in range(n)]
    return [x / math.sqrt(sum(x * x for x in numbers)) for x in numbers]


def _scaled(factor: float, numbers: list[float]) -> list[float]:
    return [_digits(factor * x) for x in numbers]


def _within(rng: random.Random, n: int, size: float) -> list[float]:
    return [_digits(rng.uniform(-size, size)) for _ in range(n)]


def _digits(x: float) -> float:
    """Rounded to five digits, for a short file."""
    return float(f"{x:.5g}") + 0.0


if __name__ == "__main__":
    main()
