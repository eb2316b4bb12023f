"""Device code of the eye-in-hand camera: pose, motion, projection and transposed Jacobian.

Images are in normalised coordinates (x, y) = (X, Y)/Z, point after point. The optical axis is +z of
the camera axes. A twist is (v, ω) of the camera in those axes, a wrench (force, moment).
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.tip import tip_code
from continuair.sections.arc.bend import bend_code


@dataclass(frozen=True)
class CameraCode:
    """Types and functions for a number of feature points, 0 without a target."""

    points: int
    Image: Any
    ImageGain: Any
    Twist: Any
    Camera: Any
    View: Any
    Sight: Any
    view_of: Any
    look: Any
    blur: Any
    interaction: Any
    camera_push: Any


@cache
def camera_code(numbers: Numbers, tree: Tree, points: int) -> CameraCode:
    """Return the camera code for numbers, a tree of arms and a number of feature points."""
    types, tips = device_types(numbers, tree), tip_code(numbers, tree)
    Real, State, Plant, push_of = types.Real, types.State, types.Plant, types.push_of
    vec2, vec3, quat, Along = types.vec2, types.vec3, types.quat, types.Along
    position_of, attitude_of, velocity_of = types.position_of, types.attitude_of, types.velocity_of
    spin_of, arcs = types.spin_of, bend_code(numbers, tree)
    bend_of, bend_rate_of, plus_pair = arcs.bend_of, arcs.bend_rate_of, arcs.plus_pair
    Tip, two_of, Cell, code = tips.Tip, types.two_of, types.Cell, number_code(numbers)
    above, any_above, randn = code.above, code.any_above, code.randn
    known = elementary_code(numbers)
    sine, cosine, angle_of = known.sine, known.cosine, known.angle_of
    moving_tip_of, wrench_on = tips.moving_tip_of(tree.camera_arm), tips.wrench_on(tree.camera_arm)
    armed, bends = bool(tree.sections), types.layout.bends
    last = tree.first[tree.camera_arm + 1] - 1 if armed else 0
    zero, half, one = Real(0.0), Real(0.5), Real(1.0)
    # A controller may have no target, but Warp has no vectors of length 0.
    count = max(points, 1)
    Image, Depth = wp.types.vector(2 * count, Real), wp.types.vector(count, Real)
    ImageGain = wp.types.matrix((2 * count, 2 * count), Real)
    Interaction = wp.types.matrix((2 * count, 6), Real)
    Twist = wp.types.vector(6, Real)

    @wp.struct
    class Camera:
        """Intrinsics [px], mount in the tip frame, noise [px]; frenet: 1 where that frame spins."""

        focal: vec2
        principal: vec2
        size: vec2
        position: vec3
        attitude: quat
        frenet: Real
        noise: Real

    @wp.struct
    class View:
        """Camera pose in world axes and on the body, its tip and the tip frame's axis of spin, and
        its twist."""

        position: vec3
        attitude: quat
        tip: Tip
        on_body: vec3
        to_body: quat
        axis: vec3
        twist: Twist

    @wp.struct
    class Sight:
        """Measurement: image, depths [m]; seen: 1 for coordinates in view; in_view: points."""

        image: Image
        depth: Depth
        seen: Image
        in_view: Real

    @wp.func
    def spin_per_bend_rate(b: vec2, plant: Plant):
        """Return ∂ψ̇a/∂ḃ, finite at bend 0 (Remark 1, Amiri et al.)."""
        u = wp.max(wp.dot(b, b), plant.threshold[last] * plant.threshold[last])
        return above(u, zero, one / above(u, zero, u, one), zero) * vec2(-b[1], b[0])

    @wp.func
    def view_of(y: State, along: Along, plant: Plant, camera: Camera):
        """Return the View; along: (cos ψa, sin ψa) on the followed branch, for the frenet frame."""
        out = View()
        b = vec2()
        db = vec2()
        direction = vec2(one, zero)
        if wp.static(armed):
            b = bend_of(y, last)
            db = bend_rate_of(y, last)
            direction = two_of(along, last)
        w = spin_of(y)
        moving = moving_tip_of(y, plant)
        turn = moving.tip.attitude
        out.tip = moving.tip
        size = wp.length(b)
        # Within a step, too, the frenet frame follows the current bend.
        side = above(zero, wp.dot(b, direction), -one, one) / above(size, zero, size, one)
        along_x = above(size, zero, b[0] * side, direction[0])
        across = above(size, zero, b[1] * side, direction[1])
        out.axis = wp.quat_rotate(turn, vec3(zero, zero, one))
        # The untwisted tip rotates with the bends; the frenet frame also spins about its axis.
        spin = w + moving.turned
        if any_above(camera.frenet, zero):
            angle = half * camera.frenet * angle_of(across, along_x)
            turn = turn * quat(zero, zero, -sine(angle), cosine(angle))
            spin -= camera.frenet * wp.dot(spin_per_bend_rate(b, plant), db) * out.axis
        arm = wp.quat_rotate(turn, camera.position)
        out.on_body = moving.tip.point + arm
        out.to_body = turn * camera.attitude
        q = attitude_of(y)
        v = wp.quat_rotate_inv(q, velocity_of(y))
        v += wp.cross(w, moving.tip.point) + moving.swept + wp.cross(spin, arm)
        v = wp.quat_rotate_inv(out.to_body, v)
        spin = wp.quat_rotate_inv(out.to_body, spin)
        out.twist = Twist(v[0], v[1], v[2], spin[0], spin[1], spin[2])
        out.position = position_of(y) + wp.quat_rotate(q, out.on_body)
        out.attitude = q * out.to_body
        return out

    @wp.func
    def look(view: View, camera: Camera, target: vec3, corners: wp.array2d(dtype=Cell)):
        """Project the target's points; target: its centroid in world axes."""
        out = Sight()
        for i in range(count):
            corner = vec3(Real(corners[i, 0]), Real(corners[i, 1]), Real(corners[i, 2]))
            p = wp.quat_rotate_inv(view.attitude, target + corner - view.position)
            out.depth[i] = p[2]
            depth = above(p[2], zero, p[2], one)
            x = above(p[2], zero, p[0] / depth, zero)
            y = above(p[2], zero, p[1] / depth, zero)
            out.image[2 * i] = x
            out.image[2 * i + 1] = y
            u = camera.focal[0] * x + camera.principal[0]
            v = camera.focal[1] * y + camera.principal[1]
            within = wp.min(wp.min(u, v), wp.min(camera.size[0] - u, camera.size[1] - v))
            seen = above(p[2], zero, above(zero, within, zero, one), zero)
            out.seen[2 * i] = seen
            out.seen[2 * i + 1] = seen
            out.in_view += seen
        return out

    @wp.func
    def blur(sight: Sight, camera: Camera, seeds: wp.array(dtype=wp.int32), run: int, frame: int):
        """Add pixel noise, which depends on seed and frame only."""
        if any_above(camera.noise, zero):
            for i in range(count):
                for j in range(2):
                    noise = camera.noise * randn(seeds, run, frame, 2 * i + j)
                    sight.image[2 * i + j] = sight.image[2 * i + j] + noise / camera.focal[j]
        return sight

    @wp.func
    def interaction(sight: Sight):
        """Return L of Eq. (14), ṡ = L (v_c - v_t), with zero rows for points out of view."""
        L = Interaction()
        for i in range(count):
            x = sight.image[2 * i]
            y = sight.image[2 * i + 1]
            seen = sight.seen[2 * i]
            n = seen / above(seen, zero, sight.depth[i], one)
            L[2 * i, 0] = -n
            L[2 * i, 2] = x * n
            L[2 * i, 3] = seen * x * y
            L[2 * i, 4] = -seen * (one + x * x)
            L[2 * i, 5] = seen * y
            L[2 * i + 1, 1] = -n
            L[2 * i + 1, 2] = y * n
            L[2 * i + 1, 3] = seen * (one + y * y)
            L[2 * i + 1, 4] = -seen * x * y
            L[2 * i + 1, 5] = -seen * x
        return L

    @wp.func
    def camera_push(y: State, view: View, plant: Plant, camera: Camera, wrench: Twist):
        """Return J_cᵀ wrench, the actuator wrench of a wrench on the camera, in camera axes."""
        f = wp.quat_rotate(view.to_body, vec3(wrench[0], wrench[1], wrench[2]))
        m = wp.quat_rotate(view.to_body, vec3(wrench[3], wrench[4], wrench[5]))
        t = m + wp.cross(view.on_body - view.tip.point, f)
        bend = wrench_on(y, plant, view.tip, f, t)
        if wp.static(armed):
            on_last = wp.dot(view.axis, t) * spin_per_bend_rate(bend_of(y, last), plant)
            bend = plus_pair(bend, last, -camera.frenet * on_last)
        for j in range(bends):
            bend[j] = plant.unit[j] * bend[j]
        force = wp.quat_rotate(attitude_of(y), f)
        return push_of(force, wp.cross(view.tip.point, f) + t, bend)

    return holding(CameraCode, locals())
