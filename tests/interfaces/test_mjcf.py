"""MuJoCo finds in an MJCF file what the vehicle is, and how its arms bend."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigvalsh
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.equations.camera import axes_on_body, on_body
from continuair.equations.strain import rod_curve, strain_of
from continuair.flight.labels import flat_labels
from continuair.interfaces.chain import links_of
from tests.refusals import refused
from tests.sections.strains import flying, rod

mujoco = pytest.importorskip("mujoco", exc_type=ImportError)

PRESETS = ("paper", "two_section", "dual_arm")
CANTILEVER = 1.875104068711961**2
"""ω √(ρA l⁴ / EI) of a clamped beam's first mode."""
TILTED = {"layout": "hex_tilted", "tilt": 0.3, "lever": 0.25, "thrust_limits": [0.5, 14.0],
          "torque_per_thrust": 0.02}  # fmt: skip


def loaded(vehicle: ca.Vehicle, folder: Path, links: int = 8) -> tuple[Any, Any]:
    """The compiled model and its data, straight and at rest."""
    path = folder / "vehicle.xml"
    path.unlink(missing_ok=True)
    ca.to_mjcf(vehicle, path, links=links)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def inertia(model: Any, data: Any) -> np.ndarray:
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, M, data.qM)
    return M


def springs(model: Any) -> np.ndarray:
    return np.diag(model.jnt_stiffness[model.dof_jntid])


def with_rotors() -> ca.Vehicle:
    paper: dict[str, Any] = ca.load_vehicle("paper").describe()
    return ca.Vehicle(**paper | {"uav": paper["uav"] | {"rotors": TILTED}})


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("links", [1, 3, 8])
def test_mass_and_inertia_of_the_straight_vehicle_are_ours(
    name: str, links: int, tmp_path: Path
) -> None:
    vehicle = ca.load_vehicle(name)
    model, data = loaded(vehicle, tmp_path, links)
    assert model.body_mass.sum() == pytest.approx(vehicle.mass, rel=1e-12)
    # Pieces of a rod add up to it; ours is bent by 1e-6 rad.
    expected = ca.rigid_inertia(vehicle)
    np.testing.assert_allclose(
        inertia(model, data)[:6, :6], expected, rtol=0, atol=2e-6 * np.abs(expected).max()
    )


def test_a_bend_between_x_and_y_does_not_twist_the_tip(tmp_path: Path) -> None:
    """An arc of 1.5 rad at 45°: off by a quarter at twice the links, as one along x is."""
    vehicle, off = ca.load_vehicle("paper"), []
    q = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5, np.pi / 4])
    tip = ca.equations.tip_of(vehicle, 0)
    turned = Rotation.from_matrix(ca.equations.section_rotation(vehicle, q, **tip))
    for links in (8, 16, 32):
        model, data = loaded(vehicle, tmp_path, links)
        for name, sign in (("x", 1.0), ("y", -1.0)):
            for index in range(1, links + 1):
                joint = data.joint(f"arm.0.{index}.{name}")
                joint.qpos = sign * 1.5 / np.sqrt(2.0) * vehicle.arm.length / links
        mujoco.mj_kinematics(model, data)
        site = data.site("arm.tip")
        found = Rotation.from_matrix(site.xmat.reshape(3, 3))
        apart = np.linalg.norm(site.xpos - ca.equations.position(vehicle, q, **tip))
        off.append([apart, (turned.inv() * found).magnitude()])
    ratios = np.array(off[:-1]) / off[1:]
    np.testing.assert_allclose(ratios, 4.0, rtol=0.1)


def test_a_clamped_chain_swings_as_a_beam_and_constant_curvature_by_27_percent_faster(
    tmp_path: Path,
) -> None:
    vehicle = ca.load_vehicle("paper")
    arm = vehicle.arm
    beam = CANTILEVER * np.sqrt(arm.bending_stiffness / (arm.mass_per_length * arm.length**4))
    off = []
    for links in (4, 8, 16):
        model, data = loaded(vehicle, tmp_path, links)
        squares = eigvalsh(springs(model)[6:, 6:], inertia(model, data)[6:, 6:])
        off.append(np.sqrt(squares[0]) / beam - 1.0)
    assert np.abs(off[0]) < 0.02
    # A quarter is left at twice the links, but for the rotary inertia, which the beam has not.
    assert off[1] == pytest.approx(off[0] / 4, rel=0.05)
    assert off[2] == pytest.approx(off[1] / 4, rel=0.05)
    ours = float(ca.modes(vehicle, base="clamped", gravity=0.0).frequencies[0])
    assert ours / beam == pytest.approx(1.272, abs=1e-3)


ROD = {"bending": 3, "twist": 2, "stretch": 1, "shear": 1}
"""Highest orders of a strain."""


def posed(model: Any, data: Any, vehicle: ca.Vehicle, bends: np.ndarray, links: int) -> None:
    """Set the joints to the strain of their parts, at coordinates of the only section."""
    section = vehicle.arms[0].section[0]
    for index in range(links):
        turning, advance = strain_of(section.orders, bends, (index + 0.5) / links)
        strain = {"x": turning[0], "y": turning[1], "z": turning[2]}
        strain |= {f"slide_{axis}": value for axis, value in zip("xyz", advance, strict=True)}
        strain["slide_z"] += 1.0
        for name, value in strain.items():
            data.joint(f"0.0.{index + 1}.{name}").qpos = value * section.length / links
    mujoco.mj_kinematics(model, data)


def test_a_chain_of_a_strained_section_takes_the_shape_of_the_rod(tmp_path: Path) -> None:
    """All components of the strain vary; at twice the links a quarter is off."""
    vehicle = flying(rod(**ROD))
    section, random = vehicle.arms[0].section[0], np.random.default_rng(4)
    bends = random.normal(size=section.coordinates) * np.repeat([1.5, 0.1], [11, 6])
    points, frames = rod_curve(section.orders, section.length, bends, [section.length])
    off = []
    for links in (8, 16, 32):
        model, data = loaded(vehicle, tmp_path, links)
        posed(model, data, vehicle, bends, links)
        site = data.site("0.tip")
        end = np.asarray(vehicle.arms[0].mount) + points[0]
        turn = (frames[0] @ np.diag([1.0, -1.0, -1.0])).T @ site.xmat.reshape(3, 3)
        off.append([np.linalg.norm(site.xpos - end), Rotation.from_matrix(turn).magnitude()])
        found = dict(zip(flat_labels(vehicle), bends, strict=True))
        mujoco.mj_forward(model, data)
        lengths = [float(data.tendon(name).length[0]) for name in found]
        # Sums at the middles of parts are off the integrals by 1 / N² of the highest orders.
        assert np.abs(lengths - bends).max() < 12.0 / links**2 * np.abs(bends).max()
    np.testing.assert_allclose(np.array(off[:-1]) / off[1:], 4.0, rtol=0.1)


def test_a_clamped_chain_swings_and_twists_as_the_strained_arm_does(tmp_path: Path) -> None:
    vehicle = flying(rod(bending=3, twist=2))
    section = vehicle.arms[0].section[0]
    wave = np.sqrt(section.rigidities()[2] / (section.axial_inertia_per_length))
    twists = 0.5 * np.pi * wave / section.length
    ours = ca.modes(vehicle, base="clamped", gravity=0.0).frequencies
    assert np.abs(ours / twists - 1.0).min() < 1e-4
    expected = np.array([ours[0], twists])
    off = []
    for links in (8, 16, 32):
        model, data = loaded(vehicle, tmp_path, links)
        squares = eigvalsh(springs(model)[6:, 6:], inertia(model, data)[6:, 6:])
        found = np.sqrt(squares)
        twisting = found[np.abs(found / expected[1] - 1.0).argmin()]
        off.append(np.array([found[0], twisting]) / expected - 1.0)
    assert np.abs(off[0]).max() < 5e-3
    np.testing.assert_allclose(np.array(off[:-1]) / off[1:], 4.0, rtol=0.1)


def test_an_arm_held_level_sags_as_a_beam_does(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("paper")
    arm, links = vehicle.arm, 8
    model, data = loaded(vehicle, tmp_path, links)
    # A weight across the arm that bends it by little, as the formula asks.
    model.opt.gravity = [1e-3, 0.0, 0.0]
    mujoco.mj_forward(model, data)
    data.qpos[7:] = -np.linalg.solve(springs(model)[6:, 6:], data.qfrc_bias[6:])
    mujoco.mj_kinematics(model, data)
    beam = 1e-3 * arm.mass_per_length * arm.length**4 / (8 * arm.bending_stiffness)
    # Joints in the middles of the parts sum f = (l - s)³ / 2 by the midpoint rule, which is off by
    # h²/24 (f'(0) - f'(l)), a share of 1 / 2 N² of the integral.
    off = data.site("arm.tip").xpos[0] / beam - 1.0
    assert off == pytest.approx(-1.0 / (2.0 * links**2), rel=1e-6)


@pytest.mark.parametrize("name", PRESETS)
def test_bend_moments_bend_a_section_as_they_bend_ours(name: str, tmp_path: Path) -> None:
    vehicle = ca.load_vehicle(name)
    model, data = loaded(vehicle, tmp_path)
    sections = [section for arm in vehicle.arms for section in arm.section]
    stiffness = np.repeat([each.bending_stiffness * each.length for each in sections], 2)
    k = 0.1 / (1.0 + np.arange(len(stiffness)))
    moments = stiffness * k
    data.ctrl[6:] = moments
    mujoco.mj_forward(model, data)
    data.qpos[7:] = np.linalg.solve(springs(model)[6:, 6:], data.qfrc_actuator[6:])
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.ten_length, k, rtol=1e-9)
    # The tips are where arcs of those bends have theirs.
    q = np.zeros(6 + len(k))
    q[6::2], q[7::2] = np.hypot(k[::2], k[1::2]), np.arctan2(k[1::2], k[::2])
    for index, arm in enumerate(vehicle.arms):
        ours = ca.equations.position(vehicle, q, **ca.equations.tip_of(vehicle, index))
        found = data.site(f"{arm.name}.tip").xpos
        np.testing.assert_allclose(found, ours, rtol=0, atol=5e-4)


def test_pushes_act_along_the_axes_that_ours_act_along(tmp_path: Path) -> None:
    model, data = loaded(ca.load_vehicle("paper"), tmp_path)
    data.qpos[3:7] = np.roll(Rotation.from_euler("ZYX", [0.4, 0.3, -0.7]).as_quat(), 1)
    data.ctrl[:6] = wrench = [1.0, -2.0, 3.0, 0.4, 0.5, -0.6]
    mujoco.mj_forward(model, data)
    # Of a free joint: force in world axes, moment in body axes.
    np.testing.assert_allclose(data.qfrc_actuator[:6], wrench, rtol=0, atol=1e-12)


def test_rotors_push_as_the_allocation_says_and_within_their_limits(tmp_path: Path) -> None:
    vehicle = with_rotors()
    rotors = vehicle.uav.rotors
    assert rotors is not None
    model, data = loaded(vehicle, tmp_path)
    thrusts = np.linspace(2.0, 7.0, 6)
    data.ctrl[:6] = thrusts
    mujoco.mj_forward(model, data)
    expected = rotors.allocation @ thrusts
    np.testing.assert_allclose(data.qfrc_actuator[:6], expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(model.actuator_ctrlrange[:6], 6 * [[0.5, 14.0]])


def test_the_motor_of_a_weak_rotor_has_its_limits(tmp_path: Path) -> None:
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    listed: list[dict[str, Any]] = [
        {"position": [0.2 * x, 0.2 * y, 0.0], "spin": (-1) ** i} for i, (x, y) in enumerate(corners)
    ]
    listed[2]["thrust_limits"] = (0.0, 9.0)
    rotors = {"rotor": listed, "thrust_limits": (0.5, 14.0), "torque_per_thrust": 0.02}
    uav = {"mass": 1.2, "inertia": [0.02, 0.02, 0.03], "rotors": rotors}
    model, _ = loaded(ca.Vehicle(name="weak", uav=uav), tmp_path)
    expected = [[0.5, 14.0], [0.5, 14.0], [0.0, 9.0], [0.5, 14.0]]
    np.testing.assert_allclose(model.actuator_ctrlrange[:4], expected)


def test_a_free_vehicle_falls_for_a_second_without_a_warning(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("two_section")
    model, data = loaded(vehicle, tmp_path, links=2)
    data.qpos[7:] = 0.1
    mujoco.mj_forward(model, data)
    start = data.body("uav").subtree_com.copy()
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    assert not any(warning.number for warning in data.warning)
    # Whatever the arm does, the centre of mass falls.
    fallen = data.body("uav").subtree_com - start
    np.testing.assert_allclose(fallen, [0, 0, -9.81 / 2 * data.time**2], rtol=0, atol=1e-7)


def test_the_camera_looks_where_ours_does_with_its_lens(tmp_path: Path) -> None:
    lens = {"camera.principal_point": (620.0, 430.0), "camera.focal_length": (800.0, 700.0)}
    turn = tuple(Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_quat().tolist())
    place = {"camera.attitude": turn, "camera.position": (0.01, 0.02, 0.03)}
    vehicle = ca.load_vehicle("dual_arm").replace({**lens, **place})
    model, data = loaded(vehicle, tmp_path)
    camera = data.camera("camera")
    np.testing.assert_allclose(camera.xpos, on_body(vehicle), rtol=0, atol=1e-6)
    # MuJoCo's cameras look along -z with y up.
    axes = axes_on_body(vehicle) @ np.diag([1.0, -1.0, -1.0])
    np.testing.assert_allclose(camera.xmat.reshape(3, 3), axes, rtol=0, atol=1e-6)
    scene, view = mujoco.MjvScene(model, 100), mujoco.MjvCamera()
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, 0
    shown = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, view, shown, scene)
    seen = scene.camera[0]
    found = [seen.frustum_center, seen.frustum_width, seen.frustum_top, seen.frustum_bottom]
    expected = [(500 - 620) / 800, 500 / 800, 430 / 700, (430 - 1000) / 700]
    np.testing.assert_allclose(np.array(found) / seen.frustum_near, expected, rtol=0, atol=1e-6)


def test_a_backbone_without_a_radius_loads(tmp_path: Path) -> None:
    section = {"length": 0.4, "mass_per_length": 0.1, "bending_stiffness": 0.05}
    vehicle = ca.Vehicle(name="bare", uav={"mass": 1.0, "inertia": [0.01, 0.01, 0.02]}, arm=section)
    model, _ = loaded(vehicle, tmp_path)
    assert model.body_mass.sum() == pytest.approx(vehicle.mass)


def test_a_tip_body_without_mass_keeps_its_inertia(tmp_path: Path) -> None:
    body = {"arm.arm.tip.mass": 0.0, "arm.arm.tip.inertia": [2e-3, 2e-3, 1e-3]}
    vehicle = ca.load_vehicle("two_section").replace(body)
    model, data = loaded(vehicle, tmp_path)
    squares = eigvalsh(springs(model)[6:, 6:], inertia(model, data)[6:, 6:])
    ours = float(ca.modes(vehicle, base="clamped", gravity=0.0).frequencies[0])
    # It is 11 rad/s without the inertia.
    assert np.sqrt(squares[0]) == pytest.approx(ours, rel=1e-2)


def test_a_file_that_exists_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "mine.xml"
    path.write_text("mine")
    with refused("path"):
        ca.to_mjcf(ca.load_vehicle("paper"), path)
    assert path.read_text() == "mine"


@pytest.mark.parametrize("links", [0, 65, 2.5])
def test_a_number_of_links_that_cannot_be_is_refused(links: Any, tmp_path: Path) -> None:
    with refused("links"):
        ca.to_mjcf(ca.load_vehicle("paper"), tmp_path / "vehicle.xml", links=links)


def flown(model: Any, shorter: int) -> np.ndarray:
    """Tips after 30 ms of weightless spinning from a bend, at a share of the file's step."""
    steps = round(0.03 / model.opt.timestep) * shorter
    model.opt.timestep /= shorter
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    data.qpos[7:], data.qvel[3:6] = 0.02, (0.5, 1.0, 0.2)
    mujoco.mj_step(model, data, steps)
    # What is no number is reset by MuJoCo, to be seen in its warnings alone.
    assert not any(each.number for each in data.warning)
    tips = [site for site in range(model.nsite) if model.site(site).name.endswith("tip")]
    return np.asarray(data.site_xpos[tips])


@pytest.mark.parametrize(
    ("name", "damping", "links", "integrator"),
    [("paper", 0.0, 8, "RK4"), ("paper", 1e-4, 4, "RK4"), ("paper", 0.03, 8, "IMPLICITFAST"),
     ("paper", 0.3, 16, "IMPLICITFAST"), ("two_section", None, 8, "IMPLICITFAST"),
     ("dual_arm", None, 8, "IMPLICITFAST")],
)  # fmt: skip
def test_the_step_of_the_file_resolves_its_chain_whatever_the_damping(
    name: str, damping: float | None, links: int, integrator: str, tmp_path: Path
) -> None:
    vehicle = ca.load_vehicle(name)
    if damping is not None:
        vehicle = vehicle.replace({"arm.damping_ratio": damping})
    model, _ = loaded(vehicle, tmp_path, links)
    kind = mujoco.mjtIntegrator(model.opt.integrator)
    assert kind == getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    reach = max(sum(each.length for each in arm.section) for arm in vehicle.arms)
    assert np.abs(flown(model, 1) - flown(model, 4)).max() < 5e-4 * reach


def test_small_links_keep_their_own_inertia_or_are_refused(tmp_path: Path) -> None:
    """Bounded from below by 1e-12 kg m², a wire of 2 cm swung 5 to 25 % too slowly."""
    wire = {
        "uav.mass": 0.005, "uav.inertia": [1e-6, 1e-6, 2e-6], "arm.length": 0.05,
        "arm.radius": 1e-4, "arm.density": 6450.0, "arm.youngs_modulus": 60e9,
    }  # fmt: skip
    small = ca.load_vehicle("paper").replace(wire)
    model, data = loaded(small, tmp_path, links=8)
    exact = ca.rigid_inertia(small)
    np.testing.assert_allclose(
        inertia(model, data)[:6, :6], exact, rtol=0, atol=2e-6 * np.abs(exact).max()
    )
    found = np.sort(model.body_inertia.max(axis=1))
    for link in links_of(small.arm, 8):
        assert np.abs(found / link.transverse - 1.0).min() < 1e-6
    with refused("links"):
        ca.to_mjcf(small.replace({"arm.length": 0.02}), tmp_path / "wire.xml", links=64)
