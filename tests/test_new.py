"""The file that a new vehicle begins with, and the questions that are asked for it."""

import math
import os
import pty
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import continuair.cli as cli
import continuair.cli.new as new
from continuair.analysis.plausible import doubts
from continuair.errors import named_fields
from continuair.vehicle.arms import ArmChain, TipBody
from continuair.vehicle.camera import Camera
from continuair.vehicle.disk import Disk
from continuair.vehicle.rotors import Drag, Rotor, Rotors
from continuair.vehicle.section import Section
from continuair.vehicle.template import LAYOUTS, Outline, as_template
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.uav import Uav
from continuair.vehicle.vehicle import Vehicle, load_vehicle, preset_text
from tests.refusals import assert_refused, refused

GRAVITY = 9.81


@pytest.fixture(autouse=True)
def in_an_empty_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def run(*arguments: str, answers: str = "") -> Any:
    return CliRunner().invoke(cli.app, ["new", *arguments], input=answers)


def made(**known: Any) -> Vehicle:
    return Vehicle(**tomllib.loads(as_template(Outline("made", **known))))


def test_a_new_vehicle_is_read_without_doubts_and_the_next_commands_are_told() -> None:
    result = run("my drone.toml")
    assert result.exit_code == 0, result.stderr
    vehicle = load_vehicle("my drone.toml")
    assert vehicle.name == "my drone" and doubts(vehicle) == []
    assert "continuair check 'my drone.toml'" in result.stdout
    commands = re.findall(r"continuair (\S+) ", result.stdout)
    assert commands[:2] == ["check", "advise"]
    for name in commands:
        assert CliRunner().invoke(cli.app, [name, "--help"]).exit_code == 0


@pytest.mark.parametrize("layout", LAYOUTS)
def test_rotors_of_every_layout_lift_about_twice_the_weight(layout: str) -> None:
    vehicle = made(layout=layout)
    assert vehicle.uav.rotors is not None
    rotors = vehicle.uav.rotors
    lift = float(rotors.allocation[2] @ rotors.highest)
    # Two digits of a thrust.
    assert 2.0 * 0.95 < lift / (GRAVITY * vehicle.mass) < 2.0 * 1.05


@pytest.mark.parametrize("sections", [1, 2, 8])
def test_sections_share_the_length_and_the_tip_carries_the_load(sections: int) -> None:
    vehicle = made(sections=sections, length=0.8, load=0.3, mass=4.0)
    backbone = 6450.0 * math.pi * vehicle.arms[0].section[0].radius ** 2 * 0.8
    assert vehicle.shape == (sections,)
    assert sum(part.length for part in vehicle.arms[0].section) == pytest.approx(0.8)
    assert vehicle.mass == pytest.approx(4.0 + 0.3 + backbone)


def test_arms_of_all_lengths_sag_alike() -> None:
    def sag(length: float) -> float:
        arm = made(length=length).arm
        return 0.08 * GRAVITY * length**2 / (3.0 * arm.bending_stiffness)

    # The radius has two digits, and the sag goes with its fourth power.
    assert sag(0.2) == pytest.approx(sag(0.5), rel=0.25) == pytest.approx(sag(2.0), rel=0.25)


@pytest.mark.parametrize("sections", [1, 2])
def test_every_field_of_a_vehicle_stands_in_the_file_with_its_unit_or_meaning(
    sections: int,
) -> None:
    text = as_template(Outline("made", sections=sections))
    rows = re.findall(r"^(?:# )?(\w+) = .*?(  # \S.*)?$", text, re.MULTILINE)
    assert [name for name, comment in rows if not comment] == []
    parts = [Uav, Rotors, Rotor, Drag, Section, Disk, Tendon, Camera]
    missing = {field for part in parts for field in named_fields(part)} - {row[0] for row in rows}
    tables = {"rotors", "drag", "rotor", "disks", "tendon"}
    # A strain that varies cannot be flown yet.
    tables |= {"strain", "nodes", "poisson_ratio"}
    assert missing <= tables | ({"name"} if sections == 1 else {"mount"})
    if sections > 1:
        assert {*named_fields(ArmChain), *named_fields(TipBody)} - {row[0] for row in rows} <= {
            "section",
            "tendon",
            "tip",
        }


@pytest.mark.parametrize("sections", [1, 2])
def test_what_is_behind_a_sign_can_be_used_as_it_stands(sections: int) -> None:
    text = as_template(Outline("made", sections=sections))
    instead = {"mass_per_length": "density", "bending_stiffness": "youngs_modulus"}
    instead["damping"] = "damping_ratio"
    for name in (*instead, "drag_coefficient", "kappa_s", "noise", "frame_rate", "latency"):
        used = re.sub(rf"^# ({name} =)", r"\1", text, count=1, flags=re.MULTILINE)
        used = re.sub(rf"^{instead.get(name, '-')} =.*\n", "", used, count=1, flags=re.MULTILINE)
        assert used != text
        Vehicle(**tomllib.loads(used))
    for command in ("tension", "length"):
        of_winches = ("end", "damping", "stroke", *(["stiffness"] if command == "tension" else []))
        kept = text.replace('command = "tension"', f'command = "{command}"')
        first = kept.index("# [[arm.tendon]]")
        last = kept.index("[camera]")
        lines = [
            line.removeprefix("# ")
            for line in kept[first:last].splitlines()
            if not line.startswith("# With") and line[2:].split(" =")[0] not in of_winches
        ]
        vehicle = Vehicle(**tomllib.loads(kept[:first] + "\n".join(lines) + "\n" + kept[last:]))
        assert vehicle.tendons == 3


def test_a_preset_is_copied_with_its_comments_under_the_name_of_the_file() -> None:
    assert run("mine.toml", "--from", "two_section").exit_code == 0
    copied, preset = Path("mine.toml").read_text("utf-8"), preset_text("two_section")
    assert load_vehicle("mine.toml").name == "mine"
    assert copied == preset.replace('name = "two_section"', 'name = "mine"')


def test_nothing_that_is_there_is_overwritten() -> None:
    Path("mine.toml").write_text("mine")
    Path("link.toml").symlink_to("nowhere.toml")
    for name in ("mine.toml", "link.toml"):
        for more in ((), ("--from", "paper"), ("--yes",)):
            result = run(name, *more)
            assert_refused(result, "file", name)
    assert Path("mine.toml").read_text() == "mine" and not Path("nowhere.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "field", "fact"),
    [
        (("drone",), "file", ".toml"),
        (("no/drone.toml",), "file", "No such file or directory"),
        (("drone.toml", "--from", "papr"), "from", "use paper"),
    ],
)
def test_what_cannot_be_written_or_copied_is_refused(
    arguments: tuple[str, ...], field: str, fact: str
) -> None:
    assert_refused(run(*arguments), field, fact)
    assert list(Path().iterdir()) == []


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A standard input that is taken for a terminal."""
    monkeypatch.setattr(new, "asks", lambda: True)


@pytest.mark.usefixtures("terminal")
def test_enter_takes_every_default() -> None:
    assert run("asked.toml", answers=len(new.QUESTIONS) * "\n").exit_code == 0
    assert run("plain.toml", "--yes").exit_code == 0
    asked, plain = (Path(name).read_text("utf-8") for name in ("asked.toml", "plain.toml"))
    assert asked == plain.replace("plain", "asked")


@pytest.mark.usefixtures("terminal")
def test_bad_answers_are_asked_again_in_a_sentence() -> None:
    answers = ["-1", "heavy", "3.2", "quadx", "hex_x", "0.3", "inf", "0.9", "9", "1.5", "3"]
    answers += ["-0.1", "0", "0.5", "0.002"]
    result = run("mine.toml", answers="\n".join([*answers, ""]))
    assert result.exit_code == 0, result.stderr
    for told in (
        "mass is -1.0",
        "mass is 'heavy'",
        "layout is 'quadx'; use quad_x",
        "length is inf",
        "sections is 9",
        "sections is '1.5'",
        "load is -0.1",
        "radius is 0.5",
    ):
        assert told in result.stderr
    vehicle = load_vehicle("mine.toml")
    assert (vehicle.uav.mass, vehicle.shape, vehicle.arms[0].section[2].radius) == (3.2, (3,), 2e-3)
    assert vehicle.uav.rotors is not None and vehicle.uav.rotors.layout == "hex_x"


@pytest.mark.usefixtures("terminal")
def test_answers_that_end_early_write_nothing() -> None:
    result = run("mine.toml", answers="2.0\n")
    assert result.exit_code == 2 and result.stderr.splitlines()[-1].startswith("layout ")
    assert not Path("mine.toml").exists()


def test_an_outline_that_no_vehicle_can_have_is_refused() -> None:
    with refused("arm.radius"):
        Outline("made", length=0.1, radius=0.06)


@pytest.mark.parametrize(("more", "questions"), [([], len(new.QUESTIONS)), (["--yes"], 0)])
def test_a_terminal_is_asked_unless_told_not_to(more: list[str], questions: int) -> None:
    main, end = pty.openpty()
    os.write(main, len(new.QUESTIONS) * b"\n")
    command = [sys.executable, "-m", "continuair", "new", "mine.toml", *more]
    environment = os.environ | {"PYTHONPATH": str(Path(cli.__file__).parents[2])}
    done = subprocess.run(command, stdin=end, stderr=end, stdout=subprocess.PIPE, env=environment)
    os.close(end)
    told = os.read(main, 65536).decode()
    os.close(main)
    assert done.returncode == 0 and Path("mine.toml").exists()
    assert sum(question in told for question in new.QUESTIONS.values()) == questions
