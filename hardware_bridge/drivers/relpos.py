"""Cars with our own firmware: commands in the wire format, numbered and, with a key, with a MAC."""

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
    """What a car may be asked for; the format itself says up to 32.767 m/s and 3.2767 rad."""

    max_speed: float = 2.0
    """[m/s] Faster is asked for as this, both ways; default: that of the environment's actions."""
    max_steering: float = 0.42
    """[rad] More is asked for as this, both ways; default: front wheels of cars of scale 1:10."""

    def __post_init__(self) -> None:
        """Refuse what the format cannot say."""
        for name, limit in (("max_speed", 32.767), ("max_steering", 3.2767)):
            value = getattr(self, name)
            if not 0.0 < value <= limit:
                raise BridgeError(f"{name}: expected more than 0, up to {limit}, got {value}")


class RelposDriver:
    """See `hardware_bridge.drivers.base.CarDriver`.

    Every command is a frame of `HOST` with a number of its own, `sequence`; the car answers with an
    `AckReading` of that number. It has to stop by itself when none came for a while.
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
        """Name the car.

        Args:
            node: Of the car, 0 to 65534.
            options: Its limits.
            key: 16 bytes that the car has too, or None.
            boot: Of this start of ours, 0 to 2^32 - 1; has to rise where a key is used.
            now_us: A monotonic clock [us].

        Raises:
            ValueError: One of them is not so.
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
        """Of the next command."""
        return self._encoder.boot

    def opening(self) -> bytes:
        """A zero: ends whatever the car took for the beginning of a frame."""
        return b"\0"

    def drive(self, speed: float, steering: float) -> bytes:
        """Ask for a speed [m/s], forward positive, and a steering angle [rad], left positive."""
        if not (math.isfinite(speed) and math.isfinite(steering)):
            return self.neutral()
        fastest, most = self._fastest, self._most
        speed = min(max(speed, -fastest), fastest)
        return self._say(speed, min(max(steering, -most), most), brake=False)

    def neutral(self) -> bytes:
        """Ask for no motion, with the brake."""
        return self._say(0.0, 0.0, brake=True)

    def ask(self) -> bytes:
        """Nothing: telemetry comes by itself."""
        return b""

    def _say(self, speed: float, steering: float, *, brake: bool) -> bytes:
        source = Source(ticks=self._now_us(), clock=MICROSECONDS_32)
        return self._encoder.encode([DriveReading(source, self._to, speed, steering, brake)])


def _within(limit: float, name: str) -> float:
    """The greatest number that the field can say and that is not beyond the limit."""
    steps = COMMAND.field(name).steps
    return math.floor(limit * steps) / steps
