"""What a number of a device can be at all: the only check that formats without check sum have.

A digit that was damaged into another digit passes every parser. What is left to do here is to
refuse what no radio measures; what is possible but wrong is left to the gates of the tracker.
"""

from __future__ import annotations

import re

NEAREST = 0.001
"""[m] The formats print millimetres or less; 0 is what firmware says when it has no range."""
FARTHEST = 300.0
"""[m] Beyond what UWB radios of these modules reach in the open."""
WEAKEST = -140.0
"""[dBm] Below the noise of the receivers."""
STRONGEST = 0.0
"""[dBm] The transmitters stay under -14 dBm."""
MOST_RATE = 100.0
"""[rad/s] A gyroscope of 2000 deg/s ends at 35."""
MOST_ACCEL = 1000.0
"""[m/s2] An accelerometer of 16 g ends at 157."""

DECIMAL = re.compile(r"-?[0-9]{1,12}\.[0-9]{1,12}")
NOT_FINITE = frozenset(("nan", "-nan", "inf", "-inf", "ovf", "-ovf"))
"""What C and Arduino libraries print for numbers that are none."""


class Damaged(Exception):
    """A frame or line that cannot be right; decoders catch it and count."""


def decimal(text: str) -> float | None:
    """A printed number with a decimal point; None where it says that it is none.

    Raises:
        Damaged: It is not a number.
    """
    if DECIMAL.fullmatch(text):
        return float(text)
    if text.lower() in NOT_FINITE:
        return None
    raise Damaged


def distance(value: float | None, farthest: float = FARTHEST) -> float | None:
    """The distance [m], or None where nothing was measured: not a number, 0 or less.

    Raises:
        Damaged: It is more than `farthest` [m].
    """
    if value is None or not value >= NEAREST:  # also what is not a number
        return None
    if value > farthest:
        raise Damaged
    return value


def power(value: float | None) -> float | None:
    """The power [dBm], None where it is not a number.

    Raises:
        Damaged: Nothing is received so weakly or so strongly.
    """
    if value is None or value != value:
        return None
    if not WEAKEST <= value <= STRONGEST:
        raise Damaged
    return value
