"""Driver of cars with our own firmware: numbered commands in the wire format, signed with a key."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from hardware_bridge.decoders.base import Decoder
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import MICROSECONDS_32, DriveReading, Source
from hardware_bridge.wire.conversion import NODE_LIMIT
from hardware_bridge.wire.definition import COMMAND, HOST
from hardware_bridge.wire.encoder import RelposEncoder


@dataclass(frozen=True, slots=True, kw_only=True)
class RelposOptions:
    """Limits of the commands; the format itself permits 32.767 m/s and 3.2767 rad."""

    max_speed: float = 2.0
    """[m/s] Limit in both directions; the default is that of the environment's actions."""
    max_steering: float = 0.42
    """[rad] Limit to both sides; the default is that of the front wheels of 1:10 cars."""

    def __post_init__(self) -> None:
        """Refuse limits beyond the format."""
        for name, limit in (("max_speed", 32.767), ("max_steering", 3.2767)):
            value = getattr(self, name)
            if not 0.0 < value <= limit:
                raise BridgeError(f"{name}: expected more than 0, up to {limit}, got {value}")


class RelposDriver:
    """Driver of one car, see `hardware_bridge.drivers.base.CarDriver`.

    Every command is a frame of `HOST` with its own number, `sequence`; the car answers with an
    `AckReading` of that number. The car has to stop by itself after a while without commands.
    """

    baud = 115200
    gap = 0.0
    answers = True
    slowest = 0.0

    def __init__(
        self,
        node: int,
        options: RelposOptions,
        key: bytes | None,
        boot: int,
        now_us: Callable[[], int],
    ) -> None:
        """Create a driver.

        Args:
            node: Node of the car, 0 to 65534.
            options: Limits of the commands.
            key: 16 bytes that are also stored in the car, or None.
            boot: Boot number of this start, 0 to 2^32 - 1; it must rise if a key is used.
            now_us: A monotonic clock [us].

        Raises:
            ValueError: An argument is out of range.
        """
        if not 0 <= node < NODE_LIMIT - 1:
            raise ValueError(f"node: expected 0 to {NODE_LIMIT - 2}, got {node}")
        self.telemetry: Decoder = RelposDecoder(key)
        self._encoder = RelposEncoder(HOST, boot, key)
        self._fastest = _within(options.max_speed, "speed")
        self._most = _within(options.max_steering, "steering")
        self._to = str(node)
        self._now_us = now_us

    @property
    def sequence(self) -> int:
        """Number of the next command."""
        return self._encoder.sequence

    @property
    def boot(self) -> int:
        """Boot number of the next command."""
        return self._encoder.boot

    def opening(self) -> bytes:
        """Return a zero, which ends any partial frame in the car's buffer."""
        return b"\0"

    def drive(self, speed: float, steering: float) -> bytes:
        """Return the command for a speed [m/s] and steering [rad]; see `CarDriver.drive`."""
        if not (math.isfinite(speed) and math.isfinite(steering)):
            return self.neutral()
        fastest, most = self._fastest, self._most
        speed = min(max(speed, -fastest), fastest)
        return self._say(speed, min(max(steering, -most), most), brake=False)

    def neutral(self) -> bytes:
        """Return the command for no motion, with the brake."""
        return self._say(0.0, 0.0, brake=True)

    def ask(self) -> bytes:
        """Return nothing, since telemetry is sent unprompted."""
        return b""

    def _say(self, speed: float, steering: float, *, brake: bool) -> bytes:
        source = Source(ticks=self._now_us(), clock=MICROSECONDS_32)
        return self._encoder.encode([DriveReading(source, self._to, speed, steering, brake)])


def _within(limit: float, name: str) -> float:
    """Return the largest number that the field can represent within the limit."""
    steps = COMMAND.field(name).steps
    return math.floor(limit * steps) / steps
