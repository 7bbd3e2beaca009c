"""What devices say, in SI units, before anything is known of who they are in the group.

Decoders make readings of bytes, the emulator makes bytes of readings. A reading holds what the
device itself said: its own name for itself and others, its own clock. Names become nodes and
clocks become the host's in `hardware_bridge.ingest.intake`.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from tracking.estimate import Status

Vector: TypeAlias = tuple[float, float, float]


class DeviceClock(NamedTuple):
    """A counter of a device."""

    hz: float
    """Ticks per second, nominal."""
    modulus: int
    """The counter goes back to 0 here."""


MICROSECONDS_32 = DeviceClock(1e6, 1 << 32)
"""Wraps after 71.6 min."""
MILLISECONDS_32 = DeviceClock(1e3, 1 << 32)
MICROSECONDS_64 = DeviceClock(1e6, 1 << 64)
"""Never wraps."""
RADIO_40 = DeviceClock(128 * 499.2e6, 1 << 40)
"""Time stamps of DW1000 and DW3000; wraps every 17.2 s."""


class Source(NamedTuple):
    """Who said it, and when by its own clock; None is what the format does not tell."""

    device: str | None = None
    """Its own id, as its format writes ids: decimal digits, or capital hex digits."""
    boot: int | None = None
    """A number that differs from one start of the device to the next."""
    sequence: int | None = None
    """Counts the messages of a boot, without gaps, modulo 2^32."""
    ticks: int | None = None
    """When it was measured, by `clock`."""
    clock: DeviceClock | None = None


UNNAMED = Source()
"""Of formats that tell nothing."""


class ImuReading(NamedTuple):
    """A sample of an inertial sensor, and of the magnetometer where it has one."""

    source: Source
    gyr: Vector
    """[rad/s] Body frame: x forward, y left, z up."""
    acc: Vector
    """[m/s2] Specific force, +9.8 on z at rest."""
    mag: Vector | None = None
    """[uT]"""


class StateReading(NamedTuple):
    """What a node sends that filters its orientation itself."""

    source: Source
    q_wb: tuple[float, float, float, float]
    """w x y z, body to world."""
    accel_w: Vector
    """[m/s2] Without gravity."""


class RangeReading(NamedTuple):
    """A distance between two devices."""

    source: Source
    to: str
    """The other device, written like `Source.device`."""
    distance: float
    """[m]"""
    rx_power: float | None = None
    """[dBm]"""
    fp_power: float | None = None
    """[dBm] Of the first path."""
    nearer: str | None = None
    """The end that is not `to`, where it is not the one that says it."""


class MotionReading(NamedTuple):
    """What a car says of its own motion."""

    source: Source
    speed: float
    """[m/s] Forward, by its wheels or its motor."""
    steering: float | None = None
    """[rad] Of the front wheels, left is positive."""


class NearReading(NamedTuple):
    """What a distance sensor on a car measured."""

    source: Source
    bearing: float
    """[rad] From the car's middle, 0 ahead, left is positive."""
    distance: float | None
    """[m] From the car's body to what is nearest in that direction; None where nothing is."""


class ScanReading(NamedTuple):
    """What a scanner of its own port measured, from where it is on the car."""

    source: Source
    bearing: float
    """[rad] From the scanner's front, left is positive."""
    distance: float | None
    """[m] From the scanner; None where nothing was measured."""


class StatusReading(NamedTuple):
    """How a device does."""

    source: Source
    voltage: float | None = None
    """[V]"""
    fault: int = 0
    """0 is none; else what its maker says."""


class AckReading(NamedTuple):
    """A device took a command."""

    source: Source
    command: int
    """Sequence number of that command."""


class HeartbeatReading(NamedTuple):
    """A device is alive."""

    source: Source


class OperatorReading(NamedTuple):
    """A person with a remote control trims a car: a velocity on top of what the plan asks for."""

    source: Source
    to: str
    """The car's node."""
    velocity: tuple[float, float]
    """[m/s] World frame, x and y."""


class DriveReading(NamedTuple):
    """A command to a car, as the car reads it."""

    source: Source
    to: str
    speed: float
    """[m/s] Forward."""
    steering: float
    """[rad] Left is positive."""
    brake: bool
    """Stand still, whatever speed and steering say."""


class PairReading(NamedTuple):
    """Where one node is relative to another, by a tracker that is not ours; world frame."""

    source: Source
    i: str
    """One node, written like `Source.device`."""
    j: str
    """The other."""
    pos: Vector
    """[m] p_j - p_i."""
    vel: Vector | None = None
    """[m/s] v_j - v_i."""
    cov: tuple[float, ...] | None = None
    """Of the position, 3 x 3 [m2], or of position and velocity, 6 x 6; row by row."""
    status: Status = Status.OK
    nlos: float = 0.0
    """[-] Probability that it rests on what was not in sight."""


class PoseReading(NamedTuple):
    """Where a node is, where it points and how it moves, as far as a tracker tells; world frame."""

    source: Source
    node: str
    """Written like `Source.device`."""
    pos: Vector | None = None
    """[m] From any origin that is the same for all nodes."""
    vel: Vector | None = None
    """[m/s]"""
    cov: tuple[float, ...] | None = None
    """As of `PairReading`."""
    q_wb: tuple[float, float, float, float] | None = None
    """w x y z, body to world."""
    speed: float | None = None
    """[m/s] Forward."""


Reading: TypeAlias = (
    ImuReading
    | StateReading
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
