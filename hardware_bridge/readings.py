"""Readings of devices in SI units, not yet assigned to nodes of the group.

Decoders convert bytes to readings, the emulator converts readings to bytes. A reading holds the
device's own names for itself and others and the time of its own clock.
`hardware_bridge.ingest.intake` converts names to nodes and times to the host's clock.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from tracking.estimate import Status

Vector: TypeAlias = tuple[float, float, float]


class DeviceClock(NamedTuple):
    """A counter of a device."""

    hz: float
    """[1/s] Nominal tick rate."""
    modulus: int
    """[ticks] The counter wraps to 0 at this value."""


MICROSECONDS_32 = DeviceClock(1e6, 1 << 32)
"""Counter that wraps after 71.6 min."""
MILLISECONDS_32 = DeviceClock(1e3, 1 << 32)
MICROSECONDS_64 = DeviceClock(1e6, 1 << 64)
"""Counter that never wraps."""
RADIO_40 = DeviceClock(128 * 499.2e6, 1 << 40)
"""Counter of time stamps of DW1000 and DW3000; wraps every 17.2 s."""


class Source(NamedTuple):
    """Sender of a reading and time by its own clock; None if the format does not include it."""

    device: str | None = None
    """Id of the device as its format writes ids: decimal digits, or capital hex digits."""
    boot: int | None = None
    """A number that differs from one start of the device to the next."""
    sequence: int | None = None
    """Number of the message since boot, without gaps, modulo 2^32."""
    ticks: int | None = None
    """[ticks] Time of the measurement by `clock`."""
    clock: DeviceClock | None = None


UNNAMED = Source()
"""Source of readings in formats without id and time."""


class ImuReading(NamedTuple):
    """A sample of an inertial sensor, and of its magnetometer if it has one."""

    source: Source
    gyr: Vector
    """[rad/s] Body frame: x forward, y left, z up."""
    acc: Vector
    """[m/s2] Specific force, +9.8 on z at rest."""
    mag: Vector | None = None
    """[uT] Magnetic field, body frame."""


class StateReading(NamedTuple):
    """Output of a node that runs an attitude filter itself."""

    source: Source
    q_wb: tuple[float, float, float, float]
    """w x y z, body to world."""
    accel_w: Vector
    """[m/s2] Acceleration without gravity, world frame."""


class PeerReading(NamedTuple):
    """Motion of another node, as the device computes it from the ranging messages of that node."""

    source: Source
    of: str
    """The other device, written like `Source.device`."""
    age: float
    """[s] Age of the motion at the time of the source."""
    q_wb: tuple[float, float, float, float]
    """w x y z, body to world."""
    accel_w: Vector
    """[m/s2] Mean acceleration without gravity, world frame."""
    noise: float = 0.0
    """[m/s2/sqrt(Hz)] Noise density that adds to that of its accelerometer."""


class RangeReading(NamedTuple):
    """A distance between two devices."""

    source: Source
    to: str
    """The other device, written like `Source.device`."""
    distance: float
    """[m] Measured range."""
    rx_power: float | None = None
    """[dBm] Receive power."""
    fp_power: float | None = None
    """[dBm] Power of the first path."""
    nearer: str | None = None
    """The end opposite to `to`, if it is not the device that reports the range."""


class MotionReading(NamedTuple):
    """Speed and steering as measured by a car."""

    source: Source
    speed: float
    """[m/s] Forward speed, by the wheels or the motor."""
    steering: float | None = None
    """[rad] Steering angle of the front wheels, left is positive."""


class NearReading(NamedTuple):
    """A measurement of a distance sensor on a car."""

    source: Source
    bearing: float
    """[rad] Direction from the car's centre, 0 is ahead, left is positive."""
    distance: float | None
    """[m] From the car's body to the nearest object in that direction; None if there is none."""


class ScanReading(NamedTuple):
    """A measurement of a scanner with a port of its own, relative to its mounting position."""

    source: Source
    bearing: float
    """[rad] Direction from the scanner's front, left is positive."""
    distance: float | None
    """[m] Distance from the scanner; None if nothing was measured."""


class StatusReading(NamedTuple):
    """Battery voltage and fault code of a device."""

    source: Source
    voltage: float | None = None
    """[V] Supply voltage."""
    fault: int = 0
    """0 is no fault; other codes are defined by the manufacturer."""


class AckReading(NamedTuple):
    """Acknowledgement of a command by a device."""

    source: Source
    command: int
    """Sequence number of that command."""


class HeartbeatReading(NamedTuple):
    """Sign of life of a device."""

    source: Source


class OperatorReading(NamedTuple):
    """A velocity trim for a car by an operator, added to the planned velocity."""

    source: Source
    to: str
    """The car's node."""
    velocity: tuple[float, float]
    """[m/s] Velocity x, y in the world frame."""


class DriveReading(NamedTuple):
    """A command to a car, as the car receives it."""

    source: Source
    to: str
    speed: float
    """[m/s] Forward speed."""
    steering: float
    """[rad] Steering angle, left is positive."""
    brake: bool
    """True if the car shall stop, regardless of speed and steering."""


class PairReading(NamedTuple):
    """Relative position of two nodes by an external tracker; world frame."""

    source: Source
    i: str
    """One node, written like `Source.device`."""
    j: str
    """The other node."""
    pos: Vector
    """[m] Relative position p_j - p_i."""
    vel: Vector | None = None
    """[m/s] Relative velocity v_j - v_i."""
    cov: tuple[float, ...] | None = None
    """Covariance of the position, 3 x 3 [m2], or of position and velocity, 6 x 6; row by row."""
    status: Status = Status.OK
    nlos: float = 0.0
    """[-] Probability that the estimate is based on NLOS measurements."""


class PoseReading(NamedTuple):
    """Position, attitude and motion of a node as far as a tracker reports them; world frame."""

    source: Source
    node: str
    """Written like `Source.device`."""
    pos: Vector | None = None
    """[m] Position from any origin that is the same for all nodes."""
    vel: Vector | None = None
    """[m/s] Velocity."""
    cov: tuple[float, ...] | None = None
    """Covariance of the position, 3 x 3 [m2], or of position and velocity, 6 x 6; row by row."""
    q_wb: tuple[float, float, float, float] | None = None
    """w x y z, body to world."""
    speed: float | None = None
    """[m/s] Forward speed."""


Reading: TypeAlias = (
    ImuReading
    | StateReading
    | PeerReading
    | RangeReading
    | MotionReading
    | NearReading
    | ScanReading
    | StatusReading
    | AckReading
    | HeartbeatReading
    | OperatorReading
    | DriveReading
    | PairReading
    | PoseReading
)
