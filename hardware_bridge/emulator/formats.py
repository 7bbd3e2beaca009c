"""Formats of emulated nodes: supported readings, ids and clocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hardware_bridge.decoders.base import Encoder
from hardware_bridge.emulator.encoders import make_encoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import (
    MICROSECONDS_32,
    MILLISECONDS_32,
    DeviceClock,
    HeartbeatReading,
    ImuReading,
    PeerReading,
    RangeReading,
    Reading,
    StateReading,
    StatusReading,
)
from hardware_bridge.wire.encoder import RelposEncoder

EVERYTHING = frozenset(
    {ImuReading, StateReading, PeerReading, RangeReading, StatusReading, HeartbeatReading}
)
RANGES: frozenset[type] = frozenset({RangeReading})
IMUS: frozenset[type] = frozenset({ImuReading})


def decimal(node: int) -> str:
    """Return a node's id as most formats write it."""
    return str(node)


def short_address(node: int) -> str:
    """Return a node's id as a radio's short address, four capital hex digits."""
    return f"{node:04X}"


@dataclass(frozen=True, slots=True, kw_only=True)
class WireFormat:
    """A format as sent by a device."""

    name: str
    says: frozenset[type]
    """Kinds of supported readings; all others are left out."""
    clock: DeviceClock | None = None
    """Clock of its time stamps; None without time stamps."""
    name_of: Callable[[int], str] = decimal
    """Conversion of a node's id to the format's id."""
    names_itself: bool = True
    """False if messages do not include the sender, which the host's configuration must give."""
    always_voltage: bool = False
    """True if every frame contains the battery voltage."""
    own: Callable[[int, int], Encoder] | None = None
    """Node and boot number to an encoder; by default the encoder of this name in
    `hardware_bridge.emulator.encoders.ENCODERS` is used."""

    def build(self, node: int, boot: int) -> Encoder:
        """Return the encoder of a device that has just started."""
        if self.own is not None:
            return self.own(node, boot)
        return make_encoder(self.name, self.name_of(node))

    def can_say(self, kind: type[Reading]) -> bool:
        """Return whether the format has a message for this kind of reading."""
        return kind in self.says


def relpos(key: bytes | None = None) -> WireFormat:
    """Return the format of our own nodes.

    Args:
        key: Key of its MAC, 16 bytes; None for no MAC.
    """

    def build(node: int, boot: int) -> Encoder:
        return RelposEncoder(node, boot, key)

    return WireFormat(name="relpos", says=EVERYTHING, clock=MICROSECONDS_32, own=build)


THIRD_PARTY: Mapping[str, WireFormat] = {
    f.name: f
    for f in (
        WireFormat(
            name="linktrack",
            says=RANGES | {StatusReading},
            clock=MILLISECONDS_32,
            always_voltage=True,
        ),
        WireFormat(
            name="uwb-core",
            says=RANGES,
            clock=MICROSECONDS_32,
            name_of=short_address,
            names_itself=False,
        ),
        WireFormat(name="dw1000", says=RANGES, name_of=short_address, names_itself=False),
        WireFormat(name="dwm1001", says=RANGES, name_of=short_address, names_itself=False),
        WireFormat(name="witmotion", says=IMUS, names_itself=False),
    )
}
"""Formats of commercial devices."""


def wire_format(name: str, key: bytes | None = None) -> WireFormat:
    """Return a format by name.

    Args:
        name: ``relpos`` or one of `THIRD_PARTY`.
        key: For the MAC of ``relpos``; the others have none.

    Raises:
        BridgeError: Unknown name.
    """
    if name == "relpos":
        return relpos(key)
    if name not in THIRD_PARTY:
        raise BridgeError(f"format: expected one of relpos, {', '.join(THIRD_PARTY)}, got {name!r}")
    return THIRD_PARTY[name]


def check_formats(formats: tuple[WireFormat, ...]) -> None:
    """Refuse formats that are insufficient for tracking.

    Raises:
        BridgeError: No format supports ranges, or none supports inertial samples.
    """
    names = " and ".join(f.name for f in formats)
    if not any(f.can_say(RangeReading) for f in formats):
        raise BridgeError(f"format: {names} cannot say distances, expected one that can")
    if not any(f.can_say(ImuReading) or f.can_say(StateReading) for f in formats):
        raise BridgeError(f"imu_format: {names} cannot say inertial samples, expected witmotion")
