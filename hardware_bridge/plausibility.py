"""What a damaged text lets through and cannot be: refused before it reaches the tracker.

Text formats without a check sum take a damaged digit for another number. A range far from the last
ones of its pair, an acceleration beyond the scale of the sensor: such numbers are refused here, by
what is possible at all. What is possible but unlikely is the tracker's to judge, which knows more.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, fields

from hardware_bridge.readings import ImuReading, StateReading, Vector

NS = 1_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class PlausibilityParams:
    """Of `Plausibility`."""

    nearest: float = 0.005
    """[m] Ranges below are no ranges: 0.00 is how some devices say that they have none."""
    farthest: float = 300.0
    """[m] More than the radios reach."""
    closing_speed: float = 6.0
    """[m/s] Of two nodes towards or away from each other: twice the top speed of a car."""
    jump: float = 1.0
    """[m] What noise and a wall that comes between add at once. Smaller refuses good ranges, larger
    leaves more to the tracker."""
    agreeing: int = 3
    """[-] Refused ranges in a row that agree with each other are believed: the node was carried
    away while it was silent."""
    agreeing_within: float = 5.0
    """[s] From each to the next."""
    gyr_scale: float = math.radians(2000.0)
    """[rad/s] Largest rate that the sensor can say."""
    acc_scale: float = 16.0 * 9.80665
    """[m/s2] Largest acceleration."""
    mag_scale: float = 5000.0
    """[uT] Largest field."""
    rounding: float = 0.01
    """[-] Scales are exceeded by so much through rounding and calibration."""
    norm: float = 0.05
    """[-] How far the length of a quaternion may be from 1."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not getattr(self, each.name) > 0:
                raise ValueError(f"{each.name}: a number above 0 expected")


@dataclass(slots=True)
class _Pair:
    """Ranges of one pair of nodes."""

    distance: float
    t_ns: int
    agreeing: int = 0
    """Refused ranges in a row that agree; the last of them follows."""
    other: float = 0.0
    other_ns: int = 0


class Plausibility:
    """Refuses readings that cannot be, and counts them by reason.

    Laws: what moves within the limits is never refused; after a real jump no more than
    ``agreeing`` - 1 good ranges in a row are; what is refused changes no later answer about
    ranges that agree with the ones accepted.
    """

    refused: Counter[str]
    """By reason: ``not a number``, ``too near``, ``too far``, ``jump``, ``rate``,
    ``acceleration``, ``field``, ``attitude``."""

    def __init__(self, params: PlausibilityParams | None = None) -> None:
        self._params = PlausibilityParams() if params is None else params
        self._pairs: dict[tuple[int, int], _Pair] = {}
        self.refused = Counter()

    def allows_range(self, i: int, j: int, distance: float, t_ns: int) -> bool:
        """Whether a range can be.

        Args:
            i: One node; the order of the two says nothing.
            j: The other.
            distance: [m]
            t_ns: When it was measured, by the host's monotonic clock [ns].
        """
        reason = self._wrong_range((min(i, j), max(i, j)), distance, t_ns)
        return self._count(reason)

    def allows_imu(self, reading: ImuReading) -> bool:
        """Whether a sample is within the scales of its sensors."""
        p = self._params
        return self._count(
            _wrong("rate", reading.gyr, p.gyr_scale * (1.0 + p.rounding))
            or _wrong("acceleration", reading.acc, p.acc_scale * (1.0 + p.rounding))
            or _wrong("field", reading.mag or (0.0, 0.0, 0.0), p.mag_scale * (1.0 + p.rounding))
        )

    def allows_state(self, reading: StateReading) -> bool:
        """Whether an orientation is one, and the acceleration within the scale."""
        p = self._params
        length = math.hypot(*reading.q_wb)
        if not math.isfinite(length):
            return self._count("not a number")
        if abs(length - 1.0) > p.norm:
            return self._count("attitude")
        # Gravity was taken off: it may add to the sensor's scale.
        return self._count(
            _wrong("acceleration", reading.accel_w, (p.acc_scale + 10.0) * (1.0 + p.rounding))
        )

    def _count(self, reason: str | None) -> bool:
        if reason is not None:
            self.refused[reason] += 1
        return reason is None

    def _wrong_range(self, key: tuple[int, int], distance: float, t_ns: int) -> str | None:
        p = self._params
        if not math.isfinite(distance):
            return "not a number"
        if distance < p.nearest:
            return "too near"
        if distance > p.farthest:
            return "too far"
        pair = self._pairs.get(key)
        if pair is None:
            self._pairs[key] = _Pair(distance, t_ns)
            return None
        if not self._can_follow(distance - pair.distance, t_ns - pair.t_ns):
            recent = abs(t_ns - pair.other_ns) <= p.agreeing_within * NS
            agrees = recent and self._can_follow(distance - pair.other, t_ns - pair.other_ns)
            pair.agreeing = pair.agreeing + 1 if pair.agreeing and agrees else 1
            pair.other, pair.other_ns = distance, t_ns
            if pair.agreeing < p.agreeing:
                return "jump"
        pair.distance, pair.t_ns, pair.agreeing = distance, t_ns, 0
        return None

    def _can_follow(self, change: float, passed_ns: int) -> bool:
        """Whether a distance may change by this [m] within this time [ns]."""
        p = self._params
        return abs(change) <= p.jump + p.closing_speed * abs(passed_ns) / NS


def _wrong(reason: str, values: Vector, scale: float) -> str | None:
    if not all(math.isfinite(v) for v in values):
        return "not a number"
    return reason if any(abs(v) > scale for v in values) else None
