"""A design says which runs there are, and each run is the flight that its row describes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.sweeps import load_design
from continuair.sweeps.assembly import batches
from continuair.sweeps.units import REFUSED, compute, quantities
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import refused

pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")


def results(design: xr.Dataset) -> xr.Dataset:
    """The results of a small design, over its runs, without a store."""
    loaded = load_design(design)
    block = compute(loaded, np.arange(loaded.runs), "cpu", None)
    columns = {name: (("run", "model"), block[..., i]) for i, name in enumerate(quantities(loaded))}
    return xr.Dataset(columns, {"model": list(loaded.models)})


def rmse(vehicle: ca.Vehicle, scenario: ca.Scenario, sample: float = 2e-3) -> float:
    flights = [
        ca.simulate(vehicle, scenario, model=model, sample=sample)
        for model in ("coupled", "decoupled")
    ]
    return float(ca.compare(*flights)["rmse_t_m"])


@pytest.mark.long
def test_no_lift_acts_in_a_test_of_the_paper_on_a_vehicle_with_rotors(tmp_path: Path) -> None:
    said: dict[str, Any] = ca.load_vehicle("paper").describe()
    rotors = {"layout": "quad_x", "lever": 0.3, "thrust_limits": [0, 20]}
    said["uav"]["rotors"] = rotors | {"torque_per_thrust": 0.02}
    file = tmp_path / "quad.toml"
    file.write_text(as_toml(ca.Vehicle(**said)), encoding="utf-8")
    designs = [
        xr.Dataset(attrs={"vehicle": name, "scenario": {"test": "B", "duration": 0.5}})
        for name in ("paper", str(file))
    ]
    found = [results(design) for design in designs]
    for name in ("rmse_t_m", "angle_rad"):
        np.testing.assert_allclose(found[1][name], found[0][name], rtol=1e-9, atol=1e-15)
    assert float(found[0]["rmse_t_m"].max()) > 1e-4
    # `simulate` would let them hover.
    pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")
    with pytest.warns(ca.ContinuairWarning, match="scenario.test"):
        ca.sweep(designs[1], tmp_path / "store.zarr")


def test_shared_dimensions_vary_together_and_others_multiply(tmp_path: Path) -> None:
    radii, lengths, masses = [0.003, 0.004, 0.005], [0.8, 0.9, 1.0], [1.0, 2.0]
    design = xr.Dataset(
        {
            "vehicle.arm.radius": ("arm", radii),
            "vehicle.arm.length": ("arm", lengths),
            "vehicle.uav.mass": ("mass", masses),
            "scenario.roll": 0.3,
        },
        attrs={"scenario": {"test": "A", "duration": 0.2}, "chunk": 2},
    )
    found = ca.sweep(design, tmp_path / "store.zarr")
    assert dict(found.sizes) == {"arm": 3, "mass": 2, "model": 2}
    scenario = open_loop_test("A").replace(duration=0.2, q=[0, 0, 5, 0.3, 0, 0, 0.1, 0])
    for i, j in ((0, 1), (2, 0)):
        fields = {"arm.radius": radii[i], "arm.length": lengths[i], "uav.mass": masses[j]}
        alone = rmse(ca.load_vehicle("paper").replace(fields), scenario)
        one = found.isel(arm=i, mass=j).sel(model="decoupled")
        assert float(one["rmse_t_m"]) == pytest.approx(alone, rel=1e-11)
        assert float(one["vehicle.arm.length"]) == lengths[i]


def test_excitations_that_differ_from_run_to_run_are_flown() -> None:
    amplitudes, frequencies = [5.0, 10.0], [1.0, 4.0]
    table = {"excitation": "sine", "on": "tip_force_y", "phase": 0.4, "duration": 0.3, "lift": 1.0}
    design = xr.Dataset(
        {
            "scenario.amplitude": ("a", amplitudes),
            "scenario.frequency": ("f", frequencies),
            "scenario.gravity": ("g", [9.81, 3.0]),
        },
        attrs={"scenario": table},
    )
    found = results(design)["rmse_t_m"].sel(model="decoupled").values.reshape(2, 2, 2)
    vehicle = ca.load_vehicle("paper")
    for (i, amplitude), (j, f) in (
        (x, y) for x in enumerate(amplitudes) for y in enumerate(frequencies)
    ):
        for k, gravity in enumerate((9.81, 3.0)):

            def wrench(t: float, amplitude: float = amplitude, f: float = f) -> list[float]:
                return [0, amplitude * np.sin(2 * np.pi * f * t + 0.4), 0, 0, 0, 0]

            scenario = ca.Scenario(
                "sine", (0, 0, 5, 0, 0, 0, 0.1, 0), force=(0, 0, gravity * vehicle.mass),
                tip_wrench=wrench, duration=0.3, gravity=gravity,
            )  # fmt: skip
            assert found[i, j, k] == pytest.approx(rmse(vehicle, scenario), rel=1e-11)


def test_tests_of_the_paper_are_a_dimension() -> None:
    design = xr.Dataset({"scenario.test": ("test", list("ABCD"))})
    found = results(design)["rmse_t_m"].sel(model="decoupled").values
    vehicle = ca.load_vehicle("paper")
    expected = [rmse(vehicle, open_loop_test(letter)) for letter in "ABCD"]
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_controllers_and_targets_vary() -> None:
    design = xr.Dataset(
        {
            "controller.bandwidth": ("w", [2.0, 6.0]),
            "target.letter": ("letter", ["M", "L"]),
            "vehicle.arm.damping_ratio": 0.05,
        },
        attrs={
            "scenario": {"duration": 6.0},
            "controller": {"posture_damping": 0.0},
            "target": {"duration": 50.0},
            "sample": 0.01,
            "settle": 5.0,
        },
    )
    found = results(design)
    assert not found["status"].any()
    error = found["rms_px"].sel(model="coupled").values.reshape(2, 2)
    assert (error[0] > 2.0 * error[1]).all(), "three times the bandwidth should track better"
    assert error[0, 0] != error[0, 1], "letters should differ"
    assert (found["ds_max_px"].sel(model="coupled") == 0.0).all()


def test_a_lift_acts_in_a_closed_loop_as_a_force_of_its_size_does() -> None:
    tables = {"controller": {}, "target": {}, "settle": 0.5}
    plain = {"duration": 1.0}
    weight = ca.load_vehicle("paper").mass * 9.81
    push = {"excitation": "constant", "on": "force_z", "amplitude": 0.02 * weight}
    lifted, pushed, alone = (
        results(
            xr.Dataset(
                {"target.letter": ("letter", ["L"])}, attrs={"scenario": plain | extra, **tables}
            )
        )["rms_px"].values
        for extra in ({"lift": 0.02}, push, {})
    )
    np.testing.assert_allclose(lifted, pushed, rtol=1e-11)
    assert (np.abs(lifted - alone) > 1.0).all()


def test_a_loop_starts_from_the_desired_image_wherever_the_camera_sits() -> None:
    design = xr.Dataset(
        {
            "vehicle.arm.length": ("length", [0.8, 1.0]),
            "vehicle.camera.position.0": ("place", [0.0, 0.05]),
            "vehicle.uav.mount.2": ("mount", [0.0, -0.1]),
        },
        attrs={
            "scenario": {"x": 0.0, "y": 0.0, "z": 0.0, "kappa": 0.0},
            "controller": {},
            "target": {"distance": 1.5},
        },
    )
    for _, vehicle, scenario in batches(load_design(design), np.arange(8)):
        found = ca.simulate(vehicle, scenario, duration=1e-3, variables=["feature_error"])
        # Rounding of positions of metres, times a focal length of 800 px.
        assert np.abs(found["feature_error"].isel(time=0)).max() < 1e-10


def test_a_loop_starts_from_the_desired_image_whichever_way_the_camera_looks(
    tmp_path: Path,
) -> None:
    changes = {"camera.attitude": [0.05, 0.03, 0.15, 0.987], "camera.position": [0.05, 0.0, 0.02]}
    (tmp_path / "turned.toml").write_text(as_toml(ca.load_vehicle("paper").replace(changes)))
    start = {"x": 0.0, "y": 0.0, "z": 0.0, "kappa": 0.0}
    design = xr.Dataset(
        {"vehicle.uav.mass": ("mass", [1.5, 2.0])},
        attrs={
            "vehicle": str(tmp_path / "turned.toml"),
            "scenario": start,
            "controller": {},
            "target": {},
        },
    )
    for _, vehicle, scenario in batches(load_design(design), np.arange(2)):
        found = ca.simulate(vehicle, scenario, duration=1e-3, variables=["feature_error"])
        assert np.abs(found["feature_error"].isel(time=0)).max() < 1e-9


def test_a_run_that_cannot_be_built_is_a_row_with_a_status() -> None:
    # A disk at 0.9 m is beyond the end of the shorter arm alone.
    vary = {
        "vehicle.arm.length": ("length", [1.0, 0.7]),
        "vehicle.arm.disks.0.position": ("disk", [0.5, 0.9]),
    }
    disk = Path(__file__).parent / "disk.toml"
    design = xr.Dataset(vary, attrs={"vehicle": str(disk), "scenario": {"duration": 0.1}})
    found = results(design)
    assert found["status"].sel(model="decoupled").values.tolist() == [0, 0, 0, REFUSED]
    assert np.isfinite(found["rmse_t_m"].values).all(axis=1).tolist() == [True, True, True, False]
    with refused("vehicle.arm.disks.0.position"):
        load_design(design.assign({"vehicle.arm.disks.0.position": ("disk", [0.5, 1.1])}))


@pytest.mark.parametrize("fixed", ["", '[set]\n"vehicle.uav.mass" = 2.0\n'])
def test_a_design_in_which_nothing_varies_is_one_run(tmp_path: Path, fixed: str) -> None:
    path = tmp_path / "design.toml"
    path.write_text("\ufeff" + '[scenario]\ntest = "A"\nduration = 0.02\n' + fixed)
    found = ca.sweep(path, tmp_path / "store.zarr")
    assert dict(found.sizes) == {"model": 2}
    assert found.attrs["done"] == found.attrs["runs"] == 1
    assert (found["status"] == 0).all()


TOML = """
seed = 4
models = ["decoupled", "independent"]
[scenario]
test = "A"
[[vary]]
sampling = "{sampling}"
count = 32
vehicle.arm.radius = {{ from = 0.003, to = 0.006, spacing = "log" }}
"scenario.kappa" = {{ from = -0.4, to = 0.4 }}
[[vary]]
"vehicle.uav.mass" = {{ from = 1.0, to = 3.0, count = 3 }}
"""


@pytest.mark.parametrize("sampling", ["sobol", "latin-hypercube"])
def test_samples_fill_their_ranges_and_follow_the_seed(tmp_path: Path, sampling: str) -> None:
    path = tmp_path / "design.toml"

    def written(text: str) -> ca.sweeps.Design:
        path.write_text(text)
        return load_design(path)

    design = written(TOML.format(sampling=sampling))
    assert design.sizes == {"radius": 32, "mass": 3}
    kappa = design.variables["scenario.kappa"].values
    radius = design.variables["vehicle.arm.radius"].values
    shares = np.array([(kappa + 0.4) / 0.8, np.log(radius / 0.003) / np.log(2.0)])
    # Both samplings put one point into each of the 32 strata of each range.
    assert (np.sort(np.floor(32 * shares), axis=1) == np.arange(32)).all()
    again = written(TOML.format(sampling=sampling))
    assert again.digest == design.digest
    other = written(TOML.format(sampling=sampling).replace("seed = 4", "seed = 5"))
    assert not np.array_equal(other.variables["scenario.kappa"].values, kappa)
    assert other.digest != design.digest


def test_a_dataset_and_a_file_describe_the_same_sweep(tmp_path: Path) -> None:
    path = tmp_path / "design.toml"
    path.write_text(
        'name = "both"\n[scenario]\ntest = "B"\n[set]\n"scenario.roll" = 0.2\n'
        '[[vary]]\n"vehicle.uav.mass" = [1.0, 2]\n'
    )
    variables = {"vehicle.uav.mass": ("mass", [1.0, 2.0]), "scenario.roll": 0.2}
    dataset = xr.Dataset(variables, attrs={"name": "both", "scenario": {"test": "B"}})
    assert load_design(path).digest == load_design(dataset).digest


def test_the_example_flies(tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "examples" / "sweep.toml"
    found = ca.sweep(example, tmp_path / "store.zarr")
    assert dict(found.sizes) == {"mass": 5, "sample": 64, "model": 3}
    assert not found["status"].any()
    # The arm's reaction moves a heavy UAV less than a light one.
    error = found["angle_rad"].sel(model="decoupled").median("sample")
    assert error.isel(mass=-1, drop=True) < error.isel(mass=0, drop=True)


def test_the_noise_of_a_run_does_not_hang_on_its_unit() -> None:
    design = load_design(
        xr.Dataset(
            {"vehicle.uav.mass": ("mass", [2.0, 2.0, 2.5]), "vehicle.camera.noise": 0.5},
            attrs={
                "controller": {},
                "target": {"duration": 50.0},
                "scenario": {"duration": 0.3},
            },
        )
    )
    runs = np.arange(3)
    whole = compute(design, runs, "cpu", None)
    apart = np.concatenate([compute(design, runs[run : run + 1], "cpu", None) for run in runs])
    np.testing.assert_array_equal(apart, whole)
    at = quantities(design).index("rms_px")
    assert whole[0, 0, at] != whole[1, 0, at], "equal vehicles have noise of their own"


def test_a_design_in_another_order_is_another_design(tmp_path: Path) -> None:
    """The order of its dimensions numbers its runs."""
    vary = {"vehicle.uav.mass": ("mass", [1.0, 2.0]), "vehicle.arm.length": ("length", [0.8, 1.0])}
    attrs = {"scenario": {"test": "A", "duration": 0.02}, "chunk": 1}
    designs = [
        xr.Dataset({name: vary[name] for name in order}, attrs=attrs)
        for order in (list(vary), list(vary)[::-1])
    ]
    ca.sweep(designs[0], tmp_path / "store.zarr", shard=(1, 2))
    with refused("out"):
        ca.sweep(designs[1], tmp_path / "store.zarr")


@pytest.mark.filterwarnings("ignore:nrmse_r and rmse_r_rad")
def test_runs_of_a_sweep_that_steps_do_not_resolve_are_told_of(tmp_path: Path) -> None:
    design = xr.Dataset(
        {"scenario.kappa": ("bend", [0.1, 6.2])},
        attrs={"scenario": {"duration": 1.0}, "vehicle": "slender", "rtol": 1e-2, "check": True},
    )
    with pytest.warns(ca.ContinuairWarning, match="error_estimate .* of 2 runs"):
        ca.sweep(design, tmp_path / "store.zarr")
    with pytest.warns(ca.ContinuairWarning, match="error_estimate .* of 2 runs"):
        ca.open_sweep(tmp_path / "store.zarr")


def test_an_excitation_that_samples_see_at_its_zeros_alone_is_followed(tmp_path: Path) -> None:
    """1 kHz and samples of 1 ms; error_estimate is kept."""
    design = xr.Dataset(
        {"scenario.amplitude": ("amplitude", [0.0, 50.0])},
        attrs={
            "scenario": {"excitation": "sine", "on": "force_x", "frequency": 1e3, "duration": 0.1},
            "sample": 1e-3,
            "check": True,
        },
    )
    found = ca.sweep(design, tmp_path / "store.zarr")
    assert float(found["error_estimate"].max()) < 1e-4
    drift = np.diff(found["tip_x_m"].sel(model="coupled"))
    # By as little as a force that swings so fast moves the tip, and not by nothing.
    assert 1e-5 < abs(drift[0]) < 1e-3


@pytest.mark.long
def test_gains_of_the_image_of_now_bring_runs_of_a_sweep_home_from_afar() -> None:
    design = xr.Dataset(
        {"controller.gains": ("gains", ["constant", "current"]), "scenario.yaw": 1.0},
        attrs={
            "scenario": {"duration": 8.0},
            "controller": {"bandwidth": 6.0},
            "target": {"duration": 1e3},
            "vehicle": "paper",
            "sample": 0.01,
            "settle": 7.0,
        },
    )
    found = results(design).sel(model="coupled")
    assert found["status"].values.tolist()[1] == 0 != found["status"].values.tolist()[0]
    assert found["rms_px"].values[1] < 1.0


@pytest.mark.long
@pytest.mark.parametrize("gains", ["constant", "current"])
def test_runs_of_a_sweep_with_an_integral_leave_no_error_under_a_steady_force(gains: str) -> None:
    design = xr.Dataset(
        {
            "controller.integral": ("integral", [0.0, 0.5]),
            "controller.posture_damping": ("posture", [0.0, 0.1]),
        },
        attrs={
            "scenario": {
                "duration": 16.0, "kappa": 0.0, "x": 0.0, "z": 0.0,
                "excitation": "constant", "on": "force_x", "amplitude": 0.5,
            },
            "controller": {"bandwidth": 6.0, "gains": gains},
            "target": {"duration": 1e3}, "vehicle": "paper", "sample": 0.01, "settle": 15.0,
        },
    )  # fmt: skip
    without, summed = results(design)["rms_px"].sel(model="coupled").to_numpy().reshape(2, 2)
    assert (without > 1.0).all() and (summed < 0.05).all()


def test_results_keep_the_labels_of_the_dimensions_of_a_dataset(tmp_path: Path) -> None:
    design = xr.Dataset(
        {
            "scenario.kappa": ("size", [0.1, 0.2, 0.4]),
            "scenario.roll": ("tilt", [0.0, 0.3]),
            "scenario.pitch": ("plain", [0.0, 0.1]),
        },
        {"size": [2, 0, 1], "tilt": np.array(["flat", "tilted"], object)},
        {"vehicle": "paper", "scenario": {"duration": 0.01}},
    )
    ca.sweep(design, tmp_path / "store")
    found = ca.open_sweep(tmp_path / "store")
    assert float(found.sel(size=2)["scenario.kappa"]) == 0.1
    assert float(found.sel(tilt="tilted")["scenario.roll"]) == 0.3
    assert "plain" not in found.coords
    named = ca.sweep(design.rename(size="kappa").drop_vars("kappa"), tmp_path / "named")
    assert float(named.sel(kappa=0.2)["scenario.kappa"]) == 0.2
    for labels in ([0.0, np.nan, 1.0], np.array([1, 2, 3], "datetime64[s]")):
        with refused("design"):
            load_design(design.assign_coords(size=labels))
