"""Device code of the literal reading of "off-diagonal elements set to zero": M and C diagonal.

Every coordinate of the paper then moves by itself, M_ii q̈_i + ½ Ṁ_ii q̇_i + G_i = τ_i, with Remark 1
as in `continuair.equations`, whose mask "diagonal" states the same slowly. Unlike the models of the
kernels it depends on the choice of coordinates, and divides by M_88, which vanishes with the bend.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from types import SimpleNamespace

import numpy as np
import warp as wp

from continuair.engine.engine import start_warp
from continuair.engine.pack import per_run
from continuair.flight.time_grid import Grid
from continuair.kernels.options import OPTIONS
from continuair.vehicle.vehicle import Vehicle

NODES = 10
"""Gauss nodes on the backbone; one more holds a tip mass. 3e-10 off at a full circle."""

STATE = 16
"""Columns of a state and of a log row: q and q̇ of the paper."""


@cache
def diagonal_kernels() -> SimpleNamespace:
    """The Warp struct of a vehicle and the kernels `rates` and `rollout`."""
    start_warp()
    Real, vec3, mat33 = wp.float64, wp.vec3d, wp.mat33d
    Row = wp.types.vector(8, Real)
    zero, one, two, half = Real(0.0), Real(1.0), Real(2.0), Real(0.5)

    @wp.struct
    class Body:
        mass: Real
        inertia: mat33
        mount: vec3
        length: Real
        stiffness: Real
        damping: Real
        threshold: Real

    @wp.struct
    class Curve:
        """s α(κs), s β(κs) of a backbone point (s α cos ψa, s α sin ψa, -s β), and slopes in κ."""

        out: Real
        d_out: Real
        dd_out: Real
        down: Real
        d_down: Real
        dd_down: Real

    @wp.func
    def curve(kappa: Real, s: Real):
        """(1 - cos κs)/κ and sin(κs)/κ with two derivatives, by series where they cancel."""
        x = kappa * s
        u = x * x
        # α = Σ (-1)^k x^(2k+1)/(2k+2)!, β = Σ (-1)^k x^(2k)/(2k+1)!, terms added from k = 0.
        a = half * x
        da = half
        dda = zero
        b = one
        db = zero
        ddb = zero
        if u < one:
            even = half
            odd = one
            for k in range(1, 10):
                n = Real(2 * k)
                even = -even / ((n + one) * (n + two))
                odd = -odd / (n * (n + one))
                p = wp.pow(u, Real(k - 1))
                a += even * p * u * x
                da += even * (n + one) * p * u
                dda += even * (n + one) * n * p * x
                b += odd * p * u
                db += odd * n * p * x
                ddb += odd * n * (n - one) * p
        else:
            sine = wp.sin(x)
            cosine = wp.cos(x)
            a = (one - cosine) / x
            da = (sine - a) / x
            dda = (cosine - two * da) / x
            b = sine / x
            db = (cosine - b) / x
            ddb = (-sine - two * db) / x
        c = Curve()
        c.out = s * a
        c.d_out = s * s * da
        c.dd_out = s * s * s * dda
        c.down = s * b
        c.d_down = s * s * db
        c.dd_down = s * s * s * ddb
        return c

    @wp.func
    def accelerations(
        q: Row,
        v: Row,
        body: Body,
        nodes: wp.array3d(dtype=Real),
        vehicle: int,
        inputs: wp.array2d(dtype=Real),
        row: int,
        gravity: Real,
    ):
        """q̈ under a row of inputs: tau (8), and a force on the tip in world axes (3)."""
        force = vec3(inputs[row, 8], inputs[row, 9], inputs[row, 10])
        sr = wp.sin(q[3])
        cr = wp.cos(q[3])
        sp = wp.sin(q[4])
        cp = wp.cos(q[4])
        # Rows of R that gravity needs, and columns of the Euler-rate matrix in body axes.
        up = vec3(-sp, sr * cp, cr * cp)
        up_roll = vec3(zero, cr * cp, -sr * cp)
        up_pitch = vec3(-cp, -sr * sp, -cr * sp)
        pitch_axis = vec3(zero, cr, -sr)
        d_pitch_axis = v[3] * vec3(zero, -sr, -cr)
        d_yaw_axis = v[3] * up_roll + v[4] * up_pitch
        kappa = q[6]
        moving = v[6]
        if wp.abs(kappa) <= body.threshold:
            kappa = body.threshold
            moving = zero
        ca = wp.cos(q[7])
        sa = wp.sin(q[7])
        inertia = body.inertia
        d_inertia = mat33()
        m7 = zero
        d7 = zero
        m8 = zero
        d8 = zero
        moment = vec3()
        g7 = zero
        g8 = zero
        total = body.mass
        identity = wp.identity(n=3, dtype=Real)
        for i in range(nodes.shape[1]):
            s = nodes[vehicle, i, 0]
            dm = nodes[vehicle, i, 1]
            jt = nodes[vehicle, i, 2]
            ja = nodes[vehicle, i, 3] - jt
            c = curve(kappa, s)
            sine = wp.sin(kappa * s)
            cosine = wp.cos(kappa * s)
            r = body.mount + vec3(c.out * ca, c.out * sa, -c.down)
            by_kappa = vec3(c.d_out * ca, c.d_out * sa, -c.d_down)
            by_angle = vec3(-c.out * sa, c.out * ca, zero)
            dr = moving * by_kappa + v[7] * by_angle
            t = vec3(sine * ca, sine * sa, -cosine)
            dt = moving * s * vec3(cosine * ca, cosine * sa, sine)
            dt += v[7] * vec3(-sine * sa, sine * ca, zero)
            inertia += dm * (wp.dot(r, r) * identity - wp.outer(r, r)) + jt * identity
            inertia += ja * wp.outer(t, t)
            d_inertia += dm * (
                two * wp.dot(r, dr) * identity - wp.outer(r, dr) - wp.outer(dr, r)
            ) + ja * (wp.outer(t, dt) + wp.outer(dt, t))
            m7 += dm * wp.dot(by_kappa, by_kappa) + jt * s * s
            d7 += two * dm * (c.d_out * c.dd_out + c.d_down * c.dd_down) * moving
            turned = one - cosine
            m8 += dm * c.out * c.out + jt * two * turned + ja * turned * turned
            d8 += two * moving * (dm * c.out * c.d_out + jt * s * sine + ja * turned * s * sine)
            moment += dm * r
            g7 += dm * wp.dot(up, by_kappa)
            g8 += dm * wp.dot(up, by_angle)
            total += dm
        # The tip force: R^T f, its moment about B's origin, and its share on the bend.
        cy = wp.cos(q[5])
        sy = wp.sin(q[5])
        x_axis = vec3(cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr)
        y_axis = vec3(sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr)
        f = force[0] * x_axis + force[1] * y_axis + force[2] * up
        c = curve(kappa, body.length)
        tip = body.mount + vec3(c.out * ca, c.out * sa, -c.down)
        torque = wp.cross(tip, f)
        push = Row(
            force[0],
            force[1],
            force[2] - total * gravity,
            torque[0] - gravity * wp.dot(up_roll, moment),
            wp.dot(pitch_axis, torque) - gravity * wp.dot(up_pitch, moment),
            wp.dot(up, torque),
            wp.dot(f, vec3(c.d_out * ca, c.d_out * sa, -c.d_down))
            - gravity * g7
            - body.stiffness * q[6]
            - body.damping * v[6],
            wp.dot(f, vec3(-c.out * sa, c.out * ca, zero))
            - gravity * g8
            - body.damping * q[6] * q[6] * v[7],
        )
        turning = inertia * pitch_axis
        yawing = inertia * up
        d_pitch = wp.dot(pitch_axis, d_inertia * pitch_axis) + two * wp.dot(d_pitch_axis, turning)
        d_yaw = wp.dot(up, d_inertia * up) + two * wp.dot(d_yaw_axis, yawing)
        M = Row(
            total, total, total, inertia[0, 0], wp.dot(pitch_axis, turning), wp.dot(up, yawing),
            m7, m8,
        )  # fmt: skip
        dM = Row(zero, zero, zero, d_inertia[0, 0], d_pitch, d_yaw, d7, d8)
        a = Row()
        for i in range(8):
            a[i] = (inputs[row, i] + push[i] - half * dM[i] * v[i]) / M[i]
        return a

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def rollout(
        bodies: wp.array(dtype=Body),
        nodes: wp.array3d(dtype=Real),
        start: wp.array2d(dtype=Real),
        inputs: wp.array2d(dtype=Real),
        stride: int,
        gravity: Real,
        steps: wp.array(dtype=Real),
        sample_after: wp.array(dtype=wp.int32),
        log: wp.array3d(dtype=Real),
    ):
        run = wp.tid()
        body = bodies[run]
        q = Row()
        v = Row()
        for j in range(8):
            q[j] = start[run, j]
            v[j] = start[run, 8 + j]
            log[run, 0, j] = q[j]
            log[run, 0, 8 + j] = v[j]
        for i in range(steps.shape[0]):
            h = steps[i]
            a = Row()
            at_v = v
            sum_v = Row()
            sum_a = Row()
            for stage in range(4):
                ahead = wp.where(stage == 0, zero, wp.where(stage == 3, h, half * h))
                weight = wp.where(stage == 0 or stage == 3, one, two) / Real(6.0)
                row = (3 * i + wp.where(stage == 0, 0, wp.where(stage == 3, 2, 1))) * stride
                at_q = q + ahead * at_v
                at_v = v + ahead * a
                a = accelerations(at_q, at_v, body, nodes, run, inputs, row, gravity)
                sum_v += weight * at_v
                sum_a += weight * a
            q = q + h * sum_v
            v = v + h * sum_a
            sample = sample_after[i]
            if sample >= 0:
                for j in range(8):
                    log[run, sample, j] = q[j]
                    log[run, sample, 8 + j] = v[j]

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def rates(
        bodies: wp.array(dtype=Body),
        nodes: wp.array3d(dtype=Real),
        states: wp.array2d(dtype=Real),
        inputs: wp.array2d(dtype=Real),
        gravity: Real,
        out: wp.array2d(dtype=Real),
    ):
        run = wp.tid()
        q = Row()
        v = Row()
        for j in range(8):
            q[j] = states[run, j]
            v[j] = states[run, 8 + j]
        a = accelerations(q, v, bodies[run], nodes, run, inputs, run, gravity)
        for j in range(8):
            out[run, j] = a[j]

    return SimpleNamespace(Body=Body, rollout=rollout, rates=rates)


class DiagonalEngine:
    """One vehicle or batch, packed for the diagonal reading on the CPU."""

    def __init__(self, vehicle: Vehicle, threads: int) -> None:
        self.kernels = diagonal_kernels()
        self.threads = threads
        self.bodies, self.nodes = _packed(vehicle, self.kernels.Body)

    def accelerations(self, states: np.ndarray, inputs: np.ndarray, gravity: float) -> np.ndarray:
        """q̈ (runs, 8) of states (runs, 16) under inputs (runs, 11), a vehicle per run."""
        out = np.zeros((len(states), 8))
        self._launch(self.kernels.rates, slice(None), [states, inputs, gravity, out])
        return out

    def roll_out(
        self,
        start: np.ndarray,
        grid: Grid,
        inputs: tuple[np.ndarray, int],
        gravity: float,
    ) -> np.ndarray:
        """Logged states (runs, samples, 16) from start (runs, 16); inputs: table (rows, 11) and
        its rows-per-time flag, as of `continuair.flight.time_grid.sample_inputs`."""
        log = np.full((len(start), len(grid.samples), STATE), np.nan)
        table, stride = inputs
        steps, after = np.ascontiguousarray(grid.steps), np.ascontiguousarray(grid.sample_after)

        def work(part: slice) -> None:
            given = [start[part], table, stride, gravity, steps, after, log[part]]
            self._launch(self.kernels.rollout, part, given)

        edges = np.linspace(0, len(start), min(self.threads, len(start)) + 1).astype(int)
        self.kernels.rollout.module.load("cpu")
        with ThreadPoolExecutor(self.threads) as pool:
            list(pool.map(work, map(slice, edges[:-1], edges[1:])))
        return log

    def _launch(self, kernel, part: slice, given) -> None:
        bodies, nodes = self.bodies[part], np.ascontiguousarray(self.nodes[part])
        inputs = [wp.array(bodies, dtype=self.kernels.Body, device="cpu"), _share(nodes)]
        inputs += [_share(a) if isinstance(a, np.ndarray) else a for a in given]
        wp.launch(kernel, dim=len(bodies), device="cpu", inputs=inputs)


def _share(array: np.ndarray):
    """A Warp array over the memory of a contiguous NumPy array."""
    kind = wp.int32 if array.dtype == np.int32 else wp.float64
    return wp.array(array, dtype=kind, device="cpu", copy=False)


def _packed(vehicle: Vehicle, Body) -> tuple[np.ndarray, np.ndarray]:
    """Structured parameters (runs,) and nodes (runs, nodes, 4): s, mass, inertia across, along."""
    runs = vehicle.runs or 1
    uav, arm = vehicle.uav, vehicle.arm
    length = per_run(arm.length, runs)
    x, weight = np.polynomial.legendre.leggauss(NODES)
    ds = 0.5 * length[:, None] * weight
    rods = (
        arm.mass_per_length, arm.transverse_inertia_per_length, arm.axial_inertia_per_length
    )  # fmt: skip
    columns = [0.5 * length[:, None] * (1.0 + x)]
    columns += [per_run(value, runs)[:, None] * ds for value in rods]
    parts = [np.stack(columns, -1)]
    for disk in arm.disks:
        row = (disk.position, disk.mass, disk.transverse_inertia, disk.axial_inertia)
        parts.append(np.stack([per_run(value, runs) for value in row], -1)[:, None])
    bodies = np.zeros(runs, dtype=Body.numpy_dtype())
    bodies["mass"], bodies["length"] = per_run(uav.mass, runs), length
    bodies["inertia"], bodies["mount"] = (
        per_run(uav.inertia, runs, 3, 3),
        per_run(uav.mount, runs, 3),
    )
    bodies["stiffness"] = per_run(arm.bending_stiffness, runs) * length
    bodies["damping"] = per_run(arm.structural_damping, runs) * length
    bodies["threshold"] = per_run(arm.kappa_s, runs)
    return bodies, np.concatenate(parts, 1)
