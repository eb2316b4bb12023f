"""Kernels of the closed loop: a roll-out with a controller, and what the camera sees along it."""

from types import SimpleNamespace

import warp as wp

from continuair.kernels.step import OPTIONS, UNSEEN


def controlled(code: SimpleNamespace, law: SimpleNamespace, every_stage: bool):
    """The kernel `rollout` with a law; every_stage: evaluated at every stage, else held."""
    Real, State, Row, Plant, Push = code.Real, code.State, code.Row, code.Plant, code.Push
    Frozen, Camera, Sight = code.Frozen, code.Camera, code.Sight
    Twist, vec2, vec3 = code.Twist, code.vec2, code.vec3
    rate_of, freeze, load_state = code.rate_of, code.freeze, code.load_state
    branch_at, followed, log_row = code.branch_at, code.followed, code.log_row
    unit_attitude, end_of = code.unit_attitude, code.end_of
    proprioception, weight_push = code.proprioception, code.weight_push
    view_of, look, blur, points = code.view_of, code.look, code.blur, code.points
    Gains, control, has_camera = law.Gains, law.control, code.in_use
    half, sixth, two, unseen = Real(0.5), Real(1.0 / 6.0), Real(2.0), UNSEEN

    @wp.struct
    class Scene:
        """The target's points about its centroid, its motion (rows, runs or 1, 6), and frames.

        frames: (runs, slots, 5 points) of images, depths and in-view flags on their way. needed: 1
        if a run ends when all points are lost, as it does for a controller that looks.
        """

        corners: wp.array(dtype=vec3)
        motion: wp.array3d(dtype=Real)
        desired: wp.array2d(dtype=Real)
        frames: wp.array3d(dtype=Real)
        needed: wp.int32

    @wp.func
    def expose(scene: Scene, run: int, frame: int, sight: Sight):
        slot = frame % scene.frames.shape[1]
        for i in range(2 * points):
            scene.frames[run, slot, i] = sight.image[i]
            scene.frames[run, slot, 2 * points + i] = sight.seen[i]
        for i in range(points):
            scene.frames[run, slot, 4 * points + i] = sight.depth[i]

    @wp.func
    def report(scene: Scene, run: int, frame: int):
        out = Sight()
        slot = frame % scene.frames.shape[1]
        for i in range(2 * points):
            out.image[i] = scene.frames[run, slot, i]
            out.seen[i] = scene.frames[run, slot, 2 * points + i]
        for i in range(points):
            out.depth[i] = scene.frames[run, slot, 4 * points + i]
        return out

    @wp.func
    def sense_of(
        time: Real,
        y: State,
        along: vec2,
        plant: Plant,
        coefficients: wp.array2d(dtype=Row),
        vehicle: int,
        gravity: Real,
        camera: Camera,
        scene: Scene,
        row: int,
        run: int,
    ):
        out = proprioception(time, y, plant)
        out.weight = weight_push(y, plant, coefficients, vehicle, gravity)
        if wp.static(has_camera):
            column = wp.min(run, scene.motion.shape[1] - 1)
            out.camera = camera
            out.view = view_of(y, along, plant, camera)
            out.camera_twist = out.view.twist
            at = vec3(
                scene.motion[row, column, 0],
                scene.motion[row, column, 1],
                scene.motion[row, column, 2],
            )
            moving = vec3(
                scene.motion[row, column, 3],
                scene.motion[row, column, 4],
                scene.motion[row, column, 5],
            )
            moving = wp.quat_rotate_inv(out.view.attitude, moving)
            out.target_twist = Twist(
                moving[0], moving[1], moving[2], Real(0.0), Real(0.0), Real(0.0)
            )
            out.sight = look(out.view, camera, at, scene.corners)
            wanted = wp.min(run, scene.desired.shape[0] - 1)
            for i in range(2 * points):
                out.desired[i] = scene.desired[wanted, i]
        return out

    @wp.func
    def stage(
        time: Real,
        y: State,
        along: vec2,
        plant: Plant,
        frozen: Frozen,
        coefficients: wp.array2d(dtype=Row),
        vehicle: int,
        inputs: wp.array3d(dtype=Real),
        row: int,
        column: int,
        groups: int,
        held: Push,
        gravity: Real,
        camera: Camera,
        scene: Scene,
        seen_row: int,
        run: int,
        gains: Gains,
    ):
        push = held
        if wp.static(every_stage):
            push = control(
                sense_of(
                    time, y, along, plant, coefficients, vehicle, gravity, camera, scene, seen_row,
                    run,
                ),
                gains,
            )  # fmt: skip
        return rate_of(
            y, along, plant, frozen, coefficients, vehicle, inputs, row, column, groups, push,
            gravity,
        )  # fmt: skip

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def rollout(
        plants: wp.array(dtype=Plant),
        coefficients: wp.array2d(dtype=Row),
        initial: wp.array2d(dtype=Real),
        start: wp.array2d(dtype=Real),
        angle: wp.array(dtype=Real),
        inputs: wp.array3d(dtype=Real),
        stride: int,
        groups: int,
        gravity: Real,
        starts: wp.array(dtype=Real),
        steps: wp.array(dtype=Real),
        sample_after: wp.array(dtype=wp.int32),
        acts: wp.array(dtype=wp.int32),
        exposed: wp.array(dtype=wp.int32),
        shown: wp.array(dtype=wp.int32),
        seeds: wp.array(dtype=wp.int32),
        cameras: wp.array(dtype=Camera),
        scene: Scene,
        all_gains: wp.array(dtype=Gains),
        log: wp.array3d(dtype=Real),
        status: wp.array(dtype=wp.int32),
        last_step: wp.array(dtype=wp.int32),
    ):
        run = wp.tid()
        vehicle = wp.min(run, plants.shape[0] - 1)
        column = wp.min(run, inputs.shape[1] - 1)
        plant = plants[vehicle]
        camera = cameras[wp.min(run, cameras.shape[0] - 1)]
        gains = all_gains[wp.min(run, all_gains.shape[0] - 1)]
        y = load_state(start, run, plant.unit)
        frozen = freeze(load_state(initial, run, plant.unit), plant, coefficients, vehicle)
        branch = branch_at(angle[run])
        push = Push()
        ended = wp.int32(0)
        due = wp.int32(0)
        done = steps.shape[0]
        for i in range(steps.shape[0]):
            h = steps[i]
            row = i * stride
            mid = row + wp.min(stride, 1)
            end = row + wp.min(stride, 2)
            seen = i
            seen_mid = i
            seen_end = i
            if wp.static(every_stage):
                seen = 3 * i
                seen_mid = seen + 1
                seen_end = seen + 2
            along = branch.direction
            if acts[i] != 0:
                sense = sense_of(
                    starts[i], y, along, plant, coefficients, vehicle, gravity, camera, scene, seen,
                    run,
                )  # fmt: skip
                if wp.static(has_camera):
                    if scene.needed != 0 and sense.sight.in_view == 0:
                        ended = wp.int32(unseen)
                    if wp.static(not every_stage):
                        if exposed[i] >= 0:
                            blurred = blur(sense.sight, camera, seeds[run], exposed[i])
                            expose(scene, run, exposed[i], blurred)
                        sense.sight = report(scene, run, shown[i])
                push = control(sense, gains)
            if due >= 0:
                log_row(log, run, due, y, plant, branch, push)
            if ended != 0:
                done = i
                break
            k1 = stage(
                starts[i], y, along, plant, frozen, coefficients, vehicle, inputs, row, column,
                groups, push, gravity, camera, scene, seen, run, gains,
            )  # fmt: skip
            k2 = stage(
                starts[i] + half * h, y + half * h * k1, along, plant, frozen, coefficients,
                vehicle, inputs, mid, column, groups, push, gravity, camera, scene, seen_mid, run,
                gains,
            )  # fmt: skip
            k3 = stage(
                starts[i] + half * h, y + half * h * k2, along, plant, frozen, coefficients,
                vehicle, inputs, mid, column, groups, push, gravity, camera, scene, seen_mid, run,
                gains,
            )  # fmt: skip
            k4 = stage(
                starts[i] + h, y + h * k3, along, plant, frozen, coefficients, vehicle, inputs, end,
                column, groups, push, gravity, camera, scene, seen_end, run, gains,
            )  # fmt: skip
            y = unit_attitude(y + (h * sixth) * (k1 + two * (k2 + k3) + k4))
            ended = end_of(y)
            due = -1
            if ended != 0:
                done = i
                break
            branch = followed(branch, y)
            due = sample_after[i]
        if ended == 0 and due >= 0:
            if wp.static(every_stage):
                last = steps.shape[0] - 1
                push = control(
                    sense_of(
                        starts[last] + steps[last], y, branch.direction, plant, coefficients,
                        vehicle, gravity, camera, scene, 3 * last + 2, run,
                    ),
                    gains,
                )  # fmt: skip
            log_row(log, run, due, y, plant, branch, push)
        status[run] = ended
        last_step[run] = done

    return rollout, Scene


def watcher(code: SimpleNamespace):
    """The kernel `watch`: the true image and the camera's pose and twist along logged runs."""
    Real, Plant, Camera = code.Real, code.Plant, code.Camera
    vec2, vec3, width, points = code.vec2, code.vec3, code.layout.state, code.points
    view_of, look, State = code.view_of, code.look, code.State

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def watch(
        plants: wp.array(dtype=Plant),
        cameras: wp.array(dtype=Camera),
        corners: wp.array(dtype=vec3),
        motion: wp.array3d(dtype=Real),
        log: wp.array3d(dtype=Real),
        out: wp.array3d(dtype=Real),
    ):
        """Columns: pose 7, twist 6, image 2 points (normalised), depths, in-view flags."""
        run, sample = wp.tid()
        plant = plants[wp.min(run, plants.shape[0] - 1)]
        camera = cameras[wp.min(run, cameras.shape[0] - 1)]
        column = wp.min(run, motion.shape[1] - 1)
        y = State()
        for j in range(width):
            y[j] = log[run, sample, j]
        for j in range(2):
            y[7 + j] = y[7 + j] * plant.unit
            y[15 + j] = y[15 + j] * plant.unit
        psi = log[run, sample, width + 1]
        view = view_of(y, vec2(wp.cos(psi), wp.sin(psi)), plant, camera)
        at = vec3(motion[sample, column, 0], motion[sample, column, 1], motion[sample, column, 2])
        sight = look(view, camera, at, corners)
        for j in range(3):
            out[run, sample, j] = view.position[j]
        for j in range(4):
            out[run, sample, 3 + j] = view.attitude[j]
        for j in range(6):
            out[run, sample, 7 + j] = view.twist[j]
        for i in range(2 * points):
            out[run, sample, 13 + i] = sight.image[i]
        for i in range(points):
            out[run, sample, 13 + 2 * points + i] = sight.depth[i]
            out[run, sample, 13 + 3 * points + i] = sight.seen[2 * i]

    return watch
