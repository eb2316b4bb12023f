"""`continuair check`: what follows from a vehicle, and what of it is hardly meant."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.analysis.linear import bending_frequencies
from continuair.analysis.modes import modes
from continuair.studies.check import facts
from continuair.vehicle.vehicle import load_vehicle, preset_text
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import assert_refused, numbers_of, refused

PAPER_TOML = preset_text("paper")


@pytest.fixture(autouse=True)
def in_an_empty_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli.app, list(arguments))


def test_check_of_an_unusable_file_names_the_file_and_the_field() -> None:
    Path("wrong.toml").write_text('name = "x"\n[uav]\nmass = -1\ninertia = [1, 1, 1]\n')
    assert_refused(run("check", "wrong.toml"), "uav.mass", "-1", place="wrong.toml")


def test_check_shows_mass_ratio_and_both_bending_frequencies() -> None:
    result = run("check", "paper")
    assert result.exit_code == 0, result.output
    for part in ("0.6165 kg", "0.3083", "clamped", "free fall", "57.41", "143.3", "ms"):
        assert part in result.stdout


def test_check_shows_the_fixed_step_that_a_heavily_damped_arm_needs() -> None:
    clamped, free = bending_frequencies(load_vehicle("paper"))
    # Freeing the base raises the decay γ by the square of what it raises the frequency by.
    decay = 4.0 * clamped * (free / clamped) ** 2
    rates = {"0.0": free, "4.0": decay + math.sqrt(decay**2 - free**2)}
    for ratio, rate in rates.items():
        Path("mine.toml").write_text(
            PAPER_TOML.replace("damping = 0.0", f"damping_ratio = {ratio}")
        )
        shown = run("check", "mine.toml").stdout
        assert f"{rate:.4g} 1/s" in shown
        assert f"{1e3 * 0.2 / rate:.3g} ms" in shown


@pytest.mark.long
def test_check_shows_the_same_fastest_rate_in_a_wash() -> None:
    rotors = '[uav.rotors]\nlayout = "quad_x"\nlever = 0.2\nthrust_limits = [0.0, 20.0]\n'
    rotors += "torque_per_thrust = 0.016\nradius = 0.12\n\n[arm]\ndrag_coefficient = 1.1"
    Path("washed.toml").write_text(PAPER_TOML.replace("[arm]", rotors))
    _, free = bending_frequencies(load_vehicle("paper"))
    shown = run("check", "washed.toml").stdout
    assert f"{free:.4g} 1/s" in shown


def test_check_shows_modes_about_the_hover() -> None:
    vehicle = load_vehicle("paper")
    shown = run("check", "paper").stdout
    for base in ("clamped", "hovering"):
        lowest = modes(vehicle, base=base).frequencies[0]
        (line,) = (line for line in shown.splitlines() if line.split()[:1] == [base])
        assert f"{lowest:.4g}" in line
    assert "gravity number g / l ω²" in shown


@pytest.mark.parametrize("layout", ["quad_x", "quad_plus"])
def test_check_shows_what_rotors_have_left(layout: str) -> None:
    """Straight, a quarter of the weight each; bent towards a rotor, that one carries half of the
    arm's moment besides, at its lever."""
    rotors = f'[uav.rotors]\nlayout = "{layout}"\nlever = 0.2\nthrust_limits = [0.0, 20.0]\n'
    rotors += "torque_per_thrust = 0.016\n\n[arm]"
    Path("quad.toml").write_text(PAPER_TOML.replace("[arm]", rotors))
    shown = run("check", "quad.toml").stdout
    vehicle = load_vehicle("paper")
    weight, arm = 9.81 * vehicle.mass, 9.81 * vehicle.arm.mass
    off = (1.0 - np.sin(1.0)) * vehicle.arm.length  # ∫ (1 - cos αs)/α ds at α = 1
    for words, thrust in (
        ("arm straight", weight / 4.0),
        ("arm bent by 1 rad", weight / 4.0 + arm * off / (2.0 * 0.2)),
    ):
        (line,) = (line for line in shown.splitlines() if f"rotors' margin, {words}" in line)
        assert f"{1.0 - thrust / 20.0:.0%}" in line


def test_check_says_that_leaning_rotors_do_not_hover() -> None:
    rotors = "[uav.rotors]\nthrust_limits = [0.0, 20.0]\ntorque_per_thrust = 0.016\nrotor = [\n"
    for x, y, spin in ((0.2, 0.2, 1), (-0.2, 0.2, -1), (-0.2, -0.2, 1), (0.2, -0.2, -1)):
        rotors += f"  {{ position = [{x}, {y}, 0.0], axis = [0.5, 0.0, 1.0], spin = {spin} }},\n"
    Path("lean.toml").write_text(PAPER_TOML.replace("[arm]", rotors + "]\n\n[arm]"))
    told = " ".join(run("check", "lean.toml").stdout.split())
    assert "sideways by 12.8 N" in told


def test_check_says_of_what_rotors_have_left_what_a_hover_says() -> None:
    """Each rotor leans inwards: together they lift alone, but not where one side pushes more."""
    turns = np.radians([45.0, 135.0, 225.0, 315.0])
    rotor = [
        {"position": [0.3 * c, 0.3 * s, 0.0], "axis": [-0.26 * c, -0.26 * s, 0.966], "spin": spin}
        for c, s, spin in zip(np.cos(turns), np.sin(turns), [1, -1, 1, -1], strict=True)
    ]
    table = {"rotor": rotor, "thrust_limits": [0.1, 20.0], "torque_per_thrust": 0.02}
    vehicle = load_vehicle("paper").replace({"uav.rotors": table})
    told = {each[0]: each[1] for each in facts(vehicle, None)}
    start = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
    straight = ca.Scenario("hover", [*start, 0.0, 0.0], duration=0.01)
    thrusts = ca.simulate(vehicle, straight, sample=0.01)["rotor_thrust"].to_numpy()[0]
    assert told["rotors' margin, arm straight"] == f"{1.0 - thrusts.max() / 20.0:.0%}"
    bent = straight.replace(q=[*start, 1.0 / vehicle.arm.length, 0.0])
    with refused("uav.rotors") as hover:
        ca.simulate(vehicle, bent, sample=0.01)
    (aside,) = re.findall(r"(\S+) N\b", hover.value.problem)
    assert told["rotors' margin, arm bent by 1 rad"].endswith(f"sideways by {aside} N")


@pytest.mark.long
def test_check_says_that_a_hover_of_tilted_rotors_bears_the_wash() -> None:
    """Rotors of any wrench that carry an arm in their wash push aside against it, as they may."""
    rotors = {"layout": "hex_tilted", "lever": 0.3, "tilt": 0.4, "thrust_limits": [0.1, 14.0],
              "torque_per_thrust": 0.02, "radius": 0.1}  # fmt: skip
    section = {"length": 0.4, "radius": 0.005, "mass_per_length": 0.05, "bending_stiffness": 0.5,
               "damping_ratio": 0.05, "drag_coefficient": 1.1}  # fmt: skip
    aslant = [float(np.sin(np.pi / 8)), 0.0, 0.0, float(np.cos(np.pi / 8))]
    vehicle = ca.Vehicle(
        name="aslant",
        uav={"mass": 2.0, "inertia": [0.03, 0.03, 0.05], "rotors": rotors},
        arm=[{"name": "a", "mount": [0.0, 0.1, -0.02], "attitude": aslant, "section": [section]}],
    )
    start = ca.Scenario("hover", [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0], duration=0.01)
    thrusts = ca.simulate(vehicle, start, sample=0.01)["rotor_thrust"].to_numpy()[0]
    told = {each[0]: each[1] for each in facts(vehicle, None)}
    assert told["rotors' margin, arm straight"] == f"{1.0 - thrusts.max() / 14.0:.0%}"


def test_check_says_that_rotors_cannot_hold_a_bent_arm() -> None:
    """On a short lever an arm that is bent asks the rotors on one side to pull down."""
    rotors = '[uav.rotors]\nlayout = "quad_x"\nlever = 0.04\nthrust_limits = [0.0, 40.0]\n'
    rotors += "torque_per_thrust = 0.016\n\n[arm]"
    Path("short.toml").write_text(PAPER_TOML.replace("[arm]", rotors))
    shown = run("check", "short.toml").stdout
    line = " ".join(shown.split()).partition("rotors' margin, arm bent by 1 rad ")[2]
    assert line.startswith("none: ") and min(numbers_of(line[:80])) < 0.0


def test_check_says_that_rotors_push_more_than_a_hover_takes() -> None:
    """A controller's rotors keep turning: a quarter of the weight is less than their least."""
    least = 0.25 * 9.81 * load_vehicle("paper").mass + 0.1
    table = '[uav.rotors]\nlayout = "quad_x"\nlever = 0.2\ntorque_per_thrust = 0.016\n'
    table += f"thrust_limits = [{least}, 40.0]\n\n[arm]"
    Path("strong.toml").write_text(PAPER_TOML.replace("[arm]", table))
    shown = " ".join(run("check", "strong.toml").stdout.split())
    line = shown.partition("rotors' margin, arm straight ")[2]
    assert line.startswith("none: ") and f" {least - 0.1:.3g} N of {least:g}" in line


def rotors(lever: float = 0.2, most: float = 20, lag: float = 0.03, torque: float = 0.02) -> str:
    """A table of rotors, and the head of the one after."""
    return (
        f'[uav.rotors]\nlayout = "quad_x"\nlever = {lever}\nthrust_limits = [0, {most}]\n'
        f"lag = {lag}\ntorque_per_thrust = {torque}\n\n[arm]"
    )


@pytest.mark.parametrize(
    ("text", "other", "doubt"),
    [
        ("density = 7850.0", "density = 2e5", "arm.density is 2e+05 "),
        ("radius = 0.005", "radius = 0.0002", "the arm of 1 m"),
        (
            "damping = 0.0",
            "disks = [{position = 1, mass = 30}]",
            "disks.0.mass is 30 kg",
        ),
        ("[0.024, 0.024, 0.047]", "[24, 24, 47]", "in kg m²"),
        ("damping = 0.0", "damping_ratio = 2", "arm.damping_ratio is 2"),
        ("mount = [0.0, 0.0, 0.0]", "mount = [0, 0, -60]", "uav.mount is 60 m"),
        ("\nposition = [0.0, 0.0, 0.0]", "\nposition = [30, 0, 0]", "camera.position is 30 m"),
        ("[arm]", rotors(lever=200), "200 m"),
        ("[arm]", rotors(most=800), "125 times"),
        ("[arm]", rotors(lag=30), "uav.rotors.lag is 30 s"),
        ("[arm]", rotors(torque=16), "uav.rotors.torque_per_thrust is 16 m"),
    ],
)
def test_check_warns_of_what_is_hardly_meant(text: str, other: str, doubt: str) -> None:
    assert text in PAPER_TOML
    Path("mine.toml").write_text(PAPER_TOML.replace(text, other))
    result = run("check", "mine.toml")
    assert result.exit_code == 0
    assert doubt in result.stderr


def test_check_has_no_doubts_of_a_common_vehicle() -> None:
    Path("mine.toml").write_text(PAPER_TOML.replace("[arm]", rotors()))
    assert "Warning" not in run("check", "mine.toml").stderr


def test_check_warns_of_what_is_hardly_meant_and_cannot_be_flown() -> None:
    Path("soft.toml").write_text(re.sub("youngs_modulus = .*", "youngs_modulus = 40", PAPER_TOML))
    result = run("check", "soft.toml")
    assert result.exit_code == 0, result.output
    assert "arm.youngs_modulus is 40 Pa" in result.stderr


def test_check_shows_what_constant_curvature_costs_beside_the_beam() -> None:
    result = run("check", "paper")
    lines = [line.split() for line in result.stdout.splitlines()]
    errors = {" ".join(line[2:-3]): line[-1] for line in lines if line[1:2] == ["beam:"]}
    assert errors["tip deflection under a tip force"] == "(-25.0%)"
    # sqrt(20) / 3.516 - 1
    assert errors["first frequency, UAV clamped"] == "(+27.2%)"


def test_check_shows_a_vehicle_that_is_too_stiff_beside_its_softness_for_a_flight() -> None:
    """A link that is meant rigid, after a soft one."""
    vehicle = load_vehicle("two_section").replace({"arm.arm.section.tip.bending_stiffness": 1e9})
    Path("rigid.toml").write_text(as_toml(vehicle))
    result = run("check", "rigid.toml")
    assert result.exit_code == 0, result.output
    assert re.search(r"fixed step of RK4, 0.2 over it\W+\d\S*e-\d+ ms", result.stdout)
    assert "free fall" in result.stdout


def test_check_says_which_of_several_arms_it_tells_of() -> None:
    result = run("check", "dual_arm")
    assert result.exit_code == 0, result.output
    vehicle = load_vehicle("dual_arm")
    name = vehicle.arms[vehicle.camera_arm].name
    assert re.search(rf"gravity number g / l ω², arm {name}\b", result.stdout)
    assert "gravity number g / l ω² " in run("check", "paper").stdout
