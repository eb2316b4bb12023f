"""What is tried: every way by which something from outside comes in."""

from pathlib import Path
from typing import Any

import numpy as np

import continuair as ca
from continuair.controllers.gain_files import load_gains
from continuair.identification.recording import load_recording
from continuair.sweeps import load_design
from continuair.sweeps.units import check
from tests.fuzz import rules
from tests.fuzz.mutation import mutated
from tests.fuzz.trial import Attempt

Rng = np.random.Generator
ROOT = Path(__file__).parents[2]
PRESETS = ROOT / "src" / "continuair" / "presets"
GAINS = ROOT / "src" / "continuair" / "controllers" / "presets" / "paper.toml"
DISK = ROOT / "tests" / "sweeps" / "disk.toml"

DESIGN = """name = "two"
vehicle = "paper"
models = ["decoupled"]
rtol = 1e-3
check = true
sample = 2e-3
seed = 3

[scenario]
excitation = "sine"
on = "force_x"
amplitude = 2.0
frequency = 3.0
duration = 0.5
lift = 1.0

[set]
"vehicle.arm.damping_ratio" = 0.02

[[vary]]
"vehicle.uav.mass" = { from = 1.0, to = 3.0, count = 5 }

[[vary]]
dimension = "sample"
sampling = "sobol"
count = 8
"vehicle.arm.radius" = { from = 0.003, to = 0.008, spacing = "log" }
"scenario.kappa" = { from = 0.1, to = 0.5 }
"""


def vehicles(rng: Rng, folder: Path) -> None:
    """A vehicle's file, and a short flight of what it gives."""
    sources = [*sorted(PRESETS.glob("*.toml")), DISK]
    text = mutated(sources[rng.integers(len(sources))].read_text(encoding="utf-8"), rng)
    vehicle = ca.load_vehicle(_written(folder / "vehicle.toml", text))
    rules.check_vehicle(vehicle)
    # Each shape of arms has kernels of its own to compile.
    if rng.random() < (0.01 if vehicle.has_arm_list else 0.1):
        rules.check_flight(ca.simulate(vehicle, _short(rng, vehicle.sections), sample=1e-3))


def designs(rng: Rng, folder: Path) -> None:
    """A design of a sweep; one that is accepted has runs, and can be read back by its rows."""
    design = load_design(_written(folder / "design.toml", mutated(DESIGN, rng)))
    rules.require(design.runs > 0, "a design without runs")
    last = design.rows(np.array([design.runs - 1]))
    rules.require(all(len(values) == 1 for values in last.values()), "a row of no single values")
    if rng.random() < 0.1:
        check(design, "cpu")


def gains(rng: Rng, folder: Path) -> None:
    """A file of gains."""
    text = mutated(GAINS.read_text(encoding="utf-8"), rng)
    path = _written(folder / "gains.toml", text)
    load_gains(path).controller(ca.load_vehicle("paper"))


def recordings(rng: Rng, folder: Path) -> None:
    """A recorded flight as CSV."""
    path = _written(folder / "flight.csv", mutated(_recording(), rng))
    rows = load_recording(path)
    rules.require(bool((np.diff(rows.time) > 0).all()), "times that do not grow")


_FIELDS = ["q", "qd", "force", "moment", "tau", "tip_wrench", "bend_moment", "gravity", "duration",
           "jumps", "seed", "tip_wrench_sign", "controller", "target"]  # fmt: skip
_OPTIONS = ["model", "step", "sample", "duration", "variables", "method", "rtol", "atol",
            "max_step", "check", "dtype", "device", "threads"]  # fmt: skip


def calls(rng: Rng, folder: Path) -> None:
    """Arguments of `simulate` and `Scenario` of every kind."""
    odd: list[Any] = [
        None, True, False, 0, -1, 1.5, float("nan"), float("inf"), 1e-320, 1e308, 10**400, "",
        "auto", "coupled", b"x", [], [1, 2], [[1.0] * 8] * 2, np.zeros(8), np.zeros((2, 8)),
        np.float32(1e-3), np.array(1e-3), np.array([]), 1 + 2j, np.longdouble(1e-3), object(),
        np.ma.masked_array([1.0] * 8, [True] + [False] * 7), lambda t: t, lambda t: np.zeros(3),
        {"a": 1}, np.array(["x"]),
    ]  # fmt: skip

    def some() -> Any:
        return odd[rng.integers(len(odd))]

    fields: dict[str, Any] = {"q": np.zeros(8), "duration": 0.01}
    options: dict[str, Any] = {"sample": 1e-3}
    where = fields if rng.random() < 0.6 else options
    names = _FIELDS if where is fields else _OPTIONS
    where[str(rng.choice(names))] = some()
    flight = ca.simulate(ca.load_vehicle("paper"), ca.Scenario("odd", **fields), **options)
    whole = {"tip_position", "attitude", "bend"} <= set(flight.variables)
    if "run" not in flight.dims and whole:
        rules.check_flight(flight)


def changes(rng: Rng, folder: Path) -> None:
    """One field of a vehicle, replaced."""
    names = ["arm.length", "arm.radius", "arm.density", "arm.youngs_modulus", "arm.damping",
             "arm.damping_ratio", "uav.mass", "uav.inertia", "uav.mount", "camera.position",
             "arm.disks", "arm.kappa_s"]  # fmt: skip
    values: list[Any] = [
        True, -1.0, 0.0, float("nan"), 1e308, 1e-308, 10**400, "x", None, [], [1, 2, 3],
        [True, 1, 1], np.array([1.0, 2.0]), np.full((2, 3), 0.1), [[1, 2], [3]], np.ma.masked,
        float(rng.normal()),
    ]  # fmt: skip
    change = {str(rng.choice(names)): values[rng.integers(len(values))]}
    rules.check_vehicle(ca.load_vehicle("paper").replace(change))


DOMAINS: dict[str, Attempt] = {
    "vehicles": vehicles,
    "designs": designs,
    "gains": gains,
    "recordings": recordings,
    "calls": calls,
    "changes": changes,
}


def _written(path: Path, text: str) -> Path:
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    return path


def _short(rng: Rng, sections: int) -> ca.Scenario:
    q = [0, 0, 0, *rng.uniform(-0.5, 0.5, 3), *[0.1 * rng.normal(), 0] * sections]
    return ca.Scenario("short", q, duration=5e-3)


def _recording() -> str:
    times = 0.01 * np.arange(30)
    rows = [f"{t:g},{np.sin(t):g},0,{1 - t:g},0,0,0,1,0.1,0,1.5" for t in times]
    return "\n".join(["time,x,y,z,qx,qy,qz,qw,bend_x,bend_y,force_x", *rows])
