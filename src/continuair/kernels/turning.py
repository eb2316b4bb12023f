"""Kernel that detects rotations of logged tips too large for Euler angles to be followed."""

from typing import Any

import warp as wp

from continuair.device.options import OPTIONS
from continuair.vehicle.following import SHARE
from continuair.vehicle.layout import TIP_POSE


def turning_kernel(Real: Any) -> Any:
    """Return the kernel `look_for_turns`: 1 for a run with a rotation too large for its pitch."""
    quat = wp.types.quaternion(Real)
    Q = TIP_POSE["attitude"].start
    one, four, share = Real(1.0), Real(4.0), Real(SHARE)

    @wp.func
    def attitude(log: wp.array3d(dtype=Real), run: int, sample: int):
        return quat(
            log[run, sample, Q],
            log[run, sample, Q + 1],
            log[run, sample, Q + 2],
            log[run, sample, Q + 3],
        )

    @wp.func
    def level(tip: quat):
        """Return cos² of the pitch of the tip, which is that of R_tip diag(1, -1, -1)."""
        sine = tip[3] * tip[1] - tip[0] * tip[2]
        return one - four * sine * sine

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def look_for_turns(log: wp.array3d(dtype=Real), found: wp.array(dtype=wp.int32)):
        """Mark runs for the exact check of vehicle/following.py."""
        run = wp.tid()
        before = attitude(log, run, 0)
        for i in range(1, log.shape[1]):
            after = attitude(log, run, i)
            cosine = wp.dot(before, after)
            if one - cosine * cosine > share * wp.min(level(before), level(after)):
                found[run] = 1
            before = after

    return look_for_turns
