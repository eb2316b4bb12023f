"""Device code of one time step, of the signed branch of the bend, and of the rows of the log."""

from types import SimpleNamespace

import warp as wp

# Measured: inlining everything and fusing products and sums takes a fifth off Warp's own flags.
OPTIONS = {
    "cpu_compiler_flags": "-march=native -ffp-contract=fast -mllvm=-inline-threshold=9000 "
    "-mllvm=-inline-cold-callsite-threshold=3000"
}

OK, NOT_FINITE, OVERBENT, UNSEEN = 0, 1, 2, 3
STATUS = {
    OK: "ok",
    NOT_FINITE: "not finite",
    OVERBENT: "bent beyond a full circle",
    UNSEEN: "all feature points lost from view",
}


def stepping_code(code: SimpleNamespace) -> SimpleNamespace:
    """Warp functions on top of a model's."""
    Real, State, Plant, Push = code.Real, code.State, code.Plant, code.Push
    vec2, width = code.vec2, code.layout.state
    first_of_push, pushes = code.layout.command.start, code.layout.coordinates
    zero, one, two, pi = Real(0.0), Real(1.0), Real(2.0), Real(3.141592653589793)

    @wp.struct
    class Branch:
        """(cos ψa, sin ψa) of the signed branch followed, and its full turns."""

        direction: vec2
        turns: Real

    @wp.func
    def load_state(rows: wp.array2d(dtype=Real), run: int, unit: Real):
        y = State()
        for j in range(width):
            y[j] = rows[run, j]
        for j in range(2):
            y[7 + j] = y[7 + j] * unit
            y[15 + j] = y[15 + j] * unit
        return y

    @wp.func
    def branch_at(angle: Real):
        out = Branch()
        out.direction = vec2(wp.cos(angle), wp.sin(angle))
        within = wp.atan2(out.direction[1], out.direction[0])
        out.turns = wp.round((angle - within) / (two * pi))
        return out

    @wp.func
    def followed(branch: Branch, y: State):
        """κ changes sign when the bend passes through straight; ψa stays continuous."""
        b = vec2(y[7], y[8])
        u = wp.dot(b, b)
        before = branch.direction
        if u > zero:
            side = wp.where(wp.dot(b, before) < zero, -one, one)
            turned = b * (side / wp.sqrt(u))
            if before[0] + turned[0] < zero:
                if before[1] >= zero and turned[1] < zero:
                    branch.turns += one
                if before[1] < zero and turned[1] >= zero:
                    branch.turns -= one
            branch.direction = turned
        return branch

    @wp.func
    def unit_attitude(y: State):
        n = one / wp.sqrt(y[3] * y[3] + y[4] * y[4] + y[5] * y[5] + y[6] * y[6])
        for j in range(3, 7):
            y[j] = y[j] * n
        return y

    @wp.func
    def end_of(y: State):
        """The status that a state ends a run with, 0 if none."""
        if not wp.isfinite(wp.length_sq(y)):
            return wp.int32(1)
        if y[7] * y[7] + y[8] * y[8] > two:
            return wp.int32(2)
        return wp.int32(0)

    @wp.func
    def log_row(
        log: wp.array3d(dtype=Real),
        run: int,
        sample: int,
        y: State,
        plant: Plant,
        branch: Branch,
        push: Push,
    ):
        for j in range(width):
            log[run, sample, j] = y[j]
        for j in range(2):
            log[run, sample, 7 + j] = y[7 + j] / plant.unit
            log[run, sample, 15 + j] = y[15 + j] / plant.unit
        along = branch.direction
        log[run, sample, width] = (y[7] * along[0] + y[8] * along[1]) / plant.unit
        log[run, sample, width + 1] = wp.atan2(along[1], along[0]) + two * pi * branch.turns
        for j in range(pushes):
            log[run, sample, first_of_push + j] = push[j]

    return SimpleNamespace(
        Branch=Branch,
        load_state=load_state,
        branch_at=branch_at,
        followed=followed,
        unit_attitude=unit_attitude,
        end_of=end_of,
        log_row=log_row,
    )
