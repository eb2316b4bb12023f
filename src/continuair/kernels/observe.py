"""Kernels along a log: tips; reactions, energies and momenta; camera and image features."""

from functools import cache
from typing import Any

import warp as wp

from continuair.device.arguments import arguments
from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.arm.chain import chain_code
from continuair.kernels.arm.tip import tip_code
from continuair.kernels.dynamics import Dynamics
from continuair.kernels.elastic import elastic_code
from continuair.kernels.flight import flight_code
from continuair.kernels.logs import push_reader
from continuair.kernels.sensing.camera import CameraCode
from continuair.sections.arc.bend import bend_code
from continuair.vehicle.layout import MOTION, observed_columns, watched_columns


@cache
def _branches_of_log(numbers: Numbers, tree: Tree) -> Any:
    """Return the function that reads the followed branches (cos, sin) of a log row."""
    types, known = device_types(numbers, tree), elementary_code(numbers)
    Cell, Along, sections = types.Cell, types.Along, types.layout.sections
    of_sample, sine, cosine = number_code(numbers).of_sample, known.sine, known.cosine
    branch_at, roll_at = types.layout.branch.start, types.layout.euler.start
    arcs, vec2, with_two = bend_code(numbers, tree), types.vec2, types.with_two
    count, section_of, angle_at = arcs.count, arcs.section_of, arcs.angle_at

    @wp.func
    def logged_along(log: wp.array3d(dtype=Cell), run: int, sample: int):
        out = Along()
        for k in range(count):
            i = section_of(k)
            angle = of_sample(log, run, sample, branch_at + angle_at(i))
            out = with_two(out, i, vec2(cosine(angle), sine(angle)))
        roll = of_sample(log, run, sample, roll_at)
        return with_two(out, sections, vec2(cosine(roll), sine(roll)))

    return logged_along


def _observer_of_arm(
    numbers: Numbers, tree: Tree, dynamics: Dynamics, before: Any, arm: int
) -> Any:
    """Return the function that writes the reactions of an arm, after those of `before`."""
    types = device_types(numbers, tree)
    Cell, Real, keep = types.Cell, types.Real, number_code(numbers).keep
    State, Flight = types.State, flight_code(numbers, tree).Flight
    vec3, bends, at = types.vec3, types.layout.bends, observed_columns(len(tree.sections))
    load_on_arm = dynamics.loads.load_on_arm(arm)
    arm_total = chain_code(numbers, tree, dynamics.bias).of_arm(arm)
    attitude_of, velocity_of = types.attitude_of, types.velocity_of
    spin_of, bend_rates_of = types.spin_of, types.bend_rates_of
    force, moment = (at[name].start + 3 * arm for name in ("base_force", "base_moment"))
    freezes, couples = dynamics.freezes, dynamics.couples
    Push, Along = types.Push, types.Along

    @wp.func
    def observe(
        out: wp.array3d(dtype=Cell), sample: int, y: State, dy: State, begun: State, along: Along,
        flight: Flight, row: int, push: Push,
    ):  # fmt: skip
        before(out, sample, y, dy, begun, along, flight, row, push)
        q, w, plant = attitude_of(y), spin_of(y), flight.plant
        # The UAV exerts on the arm the arm's part of its own rows.
        seen = y
        if wp.static(freezes):
            seen = begun
        total = arm_total(seen, flight.coefficients, plant, flight.vehicle)
        falling = velocity_of(dy) + vec3(Real(0.0), Real(0.0), flight.gravity)
        a = wp.quat_rotate_inv(q, falling)
        dw = spin_of(dy)
        taken = plant.arm_mass[arm] * a + wp.cross(dw, total.H)
        twisted = wp.cross(total.H, a) + total.I * dw
        if wp.static(freezes):
            taken += wp.cross(w, wp.cross(w, total.H))
            twisted += wp.cross(w, total.I * w)
        else:
            taken += total.force
            twisted += total.moment
        if wp.static(couples):
            ddb = bend_rates_of(dy)
            for j in range(bends):
                taken += ddb[j] * vec3(total.F[0, j], total.F[1, j], total.F[2, j])
                twisted += ddb[j] * vec3(total.L[0, j], total.L[1, j], total.L[2, j])
        load = load_on_arm(y, along, flight, row, push)
        taken -= load.force
        twisted -= load.moment
        for j in range(3):
            keep(out, flight.run, sample, force + j, -taken[j])
            keep(out, flight.run, sample, moment + j, -twisted[j])

    return observe


def tips_kernel(numbers: Numbers, tree: Tree) -> Any:
    """Return the kernel `tips`, the same for every model: the columns of all tips."""
    types, structs, tip_at = device_types(numbers, tree), flight_code(numbers, tree), tip_code
    code, Drive = number_code(numbers), arguments(numbers.precision).Drive
    Cell, State, Plant, Vehicles = types.Cell, types.State, types.Plant, structs.Vehicles
    flight_of, load_state, keep, lanes = (
        structs.flight_of,
        types.load_state,
        code.keep,
        code.lanes,
    )
    at = observed_columns(types.layout.arms)
    attitude_at, names = at["tip_attitude"].start, ("tip_position", "tip_velocity")
    position_at, velocity_at = (at[name].start for name in names)
    turning_at = at["tip_angular_velocity"].start

    def and_arm(before: Any, arm: int) -> Any:
        world_tip = tip_at(numbers, tree).world_tip_of(arm)
        position, velocity, turning = (
            first + 3 * arm for first in (position_at, velocity_at, turning_at)
        )
        attitude = attitude_at + 4 * arm

        @wp.func
        def written(out: wp.array3d(dtype=Cell), run: int, sample: int, y: State, plant: Plant):
            before(out, run, sample, y, plant)
            tip = world_tip(y, plant)
            for j in range(3):
                keep(out, run, sample, position + j, tip.position[j])
                keep(out, run, sample, velocity + j, tip.velocity[j])
                keep(out, run, sample, turning + j, tip.turning[j])
            for j in range(4):
                keep(out, run, sample, attitude + j, tip.attitude[j])

        return written

    @wp.func
    def nothing(out: wp.array3d(dtype=Cell), run: int, sample: int, y: State, plant: Plant):
        pass

    write = nothing
    for arm in range(types.layout.arms):
        write = and_arm(write, arm)

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def tips(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        pack, sample = wp.tid()
        run = pack * lanes
        plant = flight_of(vehicles, drive, run).plant
        write(out, run, sample, load_state(log, run, sample, plant.unit), plant)

    return tips


def observe_kernel(numbers: Numbers, tree: Tree, dynamics: Dynamics) -> Any:
    """Return the kernel `observe` of a model: reactions, energies and momenta along a log."""
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    chain, code = chain_code(numbers, tree, dynamics.bias), number_code(numbers)
    keep, lanes = code.keep, code.lanes
    Cell, layout = types.Cell, types.layout
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    vec3, Flight = types.vec3, structs.Flight
    position_of, attitude_of, velocity_of = types.position_of, types.attitude_of, types.velocity_of
    bends_of, bend_rates_of, spin_of = types.bends_of, types.bend_rates_of, types.spin_of
    Vehicles, mount_of = structs.Vehicles, types.mount_of
    Drive = arguments(numbers.precision).Drive
    flight_of, freeze, load_state = structs.flight_of, structs.freeze, types.load_state
    rate_of, total_of, half = dynamics.rate_of, chain.total_of, Real(0.5)
    logged_along, logged_push = _branches_of_log(numbers, tree), push_reader(numbers, tree)
    at = {name: where.start for name, where in observed_columns(layout.arms).items()}
    kinetic_energy, gravity_energy = at["kinetic_energy"], at["gravity_energy"]
    elastic_energy = at["elastic_energy"]
    linear_momentum, angular_momentum = at["linear_momentum"], at["angular_momentum"]
    coupled, freezes = dynamics.model == "coupled", dynamics.freezes
    laden_of, loads = dynamics.laden_of, dynamics.laden_of is not None
    bends, arms, elastic = layout.bends, layout.arms, elastic_code(numbers, tree)
    springs, coupled_springs = elastic.springs, elastic.pairs > 0

    @wp.func
    def nothing(
        out: wp.array3d(dtype=Cell), sample: int, y: State, dy: State, begun: State, along: Along,
        flight: Flight, row: int, push: Push,
    ):  # fmt: skip
        pass

    observe_arms = nothing
    for arm in range(arms):
        observe_arms = _observer_of_arm(numbers, tree, dynamics, observe_arms, arm)

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def observe(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        """Write the observed columns; drive: inputs, one row per sample or one for all."""
        pack, sample = wp.tid()
        run = pack * lanes
        flight = flight_of(vehicles, drive, run)
        y = load_state(log, run, sample, flight.plant.unit)
        begun = y
        if wp.static(freezes):
            begun = load_state(log, run, 0, flight.plant.unit)
            flight.frozen = freeze(flight, begun)
        unladen = flight
        if wp.static(loads):
            flight = laden_of(flight, y)
        plant = flight.plant
        row = sample * flight.stride
        along = logged_along(log, run, sample)
        push = logged_push(log, run, sample)
        dy = rate_of(y, along, unladen, row, push)
        observe_arms(out, sample, y, dy, begun, along, flight, row, push)

        p, q, w, m = position_of(y), attitude_of(y), spin_of(y), plant.mass
        b = bends_of(y)
        db = bend_rates_of(y)
        total = total_of(y, flight.coefficients, plant, flight.vehicle)
        # Moments of the rigid vehicle, then the contributions of the bends.
        c = total.H
        inertia = plant.uav_inertia + total.I
        height = m * p[2]
        if wp.static(freezes):
            c = flight.frozen.moment
            inertia = flight.frozen.inertia
            own = total.H
            for k in range(arms):
                own -= plant.arm_mass[k] * mount_of(plant, k)
            height += wp.quat_rotate(flight.frozen.attitude, own)[2]
        height += wp.quat_rotate(q, c)[2]
        swept = vec3()
        spun = vec3()
        own_energy = Real(0.0)
        stored = Real(0.0)
        for j in range(bends):
            swept += db[j] * vec3(total.F[0, j], total.F[1, j], total.F[2, j])
            spun += db[j] * vec3(total.L[0, j], total.L[1, j], total.L[2, j])
            stored += half * plant.stiffness[j] * b[j] * b[j]
            for i in range(bends):
                own_energy += half * total.M[i, j] * db[i] * db[j]
        if wp.static(coupled_springs):
            aside = springs(plant, b)
            for j in range(bends):
                stored += half * aside[j] * b[j]
        if wp.static(freezes):
            swept = vec3()
            spun = vec3()
        v = wp.quat_rotate_inv(q, velocity_of(y))
        linear = m * v + wp.cross(w, c)
        angular = wp.cross(c, v) + inertia * w
        kinetic = own_energy + half * (wp.dot(v, linear) + wp.dot(w, angular))
        if wp.static(coupled):
            kinetic += wp.dot(v, swept) + wp.dot(w, spun)
        moving = wp.quat_rotate(q, linear + swept)
        about_origin = wp.quat_rotate(q, angular + spun) + wp.cross(p, moving)
        for j in range(3):
            keep(out, run, sample, linear_momentum + j, moving[j])
            keep(out, run, sample, angular_momentum + j, about_origin[j])
        keep(out, run, sample, kinetic_energy, kinetic)
        keep(out, run, sample, gravity_energy, flight.gravity * height)
        keep(out, run, sample, elastic_energy, stored)

    return observe


def watch_kernel(numbers: Numbers, tree: Tree, of_camera: CameraCode) -> Any:
    """Return the kernel `watch`: true image, camera pose and twist, columns watched_columns.

    motion: of the target's centroid at the samples (samples, runs or 1, MOTION).
    """
    types = device_types(numbers, tree)
    code, points = number_code(numbers), of_camera.points
    Cell, Plants, Cameras = types.Cell, code.rows_of(types.Plant), code.rows_of(of_camera.Camera)
    plant_of, camera_of, lanes = (
        code.reader_of(types.Plant),
        code.reader_of(of_camera.Camera),
        code.lanes,
    )
    load_state, three_of, keep = types.load_state, types.three_of, code.keep
    logged_along = _branches_of_log(numbers, tree)
    view_of, look, columns = of_camera.view_of, of_camera.look, watched_columns(points)
    position, attitude = columns["camera_position"].start, columns["camera_attitude"].start
    centroid = MOTION["position"].start
    twist, image = columns["camera_twist"].start, columns["image"].start
    depth, in_view = columns["depth"].start, columns["in_view"].start

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def watch(
        plants: Plants,
        cameras: Cameras,
        corners: wp.array2d(dtype=Cell),
        motion: wp.array3d(dtype=Cell),
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        pack, sample = wp.tid()
        run = pack * lanes
        plant = plant_of(plants, run)
        camera = camera_of(cameras, run)
        y = load_state(log, run, sample, plant.unit)
        along = logged_along(log, run, sample)
        view = view_of(y, along, plant, camera)
        sight = look(view, camera, three_of(motion, sample, run, centroid), corners)
        for j in range(3):
            keep(out, run, sample, position + j, view.position[j])
        for j in range(4):
            keep(out, run, sample, attitude + j, view.attitude[j])
        for j in range(6):
            keep(out, run, sample, twist + j, view.twist[j])
        for i in range(2 * points):
            keep(out, run, sample, image + i, sight.image[i])
        for i in range(points):
            keep(out, run, sample, depth + i, sight.depth[i])
            keep(out, run, sample, in_view + i, sight.seen[2 * i])

    return watch
