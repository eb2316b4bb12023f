# mypy: disable-error-code="valid-type, attr-defined, no-untyped-def, untyped-decorator"
# mypy: disable-error-code="var-annotated, name-defined"
"""Packs of runs against single runs, and against themselves: a run is the same in any of them.

Warp reads annotations as types, so they are not postponed here.
"""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import warp as wp

import continuair as ca
import continuair.errors
from continuair.device.elementary import elementary_code
from continuair.device.numbers import LANES, NARROW, Numbers, number_code
from continuair.engine import engine as engines
from continuair.engine import packs
from continuair.engine.compiling import load, start_warp
from continuair.engine.engine import Drive, Engine, Logs, Start
from continuair.engine.factory import deviation
from continuair.engine.lanes import packs_of
from continuair.flight.time_grid import grid_of, marks_of
from continuair.kernels.sensing.sense import LawCode
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import AIR, GENERAL, PAPER, ROTORS, TIP

pytestmark = pytest.mark.targets

RUNS = 11
"""More than a pack in float64, so that the last one is not full; and not a whole one in float32."""

SOURCE = Path(continuair.errors.__file__).parents[1]
PAPER_ARM = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})


def batch(vehicle: ca.Vehicle) -> ca.Vehicle:
    return vehicle.replace({"uav.mass": np.linspace(1.0, 3.0, RUNS)})


def fly(
    vehicle: ca.Vehicle, model: str, dtype: str = "float64", chosen: Any = slice(None),
    threads: int = 1, spoiled: int | None = None, stiff: float = 1.0, method: str = "RK4",
) -> Logs:  # fmt: skip
    """Some of RUNS runs that differ in all, under all groups of inputs; everything observed.

    spoiled: a run whose inputs are not numbers; stiff: a factor on one run's bend moment.
    """
    engine = Engine(vehicle, model, dtype, threads=threads, method=method)
    layout, rng = engine.layout, np.random.default_rng(7)
    q, qd = rng.uniform(-0.5, 0.5, (2, RUNS, 6 + layout.bends))
    table = rng.uniform(-0.3, 0.3, (1, RUNS, layout.inputs))
    table[0, 3, layout.bend_moment] *= stiff
    if spoiled is not None:
        table[0, spoiled] = np.nan
    runs = np.arange(RUNS)[chosen]
    states = np.hstack(
        [state_from_paper(q, qd, layout), rng.uniform(0.3, 0.9, (RUNS, layout.rotors))]
    )
    start = Start(states[chosen], branches_of(q, layout)[chosen])
    grid = grid_of(marks_of(0.02, 0.004), 5e-4)
    groups = GENERAL + PAPER + TIP + AIR * layout.air + ROTORS * (layout.rotors > 0)
    drive = Drive(table[:, chosen], False, groups, 9.81)
    return engine.roll_out(runs, start, grid, drive, at_samples=drive)


def rates(vehicle: ca.Vehicle, model: str) -> np.ndarray:
    """Of states that differ, one of them bent beyond a full circle, under all groups of inputs."""
    engine, rng = Engine(vehicle, model), np.random.default_rng(8)
    layout = engine.layout
    q, qd = rng.uniform(-1.0, 1.0, (2, RUNS, 6 + layout.bends))
    q[2, 6] = 20.0
    table = rng.uniform(-1.0, 1.0, (1, RUNS, layout.inputs))
    start = Start(state_from_paper(q, qd, layout), branches_of(q, layout))
    return engine.derivative(start, Drive(table, False, GENERAL + PAPER + TIP, 9.81), compiled=True)


def one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "lanes_of", lambda *_: 1)


def assert_equal(found: Logs, expected: Logs, dtype: str) -> None:
    """To rounding, of the largest value of each column."""
    room = 1e-11 if dtype == "float64" else 2e-4
    np.testing.assert_array_equal(found.status, expected.status)
    np.testing.assert_array_equal(found.last_step, expected.last_step)
    for name in ("log", "observed", "saturation"):
        a, b = getattr(found, name), getattr(expected, name)
        np.testing.assert_array_equal(np.isfinite(a), np.isfinite(b))
        size = np.nanmax(np.abs(b), axis=tuple(range(b.ndim - 1)), where=np.isfinite(b), initial=1)
        assert np.nanmax(np.where(np.isfinite(b), np.abs(a - b), 0.0) / size) < room, name


VEHICLES = {"paper": PAPER_ARM, "two_section": ca.load_vehicle("two_section")}
VEHICLES["dual_arm"] = ca.load_vehicle("dual_arm")
VEHICLES["quad"] = ca.load_vehicle("slender").replace(
    {
        "uav.rotors": {
            "layout": "quad_x",
            "lever": 0.2,
            "thrust_limits": [0.1, 12.0],
            "torque_per_thrust": 0.02,
            "lag": 0.03,
        },
        "uav.drag": {"linear": [0.2, 0.3, 0.1], "quadratic": [0.1, 0.1, 0.2]},
    }
)
CASES = [("paper", model, "float64") for model in ca.MODELS]
CASES += [
    ("paper", "coupled", "float32"),
    ("two_section", "coupled", "float64"),
    ("quad", "coupled", "float64"),
]
OTHERS = [("dual_arm", "decoupled", "float64"), ("two_section", "independent", "float64")]
OTHERS += [("paper", model, "float32") for model in ("decoupled", "independent")]


@pytest.mark.long
@pytest.mark.parametrize(
    ("vehicle", "model", "dtype"),
    [*CASES, *(pytest.param(*case, marks=pytest.mark.soak) for case in OTHERS)],
)
def test_packs_are_single_runs_to_rounding(
    vehicle: str, model: str, dtype: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All groups of inputs; one run is bent beyond a full circle and ends among the others."""
    flown = fly(batch(VEHICLES[vehicle]), model, dtype, stiff=1e5)
    one_by_one(monkeypatch)
    alone = fly(batch(VEHICLES[vehicle]), model, dtype, stiff=1e5)
    assert alone.status[3] != 0 and (alone.status == 0).sum() >= RUNS - 2
    assert_equal(flown, alone, dtype)


@pytest.mark.long
@pytest.mark.parametrize(
    ("vehicle", "model", "dtype"),
    [
        ("two_section", "coupled", "float64"),
        ("paper", "independent", "float32"),
        pytest.param("dual_arm", "decoupled", "float64", marks=pytest.mark.soak),
    ],
)
def test_packs_of_implicit_steps_are_single_runs_to_rounding(
    vehicle: str, model: str, dtype: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    many = batch(VEHICLES[vehicle])
    flown = fly(many, model, dtype, method="implicit")
    part, state = fly(many, model, dtype, chosen=[4, 5, 9], method="implicit"), many.layout.state
    # Polar coordinates of the log, and the roll, only name branches.
    np.testing.assert_array_equal(part.log[..., :state], flown.log[[4, 5, 9], :, :state])
    one_by_one(monkeypatch)
    alone = fly(many, model, dtype, method="implicit")
    assert (alone.status == 0).all()
    assert_equal(flown, alone, dtype)


@pytest.mark.parametrize("model", ["coupled", "independent"])
@pytest.mark.parametrize("threads", [1, 3])
def test_a_run_has_the_same_bits_in_any_batch_and_place(model: str, threads: int) -> None:
    """Alone, in narrow packs, in another lane and in parts of several threads."""
    vehicle = batch(PAPER_ARM)
    whole = fly(vehicle, model)
    for chosen in ([4], [4, 5, 9], [9, 8, 7, 6, 5, 4, 3, 2, 1, 0], list(range(RUNS))):
        part = fly(vehicle, model, chosen=chosen, threads=threads)
        for name in ("log", "observed", "saturation", "status", "last_step"):
            np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[chosen])


@pytest.mark.parametrize("model", ca.MODELS)
def test_rates_of_packs_are_those_of_single_runs(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = rates(batch(PAPER_ARM), model)
    one_by_one(monkeypatch)
    expected = rates(batch(PAPER_ARM), model)
    assert np.isnan(expected[2]).all() and np.isfinite(np.delete(expected, 2, 0)).all()
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)


def test_a_run_that_is_not_a_number_does_not_disturb_its_neighbours() -> None:
    vehicle = batch(PAPER_ARM)
    whole, spoiled = fly(vehicle, "coupled"), fly(vehicle, "coupled", spoiled=6)
    others = np.arange(RUNS) != 6
    assert spoiled.status[6] == 1 and spoiled.last_step[6] == 0
    assert np.isnan(spoiled.log[6, 1:]).all()
    np.testing.assert_array_equal(spoiled.log[others], whole.log[others])


def test_deviations_of_packs_are_those_of_single_runs() -> None:
    """Of tips that turn over and over, with one run that does not deviate at all."""
    rng = np.random.default_rng(3)
    logs = np.cumsum(rng.normal(0.0, 0.3, (2, RUNS, 60, 7)), axis=2)
    logs[..., 3:] /= np.linalg.norm(logs[..., 3:], axis=-1, keepdims=True)
    logs[1, 5] = logs[0, 5]
    start_warp()
    found = []
    for lanes in (1, NARROW["float64"], LANES["float64"]):
        out, kernel = np.full((RUNS, 5), np.nan), deviation("float64", lanes)
        load(kernel, "cpu")
        arrays: list[Any] = [
            wp.array(each, dtype=wp.float64, device="cpu", copy=False) for each in (*logs, out)
        ]
        wp.launch(kernel, dim=packs_of(RUNS, lanes), device="cpu", inputs=arrays)
        found.append(out)
    assert (found[0][5] == 0.0).sum() >= 4
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12, atol=1e-7)
    np.testing.assert_array_equal(found[1], found[2])


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_sines_arctangents_and_tanh_are_right_to_a_few_units_in_the_last_place(dtype: str) -> None:
    numbers = Numbers(dtype, LANES[dtype])
    code, known = number_code(numbers), elementary_code(numbers)
    Cell, lanes, of_run, keep = code.Cell, code.lanes, code.of_run, code.keep_of_run
    sine, cosine, angle_of, tanh = known.sine, known.cosine, known.angle_of, known.tanh

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def evaluate(x: wp.array2d(dtype=Cell), out: wp.array2d(dtype=Cell)):
        run = wp.tid() * lanes
        a, b = of_run(x, run, 0), of_run(x, run, 1)
        keep(out, run, 0, sine(a))
        keep(out, run, 1, cosine(a))
        keep(out, run, 2, angle_of(a, b))
        keep(out, run, 3, tanh(a))

    rng = np.random.default_rng(5)
    a = np.concatenate([rng.uniform(-9, 9, 40_000), rng.uniform(-1e4, 1e4, 9_000), [0, 0, 1, -1]])
    b = np.concatenate(
        [rng.normal(size=49_000) * 10.0 ** rng.uniform(-6, 6, 49_000), [1, -1, 0, 0]]
    )
    x = np.column_stack([a, b]).astype(dtype)
    out = np.zeros((len(x), 4), dtype)
    start_warp()
    load(evaluate, "cpu")
    arrays: list[Any] = [wp.array(each, dtype=Cell, device="cpu", copy=False) for each in (x, out)]
    wp.launch(evaluate, dim=packs_of(len(x), lanes), device="cpu", inputs=arrays)
    fine = x.astype(np.longdouble)
    exact = np.column_stack(
        [np.sin(fine[:, 0]), np.cos(fine[:, 0]), np.arctan2(*fine.T), np.tanh(fine[:, 0])]
    )
    unit = np.finfo(dtype).eps
    assert np.abs(out - exact)[:, [0, 1]].max() < 2.0 * unit
    assert (np.abs(out - exact)[:, [2, 3]] <= 4.0 * unit * np.abs(exact[:, [2, 3]])).all()


def branching(code: LawCode) -> Any:
    """A law that carries the weight, and twice of it below a height."""
    Sense, Real = code.Sense, code.Real

    @wp.struct
    class Gains:
        height: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        push = sense.weight
        if sense.position[2] < gains.height:
            push += sense.weight
        return push

    return SimpleNamespace(Gains=Gains, control=control)


@pytest.mark.long
def test_a_law_that_branches_on_numbers_flies_run_by_run(capfd: pytest.CaptureFixture[str]) -> None:
    law = ca.Controller("branching", branching, {"height": 1.0}, looks=False)
    q = np.array([[0, 0, z, 0, 0, 0, 0.1, 0] for z in np.linspace(0.5, 1.5, RUNS)])
    scenario = ca.Scenario("climb", q, duration=0.05, controller=law, control_period=1e-2)
    flown = ca.simulate(PAPER_ARM, scenario, sample=0.01)
    climbed = flown["position"].values[:, -1, 2] - q[:, 2]
    assert (climbed[q[:, 2] < 1.0] > 5e-3).all() and (np.abs(climbed[q[:, 2] >= 1.0]) < 1e-3).all()
    assert capfd.readouterr().err == ""


def test_where_packs_do_not_work_runs_fly_one_by_one_and_are_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Packs whose numbers are wrong, and packs that the compiler refuses."""
    kept = packs._probed

    def wrong(precision: str) -> np.ndarray:
        return kept(precision) + 1e-9

    def refused(precision: str) -> np.ndarray:
        raise RuntimeError("no such option")

    for probed, words in ((wrong, "wrong"), (refused, "refuses")):
        monkeypatch.setattr(packs, "_probed", probed)
        with pytest.warns(ca.ContinuairWarning, match=words):
            assert not packs.packs_work.__wrapped__("float64")


BITS = """
import sys
import numpy as np
import continuair as ca
from tests.kernels.test_packs import PAPER_ARM, RUNS, VEHICLES, batch, fly
from tests.refusals import refused
even = np.linspace(0.8, 1.2, RUNS)
varied = {"arm.radius": 0.005 * even, "arm.length": even, "uav.mass": 2.0 * even}
scenario = ca.Scenario(
    "push", np.full(8, 0.1), np.full(8, 0.2), duration=0.2,
    force=lambda t: [3.0 * np.sin(20.0 * t), 2.0 * np.cos(9.0 * t), 25.0],
)
flown = ca.simulate(PAPER_ARM.replace(varied), scenario, sample=0.01)
found = {name: values.to_numpy() for name, values in flown.data_vars.items()}
several = fly(batch(VEHICLES["two_section"]), "coupled", method="implicit").log
np.savez(sys.argv[1], log=fly(batch(PAPER_ARM), "coupled").log, several=several, **found)
"""
PROCESSORS = {
    "this one": {},
    "x86-64-v3": {"CONTINUAIR_CPU_TARGET": "x86-64-v3"},
    "no AVX-512 in NumPy": {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"},
    "BLAS for Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "BLAS for SSE3": {"OPENBLAS_CORETYPE": "Prescott"},
}


@pytest.mark.long
def test_a_run_has_the_same_bits_on_other_processors(tmp_path: Path) -> None:
    """What the host makes of a vehicle, its inputs and its step included."""
    found = []
    for number, changed in enumerate(PROCESSORS.values()):
        environment = os.environ | changed
        environment["PYTHONPATH"] = os.pathsep.join([str(SOURCE), str(Path(__file__).parents[2])])
        file = str(tmp_path / f"{number}.npz")
        subprocess.run([sys.executable, "-c", BITS, file], env=environment, check=True, timeout=300)
        found.append(dict(np.load(file)))
    for other in found[1:]:
        for name, values in found[0].items():
            np.testing.assert_array_equal(other[name], values, err_msg=name)
