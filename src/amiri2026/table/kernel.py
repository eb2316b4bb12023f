"""Device code of the paper's model as printed: Eq. (10) under masks, and steps with error control.

A point's Jacobian is C++ code generated from `points` (`expressions`); the rest corresponds to
`printed.PrintedModel`. Dormand and Prince's pair of orders 5 and 4.
"""

import numpy as np
import warp as wp

from amiri2026.table.expressions import code, rate, variable
from amiri2026.table.points import point_jacobian
from amiri2026.table.printed import (
    CURLED,
    FLOWN,
    FULL_CIRCLE,
    GRAVITY,
    SINGULAR,
    STOPPED,
)
from continuair.device import OPTIONS
from continuair.engine import numpy_type

Real = wp.float64
vec3 = wp.types.vector(length=3, dtype=Real)
vec8 = wp.types.vector(length=8, dtype=Real)
vec16 = wp.types.vector(length=16, dtype=Real)
mat88 = wp.types.matrix(shape=(8, 8), dtype=Real)
mat68 = wp.types.matrix(shape=(6, 8), dtype=Real)
stages = wp.types.matrix(shape=(7, 16), dtype=Real)

ZERO, ONE = Real(0.0), Real(1.0)
QUARTER_PI = Real(np.pi / 4)
ACCEPTED, LEAST_FACTOR, MOST_FACTOR, SAFETY = Real(1.0), Real(0.2), Real(5.0), Real(0.9)
ORDER = Real(-0.2)
LEAST_STEP = Real(1e-14)
_GRAVITY, _FULL_CIRCLE = Real(GRAVITY), Real(FULL_CIRCLE)
_FLOWN, _CURLED = wp.constant(FLOWN), wp.constant(CURLED)
_SINGULAR, _STOPPED = wp.constant(SINGULAR), wp.constant(STOPPED)

TABLEAU = np.array(
    [
        [0, 0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0],
        # Of the error, the difference of both orders.
        [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40],
    ]
)
"""Rows of the stages, then the weights of the error estimate; times are the sums of the rows."""


def _jacobian_code() -> str:
    """Return C++ of a point's J and of its rate along q̇, traced from `point_jacobian`."""
    q, qd = (np.array([variable(f"{name}[{i}]") for i in range(8)]) for name in ("q", "qd"))
    offset, mount = (
        np.array([variable(f"{name}[{i}]") for i in range(3)]) for name in ("offset", "mount")
    )
    J = point_jacobian(q, np.array(variable("s")), offset, mount)
    rates, known = dict(zip(q, qd, strict=True)), {}
    results = [(f"J.data[{k}][{i}]", J[k, i]) for k in range(3) for i in range(8)]
    results += [
        (f"J.data[{3 + k}][{i}]", rate(J[k, i], rates, known)) for k in range(3) for i in range(8)
    ]
    return f"wp::mat_t<6, 8, wp::float64> J;\n{code(results)}\nreturn J;"


@wp.func_native(_jacobian_code())
def jacobian_and_rate(s: Real, offset: vec3, mount: vec3, q: vec8, qd: vec8) -> mat68: ...


@wp.struct
class Job:
    """The data of one flight; points lie in arrays from `first` to `first + points`.

    test: 0 to 3 for A to D. moves: 1 for a coordinate that moves, 0 for one that is fixed.
    damping_on_angle: 1 if damping acts on ψa, too. torque: factor on Q_κ.
    """

    first: int
    points: int
    test: int
    mount: vec3
    length: Real
    spring: Real
    damping: Real
    damping_on_angle: Real
    threshold: Real
    torque: Real
    force_sign: Real
    moves: vec8
    on_M: mat88
    on_C: mat88


@wp.func
def forces(job: Job, t: Real, q: vec8, qd: vec8) -> vec8:
    """Return τ + force_sign J_tᵀ F_e of a test."""
    found = vec8()
    if job.test == 0:
        found[0] = Real(100.0)
    if job.test == 2:
        found[6] = Real(0.1) * job.torque * wp.sin(Real(20.0) * t + QUARTER_PI)
        found[7] = Real(0.1) * wp.cos(Real(20.0) * t)
    if job.test == 3:
        angle = Real(2.0 * np.pi) * t
        x, y = Real(10.0) * wp.sin(angle + QUARTER_PI), Real(10.0) * wp.sin(angle)
        J = jacobian_and_rate(job.length, vec3(), job.mount, q, qd)
        for i in range(8):
            found[i] = job.force_sign * (J[0, i] * x + J[1, i] * y + J[2, i] * Real(25.0))
    return found


@wp.func
def solved(A: mat88, b: vec8) -> vec8:
    """Return a⁻¹ b of a positive definite A."""
    for c in range(8):
        for r in range(c + 1, 8):
            factor = A[r, c] / A[c, c]
            for k in range(c, 8):
                A[r, k] = A[r, k] - factor * A[c, k]
            b[r] = b[r] - factor * b[c]
    x = vec8()
    for back in range(8):
        r = 7 - back
        rest = b[r]
        for k in range(r + 1, 8):
            rest -= A[r, k] * x[k]
        x[r] = rest / A[r, r]
    return x


@wp.func
def slope(
    job: Job,
    mass: wp.array(dtype=Real),
    place: wp.array(dtype=Real),
    offset: wp.array(dtype=vec3),
    t: Real,
    y: vec16,
    side: int,
) -> vec16:
    """Return (q̇, q̈) of Eq. (10)."""
    q, qd = vec8(), vec8()
    for i in range(8):
        q[i] = y[i]
        qd[i] = y[8 + i]
    κ = q[6]
    if side == 0:
        q[6] = job.threshold
    M, C, b = mat88(), mat88(), forces(job, t, q, qd)
    for n in range(job.first, job.first + job.points):
        J = jacobian_and_rate(place[n], offset[n], job.mount, q, qd)
        m = mass[n]
        for i in range(8):
            b[i] = b[i] - m * _GRAVITY * J[2, i]
            for j in range(8):
                M[i, j] += m * (J[0, i] * J[0, j] + J[1, i] * J[1, j] + J[2, i] * J[2, j])
                C[i, j] += m * (J[0, i] * J[3, j] + J[1, i] * J[4, j] + J[2, i] * J[5, j])
    b[6] = b[6] - job.spring * κ - job.damping * qd[6]
    b[7] = b[7] - job.damping_on_angle * job.damping * q[6] * q[6] * qd[7]
    for i in range(8):
        for j in range(8):
            b[i] = b[i] - job.on_C[i, j] * C[i, j] * qd[j]
            M[i, j] = job.on_M[i, j] * job.moves[i] * job.moves[j] * M[i, j]
        M[i, i] = M[i, i] + ONE - job.moves[i]
        b[i] = job.moves[i] * b[i]
    qdd = solved(M, b)
    found = vec16()
    for i in range(8):
        found[i] = qd[i]
        found[8 + i] = qdd[i]
    return found


@wp.func
def beyond(job: Job, κ: Real, side: int) -> Real:
    """Return how far κ is beyond the jump of Remark 1; negative before."""
    if side == 0:
        return wp.abs(κ) - job.threshold
    if job.threshold == ZERO:
        return -ONE
    return job.threshold - Real(side) * κ


@wp.func
def attempted(
    job: Job,
    mass: wp.array(dtype=Real),
    place: wp.array(dtype=Real),
    offset: wp.array(dtype=vec3),
    tableau: wp.array2d(dtype=Real),
    t: Real,
    y: vec16,
    side: int,
    h: Real,
    k: stages,
) -> stages:
    """Return all stages of a step, the first being there already."""
    for stage in range(1, 7):
        at, time = vec16(y), Real(0.0)
        for earlier in range(stage):
            weight = tableau[stage, earlier]
            time += weight
            for i in range(16):
                at[i] += h * weight * k[earlier, i]
        found = slope(job, mass, place, offset, t + time * h, at, side)
        for i in range(16):
            k[stage, i] = found[i]
    return k


@wp.func
def advanced(tableau: wp.array2d(dtype=Real), y: vec16, h: Real, k: stages) -> vec16:
    """Return the state after a step."""
    after = vec16(y)
    for stage in range(6):
        for i in range(16):
            after[i] += h * tableau[6, stage] * k[stage, i]
    return after


@wp.func
def error_of(
    tableau: wp.array2d(dtype=Real), y: vec16, after: vec16, h: Real, k: stages, tolerance: Real
) -> Real:
    """Return the root mean square of the estimated errors over tolerance (1 + |y|)."""
    total = Real(0.0)
    for i in range(16):
        error = Real(0.0)
        for stage in range(7):
            error += h * tableau[7, stage] * k[stage, i]
        share = error / (tolerance * (ONE + wp.max(wp.abs(y[i]), wp.abs(after[i]))))
        total += share * share
    return wp.sqrt(total / Real(16.0))


@wp.func
def to_the_jump(
    job: Job,
    mass: wp.array(dtype=Real),
    place: wp.array(dtype=Real),
    offset: wp.array(dtype=vec3),
    tableau: wp.array2d(dtype=Real),
    t: Real,
    y: vec16,
    side: int,
    whole: Real,
    after: vec16,
    k: stages,
) -> Real:
    """Length of the step [s] that ends just beyond the jump of Remark 1, by the Illinois method."""
    low, high, moved = Real(0.0), Real(whole), wp.int32(0)
    below, above = beyond(job, y[6], side), beyond(job, after[6], side)
    for _ in range(60):
        if high - low > Real(1e-15):
            middle = (low * above - high * below) / (above - below)
            if middle <= low or middle >= high:
                middle = Real(0.5) * (low + high)
            k = attempted(job, mass, place, offset, tableau, t, y, side, middle, k)
            reached = advanced(tableau, y, middle, k)
            found = beyond(job, reached[6], side)
            if found > ZERO:
                high, above = middle, found
                if moved > 0:
                    below = Real(0.5) * below
                moved = wp.int32(1)
            else:
                low, below = middle, found
                if moved < 0:
                    above = Real(0.5) * above
                moved = wp.int32(-1)
    return high


@wp.kernel(enable_backward=False, module="unique", module_options={**OPTIONS, "max_unroll": 1})
def fly_kernel(
    jobs: wp.array(dtype=Job),
    mass: wp.array(dtype=Real),
    place: wp.array(dtype=Real),
    offset: wp.array(dtype=vec3),
    tableau: wp.array2d(dtype=Real),
    tolerance: Real,
    sample: Real,
    most: int,
    states: wp.array2d(dtype=vec16),
    status: wp.array(dtype=int),
):
    """Simulate every job; states (jobs, samples) hold the starts, and NaN after an early end."""
    run = wp.tid()
    job = jobs[run]
    y = states[run, 0]
    t, h, error = Real(0.0), Real(0.1) * sample, Real(0.0)
    done, used, side = wp.int32(0), wp.int32(0), wp.int32(0)
    if wp.abs(y[6]) > job.threshold:
        side = wp.int32(wp.sign(y[6]))
    k = stages()
    first = slope(job, mass, place, offset, t, y, side)
    for i in range(16):
        k[0, i] = first[i]
    status[run] = _FLOWN
    while done < states.shape[1] - 1 and status[run] == _FLOWN:
        next_sample = Real(done + 1) * sample
        tried = wp.min(h, next_sample - t)
        k = attempted(job, mass, place, offset, tableau, t, y, side, tried, k)
        used += 6
        after = advanced(tableau, y, tried, k)
        error = error_of(tableau, y, after, tried, k, tolerance)
        if used > most:
            status[run] = _STOPPED
        elif not (error <= ACCEPTED):
            h = tried * LEAST_FACTOR
            if wp.isfinite(error):
                h = tried * wp.max(LEAST_FACTOR, SAFETY * wp.pow(error, ORDER))
            if h < LEAST_STEP:
                status[run] = _SINGULAR
        else:
            crossed = beyond(job, after[6], side) > ZERO
            if crossed:
                tried = to_the_jump(job, mass, place, offset, tableau, t, y, side, tried, after, k)
                k = attempted(job, mass, place, offset, tableau, t, y, side, tried, k)
                after = advanced(tableau, y, tried, k)
            t += tried
            y = vec16(after)
            if wp.abs(y[6]) * job.length > _FULL_CIRCLE:
                status[run] = _CURLED
            begin = vec16()
            for i in range(16):
                begin[i] = k[6, i]
            if crossed:
                side = wp.where(side == 0, wp.int32(wp.sign(y[6])), wp.int32(0))
                begin = slope(job, mass, place, offset, t, y, side)
            for i in range(16):
                k[0, i] = begin[i]
            longer = tried * wp.clamp(
                SAFETY * wp.pow(wp.max(error, Real(1e-10)), ORDER), LEAST_FACTOR, MOST_FACTOR
            )
            # A step that a sample cuts short does not shorten the next one.
            h = wp.min(wp.max(longer, h * Real(tried < h)), sample)
            if next_sample - t < Real(1e-13):
                t = next_sample
                done += 1
                states[run, done] = y


def structure() -> np.dtype:
    """Return the struct of a job, as NumPy sees it."""
    return numpy_type(Job)
