"""A vehicle as an MJCF file, for MuJoCo and other engines of rigid bodies."""

from __future__ import annotations

import os
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.analysis.backbone import HALF_TURN
from continuair.errors import InputError
from continuair.files import new_file, save
from continuair.flight.labels import columns_of_bends, columns_of_moments, flat_labels
from continuair.interfaces.chain import coordinates_of, fastest_mode, freedoms_of, links_of
from continuair.interfaces.outline import equal_box, pointing, radius_of
from continuair.terms import name_of
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.camera import Camera
from continuair.vehicle.rotors import Rotors
from continuair.vehicle.section import Section
from continuair.vehicle.uav import Uav
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_RESOLVED = 0.5
"""Step times the fastest frequency, of which RK4 loses 1e-4 in a step; it is stable up to 2.8."""

_FREE_STEP = 1e-3
"""Step of a vehicle without arms, whose motion has no frequency of its own [s]."""

_LEAST_INERTIA = 1e-15
"""Below this a moment of a body is none to MuJoCo [kg m²]."""

_AXIAL = 0.01
"""What a link's moment about its tangent may be raised to, of that across it: backbones without a
radius have none."""


def to_mjcf(vehicle: Vehicle, path: str | os.PathLike[str], *, links: int = 8) -> None:
    """Write a vehicle as an MJCF file for MuJoCo.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch) without terms of its own.
    path : str or path-like
        Path of the new file.
    links : int, default 8
        Joints per section, in the middles of as many equal parts; each has two hinges with
        stiffness and damping, and further ones where the strain has twist, stretch or shear.

    Raises
    ------
    InputError
        If the vehicle cannot be represented, or the file exists.

    Notes
    -----
    The vehicle is a free body with a chain of rigid links per section. Sites: uav, rotors, tips.
    Actuators: thrusts of the rotors [N], or without rotors ``force_x`` … (world axes) and
    ``moment_x`` … (body axes); and ``bend_moment_x`` …, conjugate to a section's mean bend [1/m],
    the length of its tendon, or to the coordinates of its strain. docs/howto/export.md lists what
    the file does not represent.
    """
    check_single_vehicle(vehicle, strain=True)
    if vehicle.terms:
        raise InputError(
            "vehicle",
            f"has the term {name_of(vehicle.terms[0])}, which MuJoCo's format cannot hold",
            "leave it out with vehicle.replace({'terms': ()})",
        )
    if vehicle.tendons:
        raise InputError(
            "vehicle",
            "has tendons, whose laws MuJoCo's format cannot hold",
            "leave arm.tendon out, and give bend moments",
        )
    links = checks.whole("links", links, 1, 64)
    file = new_file("path", path)
    save("path", file, mjcf(vehicle, links))


def mjcf(vehicle: Vehicle, links: int) -> str:
    """Return the text of the MJCF file."""
    root = Element("mujoco", model=vehicle.name)
    SubElement(root, "compiler", angle="radian")
    option = SubElement(root, "option", gravity="0 0 -9.81")
    option.attrib |= _integration(vehicle, links)
    world = SubElement(root, "worldbody")
    tendons, actuators = Element("tendon"), Element("actuator")
    uav = _uav(world, vehicle.uav)
    if vehicle.uav.rotors is None:
        _pushes(world, actuators)
    else:
        _rotors(uav, actuators, vehicle.uav.rotors)
    for index, arm in enumerate(vehicle.arms):
        tip = _arm(uav, arm, links)
        if index == vehicle.camera_arm:
            _camera(tip, vehicle.camera)
    if not vehicle.arms:
        turn = _wxyz(Rotation.from_quat(HALF_TURN))
        mount = SubElement(uav, "body", name="mount", pos=_text(vehicle.uav.mount), quat=turn)
        _camera(mount, vehicle.camera)
    _bend_moments(tendons, actuators, vehicle, links)
    root.extend([tendons, actuators])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _integration(vehicle: Vehicle, links: int) -> dict[str, str]:
    """Return integrator and step.

    RK4 if it resolves the stiffest mode with its damping. Otherwise a first-order method that is
    stable for any damping, as the step of RK4 would be very short.
    """
    sections = [section for arm in vehicle.arms for section in arm.section]
    if not sections:
        return {"integrator": "RK4", "timestep": _text(_FREE_STEP)}
    modes = [fastest_mode(section, links) for section in sections]
    frequency, rate = np.max(modes, axis=0)
    step = _RESOLVED / frequency
    integrator = "RK4" if step * rate <= 2.0 * _RESOLVED else "implicitfast"
    return {"integrator": integrator, "timestep": _text(step)}


def _uav(world: Element, uav: Uav) -> Element:
    body = SubElement(world, "body", name="uav")
    SubElement(body, "freejoint", name="uav")
    _inertial(body, uav.mass, np.zeros(3), np.asarray(uav.inertia))
    box = equal_box(uav.mass, uav.inertia)
    _shown(body, "box", size=_text(box.half), quat=_wxyz(box.attitude))
    SubElement(body, "site", name="uav")
    return body


def _arm(uav: Element, arm: ArmChain, links: int) -> Element:
    """Add the chain of an arm; return the frame at its tip, z out of it."""
    turn = Rotation.from_quat(arm.attitude)
    body = SubElement(uav, "body", name=arm.name, pos=_text(arm.mount), quat=_wxyz(turn))
    down = 0.0
    for section in arm.section:
        for index, link in enumerate(links_of(section, links)):
            name = _joint(arm, section, index)
            body = SubElement(body, "body", name=name, pos=_text((0.0, 0.0, down)))
            if index:
                _freedoms(body, name, section, links, backwards=index % 2 == 0)
            axial = max(link.axial, 2.0 * _LEAST_INERTIA)
            if axial > max(link.axial, _AXIAL * link.transverse):
                raise InputError(
                    "links",
                    (
                        f"is {links}, of which the smallest has a moment of inertia of "
                        f"{link.transverse:.2g} kg m², too small for MuJoCo"
                    ),
                    "give fewer links",
                )
            across = np.diag([link.transverse, link.transverse, axial])
            _inertial(body, link.mass, np.array([0.0, 0.0, -link.centre]), across)
            line, radius = (0.0, 0.0, 0.0, 0.0, 0.0, -link.length), radius_of(section)
            _shown(body, "capsule", fromto=_text(line), size=_text(radius))
            down = -link.length
    tip = SubElement(body, "body", name=f"{arm.name}.tip", pos=_text((0.0, 0.0, down)))
    tip.set("quat", _wxyz(HALF_TURN))
    SubElement(tip, "site", name=f"{arm.name}.tip")
    if arm.tip is not None and (arm.tip.mass or np.any(arm.tip.inertia)):
        _inertial(tip, arm.tip.mass, np.asarray(arm.tip.centre), np.asarray(arm.tip.inertia))
    return tip


def _joint(arm: ArmChain, section: Section, index: int) -> str:
    return f"{arm.name}.{section.name}.{index}"


def _freedoms(body: Element, name: str, section: Section, links: int, backwards: bool) -> None:
    """Add the joint's hinges and slides, in turn x first and x last: in one order, their twists add
    up."""
    along = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    freedoms = freedoms_of(section, links)
    for each in reversed(freedoms) if backwards else freedoms:
        joint = SubElement(body, "joint", name=f"{name}.{each.name}", type=each.kind)
        joint.attrib |= {"axis": along[each.axis], "stiffness": _text(each.stiffness)}
        joint.set("damping", _text(each.damping))


def _rotors(uav: Element, actuators: Element, rotors: Rotors) -> None:
    """Add sites whose z is the thrust's; the drag torque turns with it."""
    turns = pointing(rotors.axes)
    placed = zip(rotors.hubs, rotors.axes, turns, rotors.allocation.T, rotors.limits, strict=True)
    for index, (hub, axis, turn, column, limits) in enumerate(placed, 1):
        name, torque = f"rotor_{index}", axis @ (column[3:] - np.cross(hub, axis))
        SubElement(uav, "site", name=name, pos=_text(hub), quat=_wxyz(turn))
        gear = _text((0.0, 0.0, 1.0, 0.0, 0.0, torque))
        motor = SubElement(actuators, "motor", name=name, site=name, gear=gear)
        motor.attrib |= {"ctrllimited": "true", "ctrlrange": _text(limits)}


def _pushes(world: Element, actuators: Element) -> None:
    """Add a force on B along the world's axes, and a moment along the body's."""
    SubElement(world, "site", name="world")
    for index, axis in enumerate("xyz"):
        gear = _text(np.eye(6)[index])
        force = SubElement(actuators, "motor", name=f"force_{axis}", site="uav", gear=gear)
        force.set("refsite", "world")
    for index, axis in enumerate("xyz", 3):
        gear = _text(np.eye(6)[index])
        SubElement(actuators, "motor", name=f"moment_{axis}", site="uav", gear=gear)


def _bend_moments(tendons: Element, actuators: Element, vehicle: Vehicle, links: int) -> None:
    """Add tendons whose length is a section's mean bend, or a coordinate of its strain, and whose
    force is conjugate to it."""
    names = iter(_coordinate_names(vehicle))
    for arm in vehicle.arms:
        for section in arm.section:
            for freedom, factors in coordinates_of(section, links):
                bend, moment = next(names)
                tendon = SubElement(tendons, "fixed", name=bend)
                for index, factor in enumerate(factors, 1):
                    joint = f"{_joint(arm, section, index)}.{freedom.name}"
                    SubElement(tendon, "joint", joint=joint, coef=_text(factor))
                SubElement(actuators, "motor", name=moment, tendon=bend)


def _coordinate_names(vehicle: Vehicle) -> list[tuple[str, str]]:
    """Return the name of each coordinate of the sections, and of the moment conjugate to it."""
    bends = flat_labels(vehicle) or columns_of_bends(vehicle)
    return list(zip(bends, columns_of_moments(vehicle), strict=True))


def _camera(tip: Element, camera: Camera) -> None:
    """Add the camera along the tip's z, with x to the right and y down as in images."""
    turn = Rotation.from_quat(camera.attitude) * Rotation.from_quat(HALF_TURN)
    found = SubElement(tip, "camera", name="camera", pos=_text(camera.position), quat=_wxyz(turn))
    size, (across, down) = np.asarray(camera.image_size), camera.principal_point
    found.set("resolution", " ".join(map(str, camera.image_size)))
    found.set("sensorsize", _text(size / 1e5))
    found.set("focalpixel", _text(camera.focal_length))
    # MuJoCo counts it from the image's middle, to the left and down.
    found.set("principalpixel", _text((size[0] / 2 - across, down - size[1] / 2)))


def _inertial(body: Element, mass: float, centre: np.ndarray, inertia: np.ndarray) -> None:
    xx, xy, xz, _, yy, yz, _, _, zz = inertia.ravel()
    found = SubElement(body, "inertial", pos=_text(centre), mass=_text(mass))
    if xy or xz or yz:
        found.set("fullinertia", _text((xx, yy, zz, xy, xz, yz)))
    else:
        found.set("diaginertia", _text((xx, yy, zz)))


def _shown(body: Element, kind: str, **attributes: str) -> None:
    """Add a geometry that is visible and has no contacts."""
    found = SubElement(body, "geom", type=kind, contype="0", conaffinity="0", mass="0")
    found.attrib |= attributes


def _wxyz(turn: Any) -> str:
    x, y, z, w = turn.as_quat() if isinstance(turn, Rotation) else turn
    return _text((w, x, y, z))


def _text(numbers: Any) -> str:
    return " ".join(repr(float(each)) for each in np.ravel(numbers))
