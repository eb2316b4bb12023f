"""Arrays of JAX and PyTorch go in, and results go out to them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import continuair as ca
from tests.refusals import refused

LIBRARIES = ("jax.numpy", "torch")


def library(name: str) -> Any:
    return pytest.importorskip(name)


@pytest.mark.long
@pytest.mark.parametrize("name", LIBRARIES)
def test_arrays_of_another_library_are_what_numpys_are(name: str) -> None:
    given = library(name)
    masses, q, force = [1.5, 2.0], [0.0, 0, 1, 0, 0, 0, 0.5, 0.25], [0.0, 0.0, 24.0]

    def flown(array: Any) -> Any:
        vehicle = ca.load_vehicle("paper").replace({"uav.mass": array(masses)})
        scenario = ca.Scenario("given", array(q), force=lambda t: array(force), duration=0.01)
        return ca.simulate(vehicle, scenario, sample=0.005)["tip_position"].to_numpy()

    asarray = given.asarray
    # In single precision, which holds these numbers exactly.
    np.testing.assert_array_equal(flown(asarray), flown(np.asarray))
    rates = {"bend": asarray([q[6:]]), "force": asarray(force)}
    found = ca.accelerations(ca.load_vehicle("paper"), **rates)
    expected = ca.accelerations(ca.load_vehicle("paper"), bend=[q[6:]], force=force)
    for mine, theirs in zip(found, expected, strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("name", LIBRARIES)
def test_results_go_out_by_dlpack(name: str) -> None:
    given = library(name)
    scenario = ca.Scenario("out", [0.0] * 8, duration=0.01)
    position = ca.simulate(ca.load_vehicle("paper"), scenario)["position"].to_numpy()
    taken = given.from_dlpack(position)
    np.testing.assert_allclose(np.asarray(taken), position, rtol=1e-7)


def test_a_traced_array_is_refused_in_a_sentence() -> None:
    jax = library("jax")

    def traced(q: Any) -> Any:
        return ca.Scenario("traced", q).q

    with refused("q"):
        jax.jit(traced)(np.zeros(8))


class OnDevice:
    """What an array does whose library does not let NumPy read it."""

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("not in this memory")

    def __dlpack__(self) -> Any:
        raise BufferError

    def tolist(self) -> list[float]:
        return [0.0] * 8

    def __repr__(self) -> str:
        return "tensor([0., 0., 0., 0., 0., 0., 0., 0.], device='cuda:0')"


def test_an_array_on_a_device_is_refused_in_a_sentence_that_names_it() -> None:
    with refused("q"):
        ca.Scenario("on a device", OnDevice())


def test_a_tensor_that_is_recorded_for_derivatives_is_refused_in_a_sentence() -> None:
    torch = library("torch")
    recorded = torch.zeros(8, requires_grad=True)
    with refused("q"):
        ca.Scenario("recorded", recorded)
