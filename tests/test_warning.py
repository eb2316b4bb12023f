"""Warnings are left untold or collected in one thread alone; filters of the process stay."""

import threading
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.errors import ContinuairWarning
from continuair.vehicle.vehicle_file import write_vehicle
from continuair.warning import collected, untold, warn

SOURCE = Path(ca.__file__).parent


def told(function: Callable[[], object]) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        function()
    return [str(each.message) for each in caught]


def test_untold_are_those_that_begin_so_or_all() -> None:
    def all_ways() -> None:
        with untold("coarse", "lost .* early"):
            warn("coarse steps", stacklevel=1)
            warn("lost points early on", stacklevel=1)
            warn("steps are coarse", stacklevel=1)
        with untold():
            warn("anything", stacklevel=1)
        warn("afterwards", stacklevel=1)

    assert told(all_ways) == ["steps are coarse", "afterwards"]


def test_the_innermost_takes_a_warning() -> None:
    def nested() -> None:
        with collected() as outer:
            with untold("one"), collected() as inner:
                warn("one", stacklevel=1)
            with untold("one"):
                warn("one", stacklevel=1)
            warn("two", stacklevel=1)
        assert (inner, outer) == (["one"], ["two"])

    assert told(nested) == []


def test_threads_that_overlap_take_their_own_and_leave_the_process_as_it_was() -> None:
    """The first to begin ends first, which filters of the process do not bear."""
    begun, ended = threading.Barrier(2), threading.Barrier(2)

    def first() -> None:
        with untold():
            begun.wait()
        warn("of the first", stacklevel=1)
        ended.wait()

    def second() -> None:
        with untold():
            begun.wait()
            ended.wait()
            warn("of the second", stacklevel=1)

    def both() -> None:
        with ThreadPoolExecutor(2) as pool:
            for done in [pool.submit(first), pool.submit(second)]:
                done.result()
        warn("after both", stacklevel=1)

    assert told(both) == ["of the first", "after both"]


def test_no_part_but_the_command_line_changes_the_filters_of_the_process() -> None:
    changing = [
        str(path.relative_to(SOURCE))
        for path in SOURCE.rglob("*.py")
        if any(
            word in path.read_text("utf-8")
            for word in ("catch_warnings", "simplefilter", "filterw")
        )
    ]
    assert changing == ["cli/application.py"]


@pytest.mark.filterwarnings("ignore:nrmse_r and rmse_r_rad")
def test_a_sweep_in_several_threads_tells_of_errors_and_so_do_flights_after_it(
    tmp_path: Path,
) -> None:
    # A light UAV that its arm throws about, and a coarse tolerance.
    light = {"uav.mass": 0.3, "uav.inertia": [0.003, 0.003, 0.005], "arm.damping_ratio": 0.0}
    vehicle = ca.load_vehicle("paper").replace(light)
    file = tmp_path / "light.toml"
    write_vehicle(vehicle, file)
    attrs: dict[str, Any] = {"vehicle": str(file), "chunk": 1}
    attrs |= {"scenario": {"duration": 3.0, "kappa": 6.0}, "rtol": 1e-2, "check": True}
    masses = np.linspace(0.3, 0.32, 4)
    design = xr.Dataset({"vehicle.uav.mass": ("m", masses)}, attrs=attrs)
    with pytest.warns(ContinuairWarning, match="error_estimate .* 4 of 4 runs"):
        ca.sweep(design, tmp_path / "store", threads=2)
    flight = ca.Scenario("flight", [0, 0, 3, 0, 0, 0, 6.0, 0], duration=3.0)
    texts = told(lambda: ca.simulate(vehicle, flight, rtol=1e-2, check=True))
    assert any(text.startswith("error_estimate ") for text in texts)


def test_the_stacklevel_is_that_of_who_called() -> None:
    with pytest.warns(ContinuairWarning, match="here") as caught:
        warn("here", stacklevel=1)
    assert caught[0].filename == __file__
