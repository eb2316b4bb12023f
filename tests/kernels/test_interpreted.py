"""Device code run by Python: the rates that compiled kernels compute."""

from typing import Any

import numpy as np
import pytest
import warp as wp

from continuair.device.interpreted import NotInterpreted, Vector, interpreted
from continuair.engine.engine import Drive, Engine, Start
from continuair.engine.uncompiled import MOST_STATES, few_rates
from continuair.kernels.dynamics import MODELS
from continuair.vehicle.layout import AIR, GENERAL, PAPER, ROTORS, TIP
from tests.terms.test_contract import EVERYTHING

RNG = np.random.default_rng(5)
FAR = EVERYTHING.replace({"uav.mass": EVERYTHING.uav.mass * np.linspace(0.8, 1.2, 7)})


def moved(engine: Engine, runs: int) -> tuple[Start, Drive]:
    """States that move in everything, frozen elsewhere, under inputs of every kind."""
    layout = engine.layout
    states, frozen = 0.4 * RNG.normal(size=(2, runs, layout.state))
    for each in (states, frozen):
        each[:, layout.attitude] /= np.linalg.norm(each[:, layout.attitude], axis=1)[:, None]
        # Rotors do not turn backwards.
        each[:, layout.rotor_speed] = np.abs(each[:, layout.rotor_speed])
    angles = RNG.normal(size=(runs, layout.branch_angles))
    inputs = np.abs(RNG.normal(size=(1, runs, layout.inputs)))
    return Start(states, angles, frozen), Drive(
        inputs, False, GENERAL | PAPER | TIP | ROTORS | AIR, 9.81
    )


@pytest.mark.parametrize("model", MODELS)
def test_rates_are_those_of_the_kernel(model: str) -> None:
    engine = Engine(FAR, model)
    start, drive = moved(engine, 7)
    found = few_rates(engine, start, drive, None)
    assert found is not None and np.isfinite(found).all()
    compiled = engine.derivative(start, drive, compiled=True)
    sizes = np.abs(compiled).max(axis=0)
    assert (np.abs(found - compiled) <= 1e-11 * sizes).all()


def test_a_state_has_the_same_rates_alone_and_beside_others() -> None:
    engine = Engine(FAR, "coupled")
    start, drive = moved(engine, 7)
    together = few_rates(engine, start, drive, None)
    for run in range(7):
        at = slice(run, run + 1)
        own = Start(start.states[at], start.angle[at], start.frozen[at])
        acting = Drive(drive.table[:, at], False, drive.groups, drive.gravity)
        alone = few_rates(engine, own, acting, np.array([run]))
        np.testing.assert_array_equal(alone[0], together[run])


def test_many_states_are_left_to_the_kernel() -> None:
    engine = Engine(EVERYTHING, "coupled")
    start, drive = moved(engine, MOST_STATES + 1)
    assert few_rates(engine, start, drive, None) is None


def test_a_bend_beyond_a_full_circle_has_no_rates() -> None:
    engine = Engine(EVERYTHING, "coupled")
    start, drive = moved(engine, 2)
    start.states[1, engine.layout.bend] = 100.0
    rates = engine.derivative(start, drive)
    assert np.isfinite(rates[0]).all() and np.isnan(rates[1]).all()


vec3 = wp.types.vector(3, wp.float64)
mat33 = wp.types.matrix((3, 3), wp.float64)


@wp.struct
class Pair:
    first: vec3
    second: vec3


@wp.func
def shifted(pair: Pair, by: wp.float64):
    pair.first[0] = pair.first[0] + by
    kept = pair.second
    pair.second[1] += by * kept[2]
    pair.first -= kept
    return pair


@wp.func
def values_are_copied(a: vec3, x: wp.float64):
    """Every way in which two names could be one in Python."""
    pair = Pair()
    pair.first = a
    pair.second = a
    other = pair
    other.first[2] = x
    changed = shifted(pair, x)
    held = changed.second
    changed.second = held * x
    held[0] = -x
    total = a
    for j in range(3):
        total[j] += wp.float64(7 / 2) * pair.first[j] + wp.float64(j) * held[j]
    return total + changed.first + changed.second + other.first + pair.second


@wp.func
def branches(a: vec3, x: wp.float64):
    out = mat33(a[0], a[1], a[2], x, x, x, a[2], a[1], a[0]) * a
    if x > wp.float64(0.0):
        out = wp.cross(a, out) / x
    else:
        out[1] = x % wp.float64(0.7)
    return wp.min(wp.dot(out, a), wp.float64(50.0)) * wp.normalize(a + out)


@pytest.mark.parametrize("function", [values_are_copied, branches])
def test_python_means_what_a_device_does(function: Any) -> None:
    @wp.kernel(enable_backward=False, module="unique")
    def kernel(a: wp.array(dtype=vec3), x: wp.array(dtype=wp.float64), out: wp.array(dtype=vec3)):
        out[wp.tid()] = function(a[wp.tid()], x[wp.tid()])

    a, x = RNG.normal(size=(9, 3)), RNG.normal(size=9)
    out = wp.zeros(9, dtype=vec3, device="cpu")
    given = [wp.array(a, dtype=vec3, device="cpu"), wp.array(x, device="cpu")]
    wp.launch(kernel, dim=9, inputs=[*given, out], device="cpu")
    run = interpreted(function)
    found = [run(Vector(list(row)), number).components for row, number in zip(a, x, strict=True)]
    np.testing.assert_allclose(found, out.numpy(), rtol=1e-13, atol=1e-13)


def test_code_that_has_no_translation_says_so() -> None:
    @wp.func
    def noise(seed: int):
        return wp.randn(wp.rand_init(seed))

    with pytest.raises(NotInterpreted):
        interpreted(noise)(3)


@pytest.mark.parametrize("model", MODELS)
def test_columns_along_a_log_are_the_same_alone_and_with_all_others(model: str) -> None:
    engine = Engine(EVERYTHING, model)
    start, _ = moved(engine, 3)
    rows = np.zeros((1, 3, engine.layout.log))
    rows[0, :, : engine.layout.state] = start.states
    rows[0, :, engine.layout.branch] = start.angle[:, : engine.layout.bends // 2].repeat(2, axis=1)
    still = Drive(np.zeros((1, 1, engine.layout.inputs)), False, 0, 9.81)
    together = engine.observe(rows, still, engine.observed)
    assert np.isfinite(together).all()
    for name, columns in engine.observed.items():
        alone = engine.observe(rows, still, [name])
        np.testing.assert_array_equal(alone[..., columns], together[..., columns])
