"""Times of a run as whole nanoseconds."""

from __future__ import annotations

import numpy as np

from hardware_bridge.errors import BridgeError
from tracking.arrays import F64

LAST_NS = (2**31 - 1) * 1_000_000_000
"""[ns] Time stamps of ROS 2 hold seconds in 32 bits with a sign."""


def stamps_ns(t: F64, offset_ns: int) -> list[int]:
    """Times (...) [s] plus an offset, as a flat list of nanoseconds.

    Raises:
        BridgeError: One is not finite, before 0, or after 2038.
    """
    flat = np.ravel(t)
    if not np.isfinite(flat).all():
        raise BridgeError("t: expected finite times")
    # Whole seconds apart, so that a product with 1e9 loses nothing.
    whole = np.floor(flat)
    parts = np.rint((flat - whole) * 1e9)
    stamps = [
        int(second) * 1_000_000_000 + int(part) + offset_ns
        for second, part in zip(whole.tolist(), parts.tolist(), strict=True)
    ]
    if stamps and (min(stamps) < 0 or max(stamps) > LAST_NS):
        raise BridgeError(
            f"t, offset_ns: expected times from 0 to {LAST_NS} ns, got {min(stamps)} to "
            f"{max(stamps)} ns"
        )
    return stamps
