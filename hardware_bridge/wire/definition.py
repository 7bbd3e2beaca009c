"""The messages of our own nodes and cars, as data.

The definition is the source of the tables of the codec (`hardware_bridge.wire.layout`), the table
of docs/reference/wire-format.md, and the C header of the firmware
(`hardware_bridge.wire.c_header`).

A number on the wire is a little-endian integer, `steps` per unit. The quantisation of every
measured value is far below the noise of the best intended sensor.
"""

from __future__ import annotations

from dataclasses import dataclass

VERSION = 1
HOST = 0xFFFF
"""Node id of the host that commands the cars; nodes have 0 to 65534."""
MOST_ROWS = 32
"""[-] Largest number of rows of a message."""
MOST_FRAME = 512
"""[bytes] Longest frame of any version, before stuffing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """A number of a message, or an array of numbers."""

    name: str
    type: str
    """Type: u8, u16, u32, i8, i16, i24 or i32."""
    n: int = 1
    """Number of consecutive numbers."""
    steps: int = 1
    """[1/unit] Ratio of the number on the wire to the value."""
    unit: str = ""
    bits: tuple[str, ...] = ()
    """Names of the bits, lowest first; other bits are sent as 0 and ignored."""
    meaning: str

    @property
    def size(self) -> int:
        """[bytes] Size of one number."""
        return int(self.type[1:]) // 8

    @property
    def limits(self) -> tuple[int, int]:
        """Smallest and largest number on the wire."""
        bits = 8 * self.size
        return (
            (-(1 << bits - 1), (1 << bits - 1) - 1) if self.type[0] == "i" else (0, (1 << bits) - 1)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """A type of message."""

    type: int
    name: str
    meaning: str
    fields: tuple[Field, ...] = ()
    repeated: bool = False
    """True if the payload is a count, u8 up to `MOST_ROWS`, followed by rows of the fields."""

    def field(self, name: str) -> Field:
        """Return the field of that name."""
        return next(field for field in self.fields if field.name == name)

    @property
    def columns(self) -> int:
        """Number of values of the message, or of one row."""
        return sum(field.n for field in self.fields)

    @property
    def size(self) -> int:
        """[bytes] Size of the payload, or of one row."""
        return sum(field.n * field.size for field in self.fields)


def _gyr() -> Field:
    return Field(
        name="gyr", type="i24", n=3, steps=100_000, unit="rad/s",
        meaning="turn rate in the body frame: x forward, y left, z up",
    )  # fmt: skip


def _acc() -> Field:
    return Field(
        name="acc", type="i24", n=3, steps=10_000, unit="m/s2",
        meaning="specific force in the body frame, +9.8 on z at rest",
    )  # fmt: skip


def _to() -> Field:
    return Field(name="to", type="u16", meaning="node of the car that is meant")


def _speed(meaning: str) -> Field:
    return Field(name="speed", type="i16", steps=1000, unit="m/s", meaning=meaning)


def _steering(meaning: str) -> Field:
    return Field(name="steering", type="i16", steps=10_000, unit="rad", meaning=meaning)


IMU = Message(
    type=1, name="imu", meaning="a sample of an inertial sensor", fields=(_gyr(), _acc())
)  # fmt: skip
IMU_MAG = Message(
    type=2, name="imu_mag", meaning="the same with the magnetometer",
    fields=(
        _gyr(), _acc(),
        Field(
            name="mag", type="i24", n=3, steps=1000, unit="uT",
            meaning="magnetic field in the body frame",
        ),
    ),
)  # fmt: skip
STATE = Message(
    type=3, name="state", meaning="of a node that filters its orientation itself",
    fields=(
        Field(
            name="q", type="i24", n=4, steps=8_000_000,
            meaning="unit quaternion w x y z, body to world",
        ),
        Field(
            name="acc", type="i24", n=3, steps=10_000, unit="m/s2",
            meaning="acceleration in the world frame, without gravity",
        ),
    ),
)  # fmt: skip
RANGES = Message(
    type=4, name="ranges", meaning="distances that were measured at one time", repeated=True,
    fields=(
        Field(name="to", type="u16", meaning="the other node"),
        Field(name="nearer", type="u16", meaning="the near end, where that is not the sender"),
        Field(name="distance", type="i32", steps=10_000, unit="m", meaning="between the antennas"),
        Field(name="rx_power", type="i16", steps=100, unit="dBm", meaning="received power"),
        Field(name="fp_power", type="i16", steps=100, unit="dBm", meaning="that of the first path"),
        Field(
            name="quality", type="u8", steps=255,
            meaning="how sure the radio is of a line of sight, 0 to 1",
        ),
        Field(
            name="has", type="u8", bits=("nearer", "rx_power", "fp_power", "quality"),
            meaning="which of these are there; the others are 0",
        ),
    ),
)  # fmt: skip
MOTION = Message(
    type=5, name="motion", meaning="what a car says of its own motion",
    fields=(
        _speed("forward, by wheels or motor"),
        _steering("of the front wheels, left is positive"),
        Field(name="has", type="u8", bits=("steering",), meaning="whether that is there"),
    ),
)  # fmt: skip
NEAR = Message(
    type=8, name="near", meaning="what distance sensors on a car measured at one time",
    repeated=True,
    fields=(
        Field(
            name="bearing", type="i16", steps=10_000, unit="rad",
            meaning="in which direction from the car's middle, 0 ahead, left is positive",
        ),
        Field(
            name="distance", type="u16", steps=1000, unit="m",
            meaning="from the car's body to what is nearest there",
        ),
        Field(
            name="has", type="u8", bits=("distance",), meaning="0 where the sensor sees nothing",
        ),
    ),
)  # fmt: skip
STATUS = Message(
    type=6, name="status", meaning="how a device does",
    fields=(
        Field(name="fault", type="u32", meaning="0 is none; else what the firmware says"),
        Field(name="voltage", type="u16", steps=1000, unit="V", meaning="of the battery"),
        Field(name="has", type="u8", bits=("voltage",), meaning="whether that is there"),
    ),
)  # fmt: skip
HEARTBEAT = Message(type=7, name="heartbeat", meaning="a device is alive")
COMMAND = Message(
    type=16, name="command", meaning="what a car is to do",
    fields=(
        _to(),
        _speed("forward"),
        _steering("left is positive"),
        Field(
            name="flags", type="u8", bits=("brake",),
            meaning="brake: stop, whatever the other fields say",
        ),
    ),
)  # fmt: skip
REMOTE = Message(
    type=17, name="remote", meaning="a person with a remote control asks a car for a velocity",
    fields=(
        _to(),
        Field(
            name="velocity", type="i16", n=2, steps=1000, unit="m/s",
            meaning="in the world frame, x and y",
        ),
    ),
)  # fmt: skip
ACK = Message(
    type=18, name="ack", meaning="a command was taken",
    fields=(Field(name="command", type="u32", meaning="sequence number of that command"),),
)  # fmt: skip

PEER = Message(
    type=9, name="peer",
    meaning="motion of another node, from its ranging messages; see `tracking.ranging`",
    fields=(
        Field(name="of", type="u16", meaning="the other node"),
        Field(
            name="age", type="u16", steps=10_000, unit="s",
            meaning="of the motion, before the time of the frame",
        ),
        Field(
            name="q", type="i24", n=4, steps=8_000_000,
            meaning="unit quaternion w x y z, body to world",
        ),
        Field(
            name="acc", type="i24", n=3, steps=10_000, unit="m/s2",
            meaning="mean acceleration in the world frame, without gravity",
        ),
        Field(
            name="noise", type="u16", steps=1000, unit="m/s2/sqrt(Hz)",
            meaning="density that adds to that of its accelerometer",
        ),
    ),
)  # fmt: skip

MESSAGES = (
    IMU, IMU_MAG, STATE, RANGES, MOTION, STATUS, HEARTBEAT, NEAR, PEER, COMMAND, REMOTE, ACK,
)  # fmt: skip
"""All messages. Other types are reserved; receivers skip them."""

HEADER = (
    Field(name="form", type="u8", meaning="version in the high four bits, flags in the low four"),
    Field(name="type", type="u8", meaning="which message it is"),
    Field(name="node", type="u16", meaning="who says it"),
    Field(name="boot", type="u32", meaning="differs from one start of the sender to the next"),
    Field(name="sequence", type="u32", meaning="counts the frames of a boot, from 0, without gaps"),
    Field(
        name="time", type="u32", unit="us", meaning="when it was measured, by the sender's clock"
    ),
)
HEADER_BYTES = sum(field.size for field in HEADER)
MAC_BYTES = 8
CRC_BYTES = 4
FLAG_MAC = 1
"""Flag of frames with a MAC. Other flags are reserved for later versions."""
