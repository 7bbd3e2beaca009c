r"""Driver of PWM boards that read lines of pulse widths: ``"%d, %d\r"``, steering and throttle.

Both numbers are pulse widths in microseconds, with four digits each, since the firmware of the
RoboHAT MM1 reads the first and the last four characters of a line [1]. The lines have no check sum,
and that firmware holds the last throttle for 10 s after the last line: the page of drivers
describes the changes needed before a car drives.

A table, measured for each car and interpolated linearly, gives the throttle pulse of a speed: the
centre below the first point, the last pulse above the last point.

References:
    [1] Donkeycar, donkeycar/contrib/robohat/code.py and donkeycar/parts/robohat.py.
        https://github.com/autorope/donkeycar
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TypeAlias

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.base import Decoder
from hardware_bridge.drivers.options import expect
from hardware_bridge.readings import Reading

LEAST_PULSE = 1000
"""[us] Shortest servo pulse."""
MOST_PULSE = 2000
"""[us] Longest servo pulse."""
Points: TypeAlias = tuple[tuple[float, int], ...]
"""Speed [m/s] and pulse [us], slowest first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PwmOptions:
    """Options of a car with servo and speed controller on a PWM board; pulses in microseconds."""

    steering_centre: int = 1500
    """[us] Pulse at which the car drives straight [1]."""
    steering_span: int = 400
    """[us] Pulse added at `max_steering` to the left; negative if longer pulses turn right.
    Assumed: measure it."""
    max_steering: float = 0.42
    """[rad] Limit to either side; that of the simulated car."""
    throttle_centre: int = 1500
    """[us] Pulse at which the motor does not turn [1]."""
    forward: Points = ((0.4, 1560), (3.0, 1750))
    """[m/s, us] Lowest steady speed, further points, top speed. Assumed: measure them."""
    reverse: Points = ()
    """[m/s, us] Points for driving backwards, with positive speeds. Empty: the car never drives
    backwards, and stops at such commands."""

    def __post_init__(self) -> None:
        """Refuse invalid values."""
        middle, span = self.steering_centre, self.steering_span
        pulses = f"{LEAST_PULSE} to {MOST_PULSE}"
        expect(LEAST_PULSE <= middle <= MOST_PULSE, "steering_centre", pulses, middle)
        room = min(middle - LEAST_PULSE, MOST_PULSE - middle)
        expect(0 < abs(span) <= room, "steering_span", f"-{room} to {room} and not 0", span)
        expect(0.0 < self.max_steering <= 1.5, "max_steering", "0 to 1.5", self.max_steering)
        centre = self.throttle_centre
        expect(LEAST_PULSE < centre < MOST_PULSE, "throttle_centre", pulses, centre)
        expect(len(self.forward) >= 2, "forward", "at least two points", self.forward)
        side = 1 if self.forward[0][1] > centre else -1
        _check_points("forward", self.forward, centre, side)
        if self.reverse:
            expect(len(self.reverse) >= 2, "reverse", "no or at least two points", self.reverse)
            _check_points("reverse", self.reverse, centre, -side)


def _check_points(name: str, points: Points, centre: int, side: int) -> None:
    """Refuse tables that are not monotonic away from the centre, to one side."""
    speeds = [0.0, *(speed for speed, _ in points)]
    steps = [0, *(side * (pulse - centre) for _, pulse in points)]
    rises = all(
        a < b for values in (speeds, steps) for a, b in zip(values, values[1:], strict=False)
    )
    expect(
        rises and speeds[-1] <= 30.0, name,
        f"speeds that rise from above 0, to 30 m/s, with pulses that lead away from {centre}"
        + (" (on the other side than forward)" if name == "reverse" else ""), points,
    )  # fmt: skip
    expect(
        all(LEAST_PULSE <= pulse <= MOST_PULSE for _, pulse in points), name,
        f"pulses of {LEAST_PULSE} to {MOST_PULSE}", points,
    )  # fmt: skip


def pulse_of(speed: float, points: Points, centre: int) -> int:
    """Return the throttle pulse [us] of a speed >= 0 [m/s]; the centre below the first point."""
    if not points or speed < points[0][0]:
        return centre
    return round(_line(speed, [(s, float(p)) for s, p in points]))


def speed_of(pulse: int, points: Points, centre: int) -> float:
    """Return the speed [m/s], at least 0, of a throttle pulse [us] on the side of these points."""
    if not points:
        return 0.0
    side = 1 if points[0][1] > centre else -1
    if side * pulse < side * points[0][1]:
        return 0.0
    return _line(float(side * pulse), [(float(side * p), s) for s, p in points])


def _line(x: float, points: Sequence[tuple[float, float]]) -> float:
    """Interpolate linearly, constant beyond the last point; x is not less than the first one's."""
    for (x0, y0), (x1, y1) in zip(points, points[1:], strict=False):
        if x <= x1:
            return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return points[-1][1]


class NoTelemetry:
    """Decoder for boards without telemetry: counts the received lines and returns no readings.

    The RoboHAT MM1 sends the state of its remote control, in lines like the commands.
    """

    waiting = 0

    def __init__(self) -> None:
        self.counts = Counts()

    def feed(self, data: bytes) -> list[Reading]:
        """Count the bytes and lines; return no readings."""
        self.counts.n_bytes += len(data)
        self.counts.skipped += data.count(b"\n")
        return []


class PwmDriver:
    """Driver of a car with a PWM board as described at the head of this file."""

    baud = 115200
    gap = 0.03
    answers = False
    sequence = 0

    def __init__(self, options: PwmOptions) -> None:
        self.options = options
        backwards = options.reverse[0][0] if options.reverse else 0.0  # never driven
        self.slowest = max(options.forward[0][0], backwards)
        self.telemetry: Decoder = NoTelemetry()

    def opening(self) -> bytes:
        """Return the end of a cut line, and neutral, which arms the speed controller."""
        return b"\r" + self.neutral()

    def drive(self, speed: float, steering: float) -> bytes:
        """Return a line; speeds below the first point of the table give no motion."""
        if not (isfinite(speed) and isfinite(steering)):
            return self.neutral()
        options = self.options
        points = options.forward if speed >= 0.0 else options.reverse
        throttle = pulse_of(abs(speed), points, options.throttle_centre)
        share = min(max(steering / options.max_steering, -1.0), 1.0)
        return self._line(round(options.steering_centre + options.steering_span * share), throttle)

    def neutral(self) -> bytes:
        """Return a line with both centre pulses."""
        return self._line(self.options.steering_centre, self.options.throttle_centre)

    def ask(self) -> bytes:
        """Return nothing, since there is no telemetry."""
        return b""

    @staticmethod
    def _line(steering: int, throttle: int) -> bytes:
        return b"%d, %d\r" % (steering, throttle)
