"""What a user reads when a vehicle, or a file that describes one, cannot be used."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from continuair.errors import InputError, shown
from continuair.vehicle.disk import Disk
from continuair.vehicle.vehicle import Vehicle, load_vehicle
from tests.refusals import refused

PAPER = load_vehicle("paper")
PAPER_TOML = Path(__file__).parents[1] / "src/continuair/presets/paper.toml"


DISK = {"position": 1.0, "mass": 1e-3}
UNUSABLE: list[tuple[Any, str]] = [
    (3, "changes"),
    ({"uav.mass": -1.0}, "uav.mass"),
    ({"uav.mass": 0}, "uav.mass"),
    ({"uav.mass": math.nan}, "uav.mass"),
    ({"uav.mass": math.inf}, "uav.mass"),
    ({"uav.mass": 10**400}, "uav.mass"),
    ({"uav.mass": True}, "uav.mass"),
    ({"uav.mass": np.True_}, "uav.mass"),
    ({"uav.mass": "2 kg"}, "uav.mass"),
    ({"uav.mass": None}, "uav.mass"),
    ({"uav.mass": [[1.0, 2.0]]}, "uav.mass"),
    ({"uav.mass": []}, "uav.mass"),
    ({"uav.mass": np.array([True, True])}, "uav.mass"),
    ({"uav.mass": [1.0, "x"]}, "uav.mass"),
    ({"uav.mass": PAPER}, "uav.mass"),
    ({"uav.mount": [0.0, 1.0]}, "uav.mount"),
    ({"uav.mount": "abc"}, "uav.mount"),
    ({"uav.mount": [0, 0, math.nan]}, "uav.mount"),
    ({"uav.inertia": [1, 2]}, "uav.inertia"),
    ({"uav.inertia": [[1, 1], [1]]}, "uav.inertia"),
    ({"uav.inertia": [1, 1, True]}, "uav.inertia"),
    ({"uav.inertia": [1, -2, 1]}, "uav.inertia"),
    ({"uav.inertia": [[2, 3, 0], [3, 2, 0], [0, 0, 2]]}, "uav.inertia"),
    ({"uav.inertia": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}, "uav.inertia"),
    ({"arm.raduis": 1}, "arm.raduis"),
    ({"arms.radius": 1}, "arms"),
    ({"arm.poisson_ratio": 0.3}, "arm.poisson_ratio"),
    ({"arm.diameter": 0.01}, "arm.diameter"),
    ({"arm.radius.x": 1}, "arm.radius.x"),
    ({"": 1}, "''"),
    ({3: 1}, "3"),
    ({"arm": 3}, "arm"),
    ({"camera": None}, "camera"),
    ({"name": 3}, "name"),
    ({"name": ""}, "name"),
    ({"name": "  "}, "name"),
    ({"name": "a\nb"}, "name"),
    ({"name": ["a", "b"]}, "name"),
    ({"uav": {"mass": 1.0}}, "uav.inertia"),
    ({"camera": {"fov": 1.0}}, "camera.fov"),
    ({"arm.damping": 0.1, "arm.damping_ratio": 0.2}, "arm.damping"),
    ({"arm.damping_ratio": [None, 0.1]}, "arm.damping_ratio"),
    ({"arm.radius": 1e200}, "arm.radius"),
    ({"arm.radius": 5.0}, "arm.radius"),
    ({"arm.radius": 1e-200}, "arm.radius"),
    ({"arm.disks.0.mass": 1}, "arm.disks.0"),
    ({"arm.disks": 3}, "arm.disks"),
    ({"arm.disks": [DISK] * 1001}, "arm.disks"),
    ({"arm.disks": [3]}, "arm.disks.0"),
    ({"arm.disks": {"position": 1.0, "mass": 1.0}}, "arm.disks"),
    ({"arm.disks": [{"position": 1.2, "mass": 1}]}, "arm.disks.0.position"),
    ({"arm.disks": [{"position": 1.0, "mass": -1}]}, "arm.disks.0.mass"),
    ({"camera.image_size": [10.5, 10]}, "camera.image_size"),
    ({"camera.image_size": [0, 1]}, "camera.image_size"),
    ({"camera.focal_length": [0, 800]}, "camera.focal_length"),
    ({"camera.tip_frame": "fixed"}, "camera.tip_frame"),
    ({"arm.radius": [1, 2], "uav.mass": [1, 2, 3]}, "arm.radius"),
]


@pytest.mark.parametrize(("changes", "field"), UNUSABLE, ids=lambda value: str(value)[:40])
def test_unusable_value_is_refused_in_one_sentence_with_field_value_and_remedy(
    changes: Any, field: str
) -> None:
    with refused(field):
        PAPER.replace(changes)


def test_several_problems_are_told_one_per_line() -> None:
    with pytest.raises(InputError) as caught:
        Vehicle(
            name="x", uav={"mass": -1, "inertia": [1, 1, 1]}, arm={**dict(PAPER.arm), "length": 0}
        )
    assert [each.field for each in caught.value.errors] == ["uav.mass", "arm.length"]
    assert len(str(caught.value).splitlines()) == 2


def test_fields_cannot_be_assigned_or_deleted() -> None:
    with refused("mass"):
        PAPER.uav.mass = 3  # type: ignore[misc]
    with refused("name"):
        del PAPER.name


def test_rows_that_were_read_as_a_batch_of_diagonals_are_told_so() -> None:
    with refused("uav.inertia") as caught:
        PAPER.replace({"uav.inertia": [[1, 0, 0], [0, 1, 0]]})
    assert caught.value.place.startswith("run 0") and "2 rows" in caught.value.place


def test_a_class_is_shown_by_its_name() -> None:
    assert shown(np.float64) == "<class 'numpy.float64'>"


TEXT = PAPER_TOML.read_text(encoding="utf-8")
BAD_FILES = [
    (TEXT.replace("mass = 2.0", "mass = -2.0"), "uav.mass"),
    (TEXT.replace("mass = 2.0", "mass = nan"), "uav.mass"),
    (TEXT.replace("mass = 2.0", ""), "uav.mass"),
    (TEXT.replace("mass = 2.0", "mass = 2.0\nmasss = 1"), "uav.masss"),
    # The right one is missing as well.
    (TEXT.replace("radius", "radus"), "arm.radus"),
    (TEXT + "[[arm.disks]]\nposition = 1.0\nmas = 0.1\n", "arm.disks.0.mas"),
    (TEXT.replace("damping = 0.0", "damping = 1\ndamping_ratio = 0.1"), "arm.damping"),
    (TEXT.replace("mass = 2.0", "mass 2.0"), "file"),
    (TEXT + "a = '''\n", "file"),
    (b"\xff\xfe", "file"),
]


@pytest.mark.parametrize(("content", "field"), BAD_FILES)
def test_malformed_file_is_refused_by_its_name_and_field(
    tmp_path: Path, content: str | bytes, field: str
) -> None:
    path = tmp_path / "mine.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with refused(field, place=path):
        load_vehicle(path)


@pytest.mark.parametrize(
    ("name", "field"),
    [
        (Path(__file__).parent, "file"),
        ("papr", "vehicle"),
        ("", "vehicle"),
        ("x" * 5000, "vehicle"),
        ("nowhere/mine.toml", "file"),
        (Path("paper"), "file"),
        ("a\0.toml", "vehicle"),
        (3, "vehicle"),
    ],
)
def test_vehicle_that_is_not_there_is_refused(name: Any, field: str) -> None:
    with refused(field):
        load_vehicle(name)


def test_file_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("\ufeff" + TEXT, encoding="utf-8")
    assert load_vehicle(str(tmp_path / "mine.toml")) == PAPER


def test_file_with_disks_is_read(tmp_path: Path) -> None:
    disk = "[[arm.disks]]\nposition = 1.0\nmass = 0.1\ninertia = [1e-5, 2e-5]\n"
    path = tmp_path / "mine.toml"
    path.write_text(TEXT + disk, encoding="utf-8")
    assert load_vehicle(path).arm.disks == (Disk(position=1, mass=0.1, inertia=(1e-5, 2e-5)),)
