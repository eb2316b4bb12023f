"""Write the tables of docs/explanation/real_arm.md and draw its figure, in twenty minutes."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.lines import Line2D

import continuair as ca
from continuair.equations.camera import facing
from continuair.figures import style
from continuair.typing import Array, Model

DOCS = Path(__file__).parent
START, END = "<!-- written by make_real_arm.py -->\n", "<!-- to here -->\n"

TOLERANCE = 0.02
"""Error of the tip in arm lengths and in rad up to which `advise` calls a model good enough."""

MODELS: tuple[Model, ...] = ("decoupled", "independent")
FREQUENCIES = (0.5, 1.0, 2.0)
SWING = np.array([1.5, 0.0, 1.5, 0.0])
"""Bends that the actuation holds at its peak [1/m]."""

Kind = Literal["loop", "letter", "open"]

KINDS: dict[Kind, int] = {"loop": 1 + len(FREQUENCIES), "letter": 1, "open": len(FREQUENCIES)}
"""Kind of flights -> columns that it fills, in order."""

PROCESSES = 2

DURATION, SAMPLE, ATTACH = 4.0, 0.01, 1.5
LETTER, WRITTEN = "M", 20.0
"""The letter, and how long it takes [s]."""

PUSH, PUSHED = 0.05, (0.5, 1.5)
"""Lateral push of the hover, over the weight, and from when to when [s]."""

TIP = "tip_position"
HEIGHT = 1.0

DISKS = {"count": 7, "mass": 0.008}
SECTIONS: tuple[dict[str, Any], ...] = (
    {"name": "base", "length": 0.2, "mass_per_length": 0.05, "bending_stiffness": 0.12},
    {"name": "tip", "length": 0.2, "mass_per_length": 0.03, "bending_stiffness": 0.08},
)
LENGTH = 0.4
"""Of the arm [m]."""
PULLED = {"guides": "disks", "pretension": 2.0, "limits": [0.5, 60.0]}
WOUND = {"guides": "disks", "pretension": 0.3, "limits": [0.0, 60.0]}
WOUND |= {"command": "length", "stiffness": 5000.0}
ROTORS = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 14.0]}
ROTORS |= {"torque_per_thrust": 0.016, "lag": 0.04}

CARRIED = 0.15
PARCEL, NEVER = (
    ca.Payload(mass=CARRIED, attach=attach, centre=[0.0, 0.0, 0.02]) for attach in (ATTACH, 1e6)
)
WALL = ca.Plane(
    point=[0.005, 0.0, 0.0], normal=[-1.0, 0.0, 0.0], stiffness=1e4, damping=0.5, friction=0.4
)
NOWHERE = replace(WALL, point=[1e6, 0.0, 0.0])
"""A wall out of reach. With it, and a payload after the flight, the same kernels serve."""

ACTUATIONS: dict[str, dict[str, Any] | None] = {
    "moments": None,
    "tendons": PULLED,
    "winches": WOUND,
}
"""Actuation -> its tendons."""

TASKS: dict[str, dict[str, Any]] = {
    "": {"payload": NEVER, "obstacles": [NOWHERE]},
    "payload": {"payload": PARCEL, "obstacles": [NOWHERE]},
    "wall": {"payload": NEVER, "obstacles": [WALL]},
}

Row = tuple[str, float, str]

ROWS: dict[Row, str] = {
    ("moments", 0.0, ""): "ideal moments",
    ("tendons", 0.0, ""): "tendons, no friction",
    ("tendons", 0.1, ""): "tendons, friction 0.1",
    ("tendons", 0.3, ""): "tendons, friction 0.3",
    ("winches", 0.0, ""): "winches, slack",
    ("moments", 0.0, "payload"): "ideal moments, payload",
    ("tendons", 0.1, "payload"): "friction 0.1, payload",
    ("moments", 0.0, "wall"): "ideal moments, wall",
    ("tendons", 0.1, "wall"): "friction 0.1, wall",
}
"""(actuation, friction, task) -> name of the row."""

COLUMNS = (
    "hover",
    *(f"loop, {f:g} Hz" for f in FREQUENCIES),
    f"letter {LETTER}",
    *(f"{f:g} Hz" for f in FREQUENCIES),
)

Found = dict[str, Any]
"""Tip, errors and other numbers of a flight by name; empty where a row has no such flight."""


def main() -> None:
    jobs = [(actuation, kind) for actuation in ("tendons", "winches", "moments") for kind in KINDS]
    # Most of the time goes into compiling kernels.
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        flown = dict(zip(jobs, pool.map(_flown, *zip(*jobs, strict=True)), strict=True))
    found = {row: _joined(row, flown) for row in ROWS}
    style.save_as(_figure(found), DOCS / "images" / "real_arm.png")
    page = DOCS / "explanation" / "real_arm.md"
    before, rest = page.read_text(encoding="utf-8").split(START)
    after = rest.split(END, 1)[1]
    page.write_text(before + START + "\n".join(_tables(found)) + "\n" + END + after, "utf-8")


def _vehicle(actuation: str, loop: bool) -> ca.Vehicle:
    """Return the trunk with its actuation, and with rotors in the loop."""
    three = 2.0 * np.pi / 3.0 * np.arange(3)
    tendon = ACTUATIONS[actuation]
    arm: dict[str, Any] = {
        "name": "trunk",
        "mount": [0.0, 0.0, -0.05],
        "section": [{"damping_ratio": 0.2, "disks": DISKS, **part} for part in SECTIONS],
    }
    if tendon is not None:
        outer = three + np.pi / 3.0
        arm["tendon"] = [
            {"name": "inner", "section": "base", "angles": three, "offset": 0.02, **tendon},
            {"name": "outer", "angles": outer, "offset": [0.02, 0.015], **tendon},
        ]
    uav: dict[str, Any] = {"mass": 2.2, "inertia": [0.022, 0.022, 0.038]}
    return ca.Vehicle(name="trunk", uav=uav | ({"rotors": ROTORS} if loop else {}), arm=[arm])


@cache
def _held(actuation: str) -> tuple[Array, Array]:
    """Return shares of the swing, and the moments or commands that hold them."""
    vehicle, shares = _vehicle(actuation, False), np.linspace(-1.0, 1.0, 81)
    if actuation == "moments":
        held = [ca.trim(vehicle, bend=share * SWING).bend_moment for share in shares]
    else:
        held = [ca.tendon_tensions(vehicle, share * SWING).command for share in shares]
    return shares, np.array(held)


def _command(actuation: str, rates: Array) -> Callable[[float], Array]:
    """Return the moments or commands of each run, of its frequency [Hz], over time."""
    shares, held = _held(actuation)

    def at(time: float) -> Array:
        share = np.sin(2.0 * np.pi * rates * time)
        return np.column_stack([np.interp(share, shares, each) for each in held.T])

    return at


def _letter(actuation: str, task: str) -> ca.Scenario:
    """Return a flight whose camera follows the letter, from where it sees its start."""
    vehicle = _vehicle(actuation, True)
    target = ca.Target(ca.paths.letter(LETTER, duration=WRITTEN))
    start = np.zeros(vehicle.layout.coordinates)
    start[:3], start[3:6] = facing(vehicle, target.path([0.0])[0][0], target.distance)
    carried = {"payload": TASKS[task]["payload"]} if (actuation, task) in _loaded() else {}
    # One controller for all, which bends the arm through its actuation.
    law = ca.twist_servoing(_vehicle("moments", True))
    return ca.Scenario(
        task or "free", start, controller=law, target=target, duration=WRITTEN, **carried
    )


def _loaded() -> set[tuple[str, str]]:
    """Return (actuation, task) of all flights of actuations that some row gives a payload."""
    return {(row[0], task) for row in ROWS if row[2] for task in TASKS}


def _scenario(actuation: str, task: str, kind: Kind, frictions: int) -> ca.Scenario:
    """Return the flights of all frequencies, in the loop after the hover, for each friction."""
    if kind == "letter":
        return _letter(actuation, task)
    loop = kind == "loop"
    vehicle = _vehicle(actuation, loop)
    rates = np.tile([0.0, *FREQUENCIES] if loop else FREQUENCIES, frictions)
    start = np.zeros(vehicle.layout.coordinates)
    start[2] = HEIGHT
    weight = 9.81 * vehicle.mass
    command = "bend_moment" if actuation == "moments" else "tendon_command"
    fields: dict[str, Any] = {command: _command(actuation, rates)}
    if (actuation, task) in _loaded():
        fields |= TASKS[task]

    def push(time: float) -> Array:
        inside = (time - PUSHED[0]) / (PUSHED[1] - PUSHED[0])
        shape = 0.5 - 0.5 * np.cos(2.0 * np.pi * inside) if 0.0 < inside < 1.0 else 0.0
        return np.outer(rates == 0.0, [PUSH * weight * shape, 0.0, 0.0])

    def lift(time: float) -> list[float]:
        carried = 9.81 * CARRIED if task == "payload" and time >= ATTACH else 0
        return [0.0, 0.0, weight + carried]

    if loop:
        # One controller for all, which leaves the arm to its actuation.
        law = ca.flight_controller(_vehicle("moments", True), bend_bandwidth=0.0)
        fields |= {"controller": law, "force": push, "jumps": PUSHED}
    else:
        fields |= {"force": lift, "jumps": (ATTACH,) if task == "payload" else ()}
    return ca.Scenario(task or "free", start, duration=DURATION, **fields)


def _frictions(actuation: str, task: str) -> list[float]:
    """Return the coefficients of friction that are flown together."""
    return [row[1] for row in ROWS if (row[0], row[2]) == (actuation, task)]


def _flown(actuation: str, kind: Kind) -> dict[str, list[Found]]:
    """Fly all tasks of an actuation, and return what is found of each."""
    return {task: _task(actuation, task, kind) for task in TASKS if _frictions(actuation, task)}


def _task(actuation: str, task: str, kind: Kind) -> list[Found]:
    """Fly every model, and return what is found of each run, friction by friction."""
    frictions, each = _frictions(actuation, task), KINDS[kind]
    if kind == "letter" and task == "wall":
        # The letter is wider than the way to the wall.
        return [{} for _ in frictions]
    scenario = _scenario(actuation, task, kind, len(frictions))
    vehicle = _vehicle(actuation, kind != "open")
    if any(frictions):
        rubs = np.repeat(frictions, each)
        fields = {f"arm.trunk.tendon.{name}.friction": rubs for name in ("inner", "outer")}
        vehicle = vehicle.replace(fields)
    options: dict[str, Any] = {"sample": SAMPLE, "threads": 1}
    coupled = ca.simulate(vehicle, scenario, **options)
    coupled = coupled if "run" in coupled.dims else coupled.expand_dims("run")
    found: list[Found] = []
    for run in range(each * len(frictions)):
        flight = coupled.isel(run=run)
        one: Found = {"tip": flight[TIP].to_numpy().reshape(-1, 3)}
        one["bends"] = np.abs(flight["bend"].to_numpy()).max()
        if "tendon_slack" in flight:
            # Beyond rounding: a tendon without a winch is never longer than its path.
            one["slack"] = float((flight["tendon_slack"] > 1e-6).mean())
        if task == "wall":
            force = np.linalg.norm(flight["contact_force"].to_numpy().reshape(-1, 3), axis=1)
            one |= {"force": force.max(), "touches": (force > 0.0).mean()}
        if kind == "letter":
            one["pixels"] = float(np.sqrt((flight["feature_error"] ** 2).mean()))
        found.append(one)
    for model in MODELS:
        other = ca.simulate(vehicle, scenario, model=model, **options)
        other = other if "run" in other.dims else other.expand_dims("run")
        off = {name: np.ravel(value) for name, value in ca.compare(coupled, other).items()}
        for run, one in enumerate(found):
            tip, angle = float(off["rmse_t_m"][run]) / LENGTH, float(off["angle_rad"][run])
            # NaN where a flight ended early.
            error = float(np.nan_to_num(np.maximum(tip, angle), nan=np.inf))
            one[model] = {"error": error, "tip": tip, "angle": angle}
            one[model]["nrmse_t"] = float(off["nrmse_t"][run])
    return found


def _joined(row: Row, flown: dict[Any, Any]) -> list[Found]:
    """Return what was found of a row, column by column."""
    actuation, friction, task = row
    number = _frictions(actuation, task).index(friction)
    found = []
    for kind, each in KINDS.items():
        found += flown[actuation, kind][task][number * each : (number + 1) * each]
    return found


def _ideal(row: Row) -> Row:
    """Return the row of ideal moments in the same task."""
    return "moments", 0.0, row[2]


def _apart(one: Found, other: Found) -> float:
    """Return the RMS distance of two tips [m]."""
    return float(np.sqrt(np.mean(np.sum((one["tip"] - other["tip"]) ** 2, axis=1))))


def _good(one: Found, model: str) -> bool:
    return bool(one[model]["error"] <= TOLERANCE)


def _differ(row: list[Found], other: list[Found], model: str) -> list[bool]:
    """Return, of each flight that is flown, whether the verdicts of two rows differ."""
    pairs = zip(row, other, strict=True)
    return [_good(own, model) != _good(ideal, model) for own, ideal in pairs if own]


def _tables(found: dict[Row, list[Found]]) -> list[str]:
    lines: list[str] = []
    plain = found["moments", 0.0, ""]
    for model in MODELS:
        lines += [f"Error of `{model}` [%]:", "", *_heads()]
        for row, columns in found.items():
            cells = []
            for own, ideal in zip(columns, plain, strict=True):
                if not own:
                    cells.append(MISSING)
                    continue
                text = _percent(own[model]["error"])
                text = f"**{text}**" if _good(own, model) else text
                cells.append(text + (" ≠" if _good(own, model) != _good(ideal, model) else ""))
            lines.append(_line(row, cells))
        lines.append("")
    lines += ["The same for `decoupled` as `nrmse_t` [%]:", "", *_heads()]
    for row, columns in found.items():
        cells = [_percent(own["decoupled"]["nrmse_t"]) if own else MISSING for own in columns]
        lines.append(_line(row, cells))
    lines += ["", "How far the coupled flight is from that with ideal moments [mm (% of the arm)]:"]
    lines += ["", *_heads()]
    for row, columns in found.items():
        reference = plain if row == _ideal(row) else found[_ideal(row)]
        pairs = zip(columns, reference, strict=True)
        off = [1e3 * _apart(own, ideal) if own else None for own, ideal in pairs]
        cells = [
            MISSING
            if each is None or row == _ideal(("", 0.0, ""))
            else f"{style.short(each)} ({style.short(0.1 * each / LENGTH)})"
            for each in off
        ]
        lines.append(_line(row, cells))
    lines += ["", *_sentences(found)]
    return lines


def _sentences(found: dict[Row, list[Found]]) -> list[str]:
    """Return what else the flights show, and how many verdicts change."""
    plain = found["moments", 0.0, ""]
    lines = []
    for model in MODELS:
        changed = {name: _differ(found[row], plain, model) for row, name in ROWS.items()}
        same_task = [
            each
            for row in ROWS
            if row != _ideal(row)
            for each in _differ(found[row], found[_ideal(row)], model)
        ]
        every = [
            each for row in ROWS if row != _ideal(("", 0.0, "")) for each in changed[ROWS[row]]
        ]
        differ = [f"{name} {sum(each)}" for name, each in changed.items() if any(each)]
        lines.append(
            f"* `{model}`: {sum(every)} of {len(every)} verdicts differ from that with ideal "
            f"moments{' (' + '; '.join(differ) + ')' if differ else ''}. Against ideal moments in "
            f"the same task it is {sum(same_task)} of {len(same_task)}."
        )
    ratios = [
        own["decoupled"]["error"] / ideal["decoupled"]["error"]
        for row in ROWS
        if row[0] == "tendons" and not row[2]
        for own, ideal in zip(found[row], plain, strict=True)
    ]
    slack = [100.0 * own["slack"] for own in found["winches", 0.0, ""]]
    walls = [own for row in ROWS if row[2] == "wall" for own in found[row] if own]
    pixels = [own["pixels"] for row in found.values() for own in row if "pixels" in own]
    lines += [
        f"* Tendons whose tension is commanded change the error of `decoupled` by factors of "
        f"{min(ratios):.2g} to {max(ratios):.2g}.",
        "* Tendons of the winches are slack for "
        + ", ".join(f"{share:.0f} % ({name})" for share, name in zip(slack, COLUMNS, strict=True))
        + " of all samples and tendons.",
        f"* The wall is touched for {100.0 * min(own['touches'] for own in walls):.0f} to "
        f"{100.0 * max(own['touches'] for own in walls):.0f} % of a flight, with up to "
        f"{max(own['force'] for own in walls):.1f} N.",
        f"* The camera follows the letter with {min(pixels):.0f} to {max(pixels):.0f} px RMS.",
    ]
    return lines


MISSING = "–"
"""The cell of a flight that is not flown, or not compared."""


def _percent(value: float) -> str:
    """Return two digits of a share in per cent, or "ended" for a flight that ended early."""
    if not np.isfinite(value):
        return "ended"
    return style.short(100.0 * value)


def _heads() -> list[str]:
    return [f"| | {' | '.join(COLUMNS)} |", "| --- |" + " ---: |" * len(COLUMNS)]


def _line(row: Row, cells: list[str]) -> str:
    return f"| {ROWS[row]} | {' | '.join(cells)} |"


def _figure(found: dict[Row, list[Found]]) -> Any:
    """Draw the decoupled model's error of every row and flight against the tolerance."""
    colours = [style.MODELS[name]["color"] for name in style.MODELS]
    looks = [("D", style.PAPER_COLOUR, style.PAPER_COLOUR)]
    looks += [("o", colour, colour) for colour in colours]
    looks += [("^", style.PAPER_COLOUR, "white")]
    looks += [("s", colour, "white") for colour in colours]
    with style.applied():
        figure = style.new_figure(style.PAGE_WIDTH, 3.0)
        axes = figure.subplots()
        places = np.arange(len(found), dtype=float)
        shifts = 0.09 * (np.arange(len(COLUMNS)) - 0.5 * (len(COLUMNS) - 1))
        handles = []
        for column, (mark, edge, face) in enumerate(looks):
            values = [
                100.0 * own[column]["decoupled"]["error"] if own[column] else np.nan
                for own in found.values()
            ]
            whole: dict[str, Any] = {"color": edge, "markerfacecolor": face, "markersize": 4.5}
            axes.plot(places + shifts[column], values, mark, **whole)
            words = ("open, " if column > len(FREQUENCIES) + 1 else "") + COLUMNS[column]
            handles.append(Line2D([], [], marker=mark, linestyle="", label=words, **whole))
        axes.axhline(100.0 * TOLERANCE, color=style.FAILED_COLOUR, linewidth=1.0)
        axes.text(
            places[-1] + 0.48, 100.0 * TOLERANCE * 1.06, f"{100.0 * TOLERANCE:g} %", ha="right",
            color=style.FAILED_COLOUR, size=7,
        )  # fmt: skip
        for edge in places[1:] - 0.5:
            axes.axvline(edge, color="#e4e4e4", linewidth=0.5)
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_xticks(places, [ROWS[row].replace(", ", ",\n") for row in found])
        axes.tick_params(axis="x", length=0)
        axes.grid(visible=False, axis="x")
        axes.set_xlim(places[0] - 0.5, places[-1] + 0.5)
        axes.set_ylabel("error of the decoupled tip [%]")
        style.head(
            figure,
            _finding(found),
            "Larger of the tip's distance over the arm's length and of its angle in rad, RMS of "
            "the flight. Loop, letter: with rotors; open: constant lift.",
            handles=handles,
        )
    return figure


def _finding(found: dict[Row, list[Found]]) -> str:
    plain = found["moments", 0.0, ""]
    rows = [row for row in found if row != ("moments", 0.0, "")]
    changed = [each for row in rows for each in _differ(found[row], plain, "decoupled")]
    return f"A real arm changes {sum(changed)} of {len(changed)} verdicts on decoupling"


if __name__ == "__main__":
    main()
