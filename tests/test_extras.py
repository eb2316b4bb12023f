"""What a feature needs beside the package is asked for by the extra that installs it."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import continuair as ca
from tests.interfaces.flights import flight
from tests.refusals import refused
from tests.viewer.flights import swing

VEHICLE = ca.load_vehicle("paper")
FEATURES: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "casadi": ("mpc", lambda _: ca.to_casadi(VEHICLE)),
    "mcap": ("mcap", lambda folder: ca.to_mcap(flight("paper"), folder / "flight.mcap")),
    "pyulog": ("logs", lambda _: ca.read_ulog("flight.ulg", VEHICLE, {"bend": "bend"})),
    "rosbags": ("logs", lambda _: ca.read_rosbag("flight", VEHICLE, {"bend": "bend"})),
    "gymnasium": ("gym", lambda _: importlib.import_module("continuair.interfaces.gym")),
    "viser": ("view", lambda _: ca.view(swing(), port=0)),
    "zarr": ("sweep", lambda folder: ca.open_sweep(folder / "store")),
}


@pytest.mark.parametrize("package", FEATURES)
def test_a_missing_package_is_refused_by_the_name_of_its_extra(
    package: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    extra, use = FEATURES[package]
    monkeypatch.delitem(sys.modules, "continuair.interfaces.gym", raising=False)
    monkeypatch.setattr("continuair.checks.find_spec", lambda name: None)
    with refused(package) as caught:
        use(tmp_path)
    assert f"continuair[{extra}]" in caught.value.remedy
    assert not list(tmp_path.iterdir())
