"""Conversion of the times of a run to integer nanoseconds."""

from __future__ import annotations

import numpy as np

from hardware_bridge.errors import BridgeError
from tracking.arrays import F64

LAST_NS = (2**31 - 1) * 1_000_000_000
"""[ns] Largest time stamp of ROS 2, with signed seconds in 32 bits."""


def stamps_ns(t: F64, offset_ns: int) -> list[int]:
    """Return times (...) [s] plus an offset as a flat list of nanoseconds.

    Raises:
        BridgeError: A time is not finite, before 0, or after 2038.
    """
    flat = np.ravel(t)
    if not np.isfinite(flat).all():
        raise BridgeError("t: expected finite times")
    # Whole seconds are separated, so that the product with 1e9 is exact.
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
