"""Changing a vehicle's fields, for one run and for many."""

import json
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from continuair.errors import ContinuairWarning
from continuair.vehicle.disk import Disk
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle, load_vehicle
from tests.refusals import refused

PAPER = load_vehicle("paper")


def test_replace_leaves_the_vehicle_as_it_was() -> None:
    before = PAPER.describe()
    radii_given = np.array([0.004, 0.006])
    batch = PAPER.replace({"arm.radius": radii_given, "uav.inertia": [0.03, 0.03, 0.05]})
    batch.replace({"uav.mass": 9.0})
    radii_given[:] = 1.0
    assert PAPER.describe() == before
    np.testing.assert_array_equal(batch.arm.radius, [0.004, 0.006])
    assert batch.uav.mass == 2.0


def test_run_of_a_batch_equals_the_vehicle_with_that_runs_values() -> None:
    base = PAPER.replace({"arm.disks": [Disk(position=0.5, mass=0.1), Disk(position=1, mass=0.2)]})
    changes: dict[str, Any] = {
        "arm.radius": np.array([0.004, 0.005, 0.006]),
        "arm.disks.1.mass": [0.1, 0.2, 0.3],
        "uav.inertia": np.array([[0.024, 0.024, 0.04], [0.03, 0.03, 0.05], [1, 1, 1]])[:, None]
        * np.eye(3),
        "uav.mount": np.arange(9.0).reshape(3, 3),
        "camera.image_size": [[640, 480], [800, 600], [1000, 1000]],
    }
    batch = base.replace(changes)
    assert batch.runs == 3
    assert base.runs is None
    for run in range(3):
        single = base.replace({path: values[run] for path, values in changes.items()})
        assert batch.select(run) == single
        assert hash(batch.select(run)) == hash(single)
    assert base.select(7) is base


@given(
    st.lists(
        st.tuples(st.floats(1e-4, 0.05), st.floats(0.1, 3.0), st.floats(0, 2)),
        min_size=1,
        max_size=5,
    )
)
def test_derived_quantities_of_a_batch_are_those_of_its_runs(
    rows: list[tuple[float, float, float]],
) -> None:
    """To the last bit."""
    r, length, mass = (list(column) for column in zip(*rows, strict=True))
    base = PAPER.replace({"arm.disks": [{"position": 0.05, "mass": 0.0, "inertia": [1e-6, 0]}]})
    moments = [[value * 1e-5, value * 1e-5] for value in mass]
    batch = base.replace(
        {
            "arm.radius": r,
            "arm.length": length,
            "arm.disks.0.mass": mass,
            "arm.disks.0.inertia": moments,
            "arm.damping_ratio": np.full(len(rows), 0.02),
        }
    )
    names = [name for name, value in vars(Section).items() if isinstance(value, property)]
    assert "straight_modal_mass" in names
    for name in names:
        if name.startswith("model_"):
            continue
        single = [getattr(batch.select(run).arm, name) for run in range(len(rows))]
        np.testing.assert_array_equal(getattr(batch.arm, name), single)
    masses = [batch.select(run).mass for run in range(len(rows))]
    np.testing.assert_array_equal(batch.mass, masses)


def test_one_element_of_a_vector_can_vary() -> None:
    batch = PAPER.replace({"uav.mount.2": np.array([-0.1, -0.2])})
    np.testing.assert_array_equal(batch.uav.mount, [[0, 0, -0.1], [0, 0, -0.2]])


def test_diagonals_over_runs_become_matrices() -> None:
    batch = PAPER.replace({"uav.inertia": np.full((4, 3), 0.02)})
    np.testing.assert_array_equal(batch.uav.inertia, np.broadcast_to(0.02 * np.eye(3), (4, 3, 3)))


def test_array_of_one_run_makes_a_batch_of_one() -> None:
    batch = PAPER.replace({"uav.mass": np.array([3.0])})
    assert batch.runs == 1
    assert batch.select(0) == PAPER.replace({"uav.mass": 3.0})


def test_batch_can_be_changed_again_with_arrays_of_its_length() -> None:
    batch = PAPER.replace({"arm.radius": [0.004, 0.005]}).replace({"uav.mass": [1.0, 2.0]})
    assert batch.select(0) == PAPER.replace({"arm.radius": 0.004, "uav.mass": 1.0})
    assert batch.replace({"arm.radius": 0.005, "uav.mass": 2.0}) == PAPER
    with refused("arm.length"):
        PAPER.replace({"arm.length": [1, 2, 3]}).replace({"uav.mass": [1, 2]})


def test_description_is_json_and_rebuilds_the_vehicle() -> None:
    base = PAPER.replace({"arm.disks": [Disk(position=1.0, mass=0.1, inertia=(1e-5, 2e-5))]})
    assert Vehicle(**json.loads(json.dumps(base.describe()))) == base
    batch = base.replace({"arm.disks.0.mass": np.array([0.1, 0.2])})
    assert json.loads(json.dumps(batch.describe()))["arm"]["disks"][0]["mass"] == [0.1, 0.2]


def test_vehicle_survives_pickling_for_work_in_other_processes() -> None:
    batch = PAPER.replace({"arm.radius": [0.004, 0.005]})
    assert pickle.loads(pickle.dumps(PAPER)) == PAPER
    assert pickle.loads(pickle.dumps(batch)).describe() == batch.describe()


def test_batch_prints_shapes_and_not_its_numbers() -> None:
    text = repr(PAPER.replace({"arm.radius": np.linspace(0.001, 0.01, 1000)}))
    assert "radius=array(1000,)" in text
    assert len(text) < 1000


def test_warnings_of_a_batch_come_as_one_that_names_the_first_run() -> None:
    moments = np.tile([0.024, 0.024, 0.047], (5, 1))
    moments[[2, 4], 2] = 0.049
    with pytest.warns(ContinuairWarning) as caught:
        PAPER.replace({"uav.inertia": moments})
    assert [str(w.message).startswith("run 2 (of 2 that warn)") for w in caught] == [True]


def test_unusable_run_of_a_batch_is_named_by_its_index() -> None:
    with refused("arm.radius"):
        PAPER.replace({"arm.radius": [0.1, 0.2, -1.0]})
    disks = [{"position": 1.0, "mass": 0.1}]
    with refused("arm.disks.0.position"):
        PAPER.replace({"arm.length": [1.5, 0.9], "arm.disks": disks})


def test_disks_keep_their_share_of_an_arm_whose_length_changes() -> None:
    disks = [{"position": 0.3, "mass": 0.1}, {"position": 1.0, "mass": 0.1}]
    base = PAPER.replace({"arm.disks": disks})
    for length in (0.7, 1.4):
        short = base.replace({"arm.length": length})
        assert [disk.position for disk in short.arm.disks] == [0.3 * length, length]
    lengths = np.array([0.5, 2.0])
    batch = base.replace({"arm.length": lengths})
    np.testing.assert_array_equal(batch.arm.disks[1].position, lengths)
    again = batch.replace({"arm.length": [1.0, 1.0]})
    np.testing.assert_allclose(again.arm.disks[0].position, 0.3, rtol=1e-15)
    given = base.replace({"arm.length": 2.0, "arm.disks.0.position": 0.1})
    assert [disk.position for disk in given.arm.disks] == [0.1, 2.0]
    with refused("arm.length"):
        base.replace({"arm.length": -1.0})


def test_batched_parts_are_refused_by_the_constructor() -> None:
    batch = PAPER.replace({"uav.mass": [1.0, 2.0]})
    with refused("uav"):
        Vehicle(name="x", uav=batch.uav, arm=batch.arm)


@pytest.mark.parametrize("run", [-1, 2, 0.5, "0", True])
def test_run_outside_the_batch_is_refused(run: Any) -> None:
    batch = PAPER.replace({"uav.mass": [1.0, 2.0]})
    with refused("run"):
        batch.select(run)


def test_vector_that_varies_is_replaced_as_a_whole() -> None:
    batch = PAPER.replace({"uav.mount": np.zeros((2, 3))})
    with refused("uav.mount.2"):
        batch.replace({"uav.mount.2": 1.0})
