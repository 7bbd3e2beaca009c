"""Limits of reported numbers: the only check of formats without a check sum.

A digit damaged into another digit passes every parser. Values that no radio measures are refused
here; values that are possible but wrong are left to the gates of the tracker.
"""

from __future__ import annotations

import re

NEAREST = 0.001
"""[m] Smallest range: formats print millimetres or coarser, and 0 means no range."""
FARTHEST = 300.0
"""[m] Largest range, beyond the line-of-sight reach of these UWB modules."""
WEAKEST = -140.0
"""[dBm] Smallest power, below the noise of the receivers."""
STRONGEST = 0.0
"""[dBm] Largest power; the transmitters stay below -14 dBm."""
MOST_RATE = 100.0
"""[rad/s] Largest rate; a gyroscope of 2000 deg/s saturates at 35."""
MOST_ACCEL = 1000.0
"""[m/s2] Largest acceleration; an accelerometer of 16 g saturates at 157."""

DECIMAL = re.compile(r"-?[0-9]{1,12}\.[0-9]{1,12}")
NOT_FINITE = frozenset(("nan", "-nan", "inf", "-inf", "ovf", "-ovf"))
"""Non-finite numbers as C and Arduino libraries print them."""


class Damaged(Exception):
    """A frame or line is invalid; decoders catch and count this."""


def decimal(text: str) -> float | None:
    """Return the value of a printed decimal number; None if it is not finite.

    Raises:
        Damaged: The text is not a decimal number.
    """
    if DECIMAL.fullmatch(text):
        return float(text)
    if text.lower() in NOT_FINITE:
        return None
    raise Damaged


def distance(value: float | None, farthest: float = FARTHEST) -> float | None:
    """Return the distance [m]; None if nothing was measured: not a number, 0 or less.

    Raises:
        Damaged: The distance is above `farthest` [m].
    """
    if value is None or not value >= NEAREST:  # also true for NaN
        return None
    if value > farthest:
        raise Damaged
    return value


def power(value: float | None) -> float | None:
    """Return the power [dBm]; None if it is not a number.

    Raises:
        Damaged: The power is outside of the possible range.
    """
    if value is None or value != value:
        return None
    if not WEAKEST <= value <= STRONGEST:
        raise Damaged
    return value
