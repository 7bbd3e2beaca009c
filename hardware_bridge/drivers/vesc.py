"""Driver of the VESC, a motor controller with a servo output, on its UART or USB.

Speed is SET_RPM, regulated by the VESC; steering is SERVO. Every command is repeated at every tick:
the VESC stops its motor some time after the last *motor* command, regardless of SERVO and
GET_VALUES. ALIVE, which would extend the last throttle command, is never sent.

    erpm  = speed_to_erpm * speed
    servo = steering_to_servo * steering + servo_centre

References:
    [1] F1TENTH system, f1tenth_stack/config/vesc.yaml: conversions and limits of a 1:10 car.
        https://github.com/f1tenth/f1tenth_system
    [2] VESC firmware: comm/commands.c; motor/mcconf_default.h, `MCCONF_S_PID_MIN_RPM`.
        https://github.com/vedderb/bldc
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import ceil, floor, isfinite

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.base import Decoder
from hardware_bridge.drivers.options import expect
from hardware_bridge.drivers.vesc_frames import (
    GET_VALUES,
    SET_CURRENT_BRAKE,
    SET_RPM,
    SET_SERVO,
    FrameReader,
    frame,
)
from hardware_bridge.drivers.vesc_values import read_values
from hardware_bridge.readings import UNNAMED, MotionReading, Reading, StatusReading

MOST_ERPM = 1e6
"""[1/min] Above the speed of any motor; keeps numbers within their fields."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VescOptions:
    """Options of a car with a VESC; defaults with [1] are F1TENTH's."""

    speed_to_erpm: float = 4614.0
    """[1/min per m/s] Electrical revolutions per speed [1]; negative if the motor turns backwards.
    A wrong value scales every speed by the same factor."""
    steering_to_servo: float = -1.2135
    """[1/rad] Servo position per steering angle, left positive [1]; positive if the servo turns the
    other way."""
    servo_centre: float = 0.5304
    """[-] Servo position at which the car drives straight [1]."""
    servo_min: float = 0.15
    """[-] Lower limit of the servo position, to protect the linkage [1]."""
    servo_max: float = 0.85
    """[-] Upper limit of the servo position [1]."""
    min_erpm: float = 900.0
    """[1/min] "Minimum ERPM" of the VESC's speed controller, 900 by default [2]. Below it, the VESC
    does not regulate but brakes or rolls freely, depending on its firmware. Slower commands
    brake."""
    max_speed: float = 3.0
    """[m/s] Limit forwards and backwards; that of the simulated car."""
    max_steering: float = 0.42
    """[rad] Limit to either side; that of the simulated car. The servo limits may be narrower."""
    brake_current: float = 5.0
    """[A] Motor current for braking at commands without motion; assumed. More stops harder."""
    telemetry: bool = True
    """True to request speed, voltage and faults."""

    def __post_init__(self) -> None:
        """Refuse invalid values."""
        for name in ("speed_to_erpm", "steering_to_servo"):
            value = getattr(self, name)
            expect(isfinite(value) and value != 0.0, name, "a number that is not 0", value)
        for name in ("servo_min", "servo_max", "servo_centre"):
            value = getattr(self, name)
            expect(0.0 <= value <= 1.0, name, "0 to 1", value)
        low, high = self.servo_min, self.servo_max
        expect(low <= self.servo_centre, "servo_min", f"at most {self.servo_centre}", low)
        expect(high >= self.servo_centre, "servo_max", f"at least {self.servo_centre}", high)
        expect(high - low >= 0.002, "servo_max", f"more than {low}", high)
        fastest = MOST_ERPM / abs(self.speed_to_erpm)
        expect(0.0 < self.max_speed <= fastest, "max_speed", f"0 to {fastest:g}", self.max_speed)
        slowest = self.min_erpm / abs(self.speed_to_erpm)
        allowed = f"at least {slowest:.3g}, which is min_erpm"
        expect(self.max_speed >= slowest, "max_speed", allowed, self.max_speed)
        expect(0.0 < self.max_steering <= 1.5, "max_steering", "0 to 1.5", self.max_steering)
        expect(0.0 <= self.min_erpm <= MOST_ERPM, "min_erpm", f"0 to {MOST_ERPM:g}", self.min_erpm)
        expect(0.0 < self.brake_current <= 200.0, "brake_current", "0 to 200", self.brake_current)


def set_rpm(erpm: int) -> bytes:
    """Return the frame that commands a speed."""
    return frame(struct.pack(">Bi", SET_RPM, erpm))


def set_servo(thousandths: int) -> bytes:
    """Return the frame that sets the servo position, 0 to 1000."""
    return frame(struct.pack(">Bh", SET_SERVO, thousandths))


def set_current_brake(milliamperes: int) -> bytes:
    """Return the frame that brakes."""
    return frame(struct.pack(">Bi", SET_CURRENT_BRAKE, milliamperes))


class VescTelemetry:
    """Decoder of answers to GET_VALUES: a `MotionReading` and a `StatusReading` each."""

    def __init__(self, speed_to_erpm: float) -> None:
        self.counts = Counts()
        self._speed_to_erpm = speed_to_erpm
        self._frames = FrameReader(self.counts)

    @property
    def waiting(self) -> int:
        """Number of bytes kept of an incomplete frame."""
        return self._frames.waiting

    def feed(self, data: bytes) -> list[Reading]:
        """Process received bytes and return the readings that they complete, in order."""
        readings: list[Reading] = []
        for payload in self._frames.feed(data):
            values = read_values(payload)
            if values is None:
                self.counts.skipped += 1
                continue
            self.counts.frames += 1
            readings.append(MotionReading(UNNAMED, values.erpm / self._speed_to_erpm))
            readings.append(StatusReading(UNNAMED, values.voltage, values.fault))
        return readings


class VescDriver:
    """Driver of a car with a VESC as described at the head of this file."""

    baud = 115200
    gap = 0.0
    answers = False
    sequence = 0

    def __init__(self, options: VescOptions) -> None:
        self.options = options
        self.slowest = options.min_erpm / abs(options.speed_to_erpm)
        self.telemetry: Decoder = VescTelemetry(options.speed_to_erpm)
        self._brake = set_current_brake(max(1, round(options.brake_current * 1e3)))

    def opening(self) -> bytes:
        """Return nothing, since the VESC needs no greeting."""
        return b""

    def drive(self, speed: float, steering: float) -> bytes:
        """Return SERVO and SET_RPM, or SERVO and the brake below the lowest regulated speed."""
        if not (isfinite(speed) and isfinite(steering)):
            return self.neutral()
        options = self.options
        speed = min(max(speed, -options.max_speed), options.max_speed)
        # Truncated towards 0, so that rounding does not exceed the limit.
        erpm = int(options.speed_to_erpm * speed)
        is_slow = erpm == 0 or abs(erpm) < options.min_erpm
        return set_servo(self._servo(steering)) + (self._brake if is_slow else set_rpm(erpm))

    def neutral(self) -> bytes:
        """Return the brake command; the steering angle is kept."""
        return self._brake

    def ask(self) -> bytes:
        """Return GET_VALUES if telemetry is enabled."""
        return frame(bytes((GET_VALUES,))) if self.options.telemetry else b""

    def _servo(self, steering: float) -> int:
        """Return the servo position [1/1000] of a steering angle [rad], within all limits."""
        options = self.options
        steering = min(max(steering, -options.max_steering), options.max_steering)
        position = options.steering_to_servo * steering + options.servo_centre
        low, high = ceil(options.servo_min * 1e3), floor(options.servo_max * 1e3)
        return min(max(round(position * 1e3), low), high)
