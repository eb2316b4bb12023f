"""Signals of motors become thrusts: by PX4's own curve, a table of a stand, or the vehicle's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from tests.interfaces.logged import (
    bag_topics,
    flown,
    px4_estimates,
    rotorcraft,
    write_bag,
    write_ulog,
)
from tests.refusals import refused

FLOWN, THRUSTS = flown(rotorcraft())
TIME = FLOWN["time"].to_numpy()
STAND = np.array([[0.1, 0.2], [0.3, 1.9], [0.5, 5.0], [0.7, 8.6], [1.0, 14.0]])
"""Signals and thrusts [N] of a motor."""
TOPICS = {
    "bend": "debug_array:data[0],data[1]",
    "motors": "actuator_motors:control[0],control[1],control[2],control[3]",
}


@pytest.fixture(autouse=True)
def own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def read(controls: np.ndarray, factor: float | None, vehicle: Any = None, **given: Any) -> Any:
    """Commanded thrusts of a log with these normalised thrusts of PX4, and its THR_MDL_FAC."""
    pytest.importorskip("pyulog")
    topics = {**px4_estimates(FLOWN), "actuator_motors": (TIME, {"control": controls})}
    write_ulog(Path("flight.ulg"), topics, {} if factor is None else {"THR_MDL_FAC": factor})
    found = ca.read_ulog("flight.ulg", vehicle or rotorcraft(), TOPICS, **given)
    return found.rotor_command


@pytest.mark.parametrize("factor", [None, 0.0, 0.3, 1.0])
def test_a_stands_table_and_px4s_own_curve_give_the_thrusts(factor: float | None) -> None:
    """The log holds f u² + (1 - f) u of the signals u at which the stand has the thrusts."""
    signals = np.interp(THRUSTS, STAND[:, 1], STAND[:, 0])
    f = factor or 0.0
    controls = f * signals**2 + (1.0 - f) * signals
    found = read(controls, factor, thrust_curve=STAND)
    # PX4 logs in single precision.
    assert found == pytest.approx(THRUSTS, rel=2e-6)


def test_without_a_table_thrusts_follow_the_vehicles_own_curve() -> None:
    """With PX4's THR_MDL_FAC at 0 the signal is a speed, and the thrust its square."""
    signals = np.sqrt(THRUSTS / 14.0)
    assert read(signals, 0.0) == pytest.approx(THRUSTS, rel=2e-6)
    shared = 0.4 * signals**2 + 0.6 * signals
    bent = rotorcraft().replace({"uav.rotors.thrust_model_factor": 0.4})
    assert read(signals, 0.0, bent) == pytest.approx(14.0 * shared, rel=2e-6)


def test_a_table_is_read_from_a_file_and_a_bag_has_motors_too() -> None:
    pytest.importorskip("rosbags")
    rows = "".join(f"{signal},{thrust}\n" for signal, thrust in STAND[::-1])
    Path("stand.csv").write_text("signal,thrust\n" + rows, encoding="utf-8")
    signals = np.interp(THRUSTS, STAND[:, 1], STAND[:, 0])
    motors = {"/motors": ("std_msgs/msg/Float64MultiArray", TIME, signals)}
    write_bag(Path("bag"), {**bag_topics(FLOWN), **motors})
    named = {"pose": "/uav/pose", "bend": "/arm/bend", "motors": "/motors"}
    found = ca.read_rosbag("bag", rotorcraft(), named, thrust_curve="stand.csv")
    assert found.rotor_command == pytest.approx(THRUSTS, rel=1e-9)


def test_signals_and_tables_that_say_no_thrust_are_refused() -> None:
    signals = np.interp(THRUSTS, STAND[:, 1], STAND[:, 0])
    for wrong in ([[0.0, 1.0]], [[0.0, 1.0], [0.0, 2.0]], [[0.0, 2.0], [1.0, 1.0]], "none.csv"):
        with refused("thrust_curve"):
            read(signals, 0.0, thrust_curve=wrong)
    with refused("motors (actuator_motors)"):
        read(1000.0 * signals, 0.0)
    with refused("motors (actuator_motors)"):
        read(signals, 0.0, thrust_curve=STAND[2:])
    with refused("rotors"):
        ca.read_ulog("flight.ulg", rotorcraft(), TOPICS | {"rotors": TOPICS["motors"] + "*14"})
