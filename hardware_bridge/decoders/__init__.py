"""Decoders: bytes of devices to readings.

To add one: its file, and a line in `DECODERS`; docs/reference/decoders.md says what it must give.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hardware_bridge.decoders.base import Decoder
from hardware_bridge.decoders.dw1000 import dw1000_decoder
from hardware_bridge.decoders.dwm1001 import dwm1001_decoder
from hardware_bridge.decoders.linktrack import linktrack_decoder
from hardware_bridge.decoders.positions import positions_decoder
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.decoders.rplidar import REQUEST, RplidarDecoder
from hardware_bridge.decoders.uwb_core import uwb_core_decoder
from hardware_bridge.decoders.witmotion import witmotion_decoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import (
    HeartbeatReading,
    ImuReading,
    MotionReading,
    NearReading,
    OperatorReading,
    PairReading,
    PoseReading,
    RangeReading,
    ScanReading,
    StateReading,
    StatusReading,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DecoderEntry:
    """A format that can be read, and what is known of it beforehand."""

    device: str
    """Who speaks it, for people."""
    build: Callable[[bytes | None], Decoder]
    """A key, or None, to the decoder of one port."""
    tells: tuple[type, ...]
    """The readings that may come."""
    baud: int = 115200
    """[1/s] Of the device as it is usually set."""
    names_itself: bool = False
    """Every reading says who speaks; else the configuration of the port does."""
    tells_of_others: bool = False
    """Readings name the nodes that they are about, and who speaks does not matter."""
    has_time: bool = False
    """Readings carry the device's clock; else they are stamped on arrival."""
    keyed: bool = False
    """Messages carry a code that only holders of the key can make."""
    checked: bool = False
    """Frames carry a check sum; else a damaged digit can pass."""
    request: bytes = b""
    """See `hardware_bridge.links.ports.PortSpec`."""
    dtr: bool = True
    """The line DTR; off for a device whose motor it stops."""


DECODERS: dict[str, DecoderEntry] = {
    "relpos": DecoderEntry(
        device="nodes with our own firmware",
        build=RelposDecoder,
        tells=(
            ImuReading,
            StateReading,
            RangeReading,
            MotionReading,
            StatusReading,
            HeartbeatReading,
            NearReading,
            OperatorReading,
        ),
        names_itself=True,
        has_time=True,
        keyed=True,
        checked=True,
    ),
    "linktrack": DecoderEntry(
        device="Nooploop LinkTrack, mode DR",
        build=lambda key: linktrack_decoder(),
        tells=(ImuReading, RangeReading, StatusReading),
        baud=921600,
        names_itself=True,
        has_time=True,
        checked=True,
    ),
    "uwb-core": DecoderEntry(
        device="DWM1001 boards with uwb-core",
        build=lambda key: uwb_core_decoder(),
        tells=(RangeReading,),
        has_time=True,
    ),
    "dw1000": DecoderEntry(
        device="DW1000 boards with the Arduino library, Makerfabs ESP32-UWB",
        build=lambda key: dw1000_decoder(),
        tells=(RangeReading,),
    ),
    "dwm1001": DecoderEntry(
        device="DWM1001 with the maker's firmware",
        build=lambda key: dwm1001_decoder(),
        tells=(RangeReading,),
    ),
    "witmotion": DecoderEntry(
        device="WitMotion IMU",
        build=lambda key: witmotion_decoder(),
        tells=(ImuReading,),
        checked=True,
    ),
    "rplidar": DecoderEntry(
        device="Slamtec RPLidar, standard scan",
        build=lambda key: RplidarDecoder(),
        tells=(ScanReading,),
        request=REQUEST,
        dtr=False,
    ),
    "positions": DecoderEntry(
        device="any tracker that writes lines of positions",
        build=lambda key: positions_decoder(),
        tells=(PairReading, PoseReading),
        tells_of_others=True,
        has_time=True,
    ),
}
"""Name of the format, as in a configuration, to what is known of it."""


def make_decoder(name: str, key: bytes | None = None) -> Decoder:
    """The decoder of one port.

    Args:
        name: A key of `DECODERS`.
        key: Of formats whose messages carry a code made with one.

    Raises:
        BridgeError: No such format, or a key for a format that has none.
    """
    entry = DECODERS.get(name)
    if entry is None:
        raise BridgeError(f"format {name!r} is not known; choose one of {', '.join(DECODERS)}")
    if key is not None and not entry.keyed:
        raise BridgeError(f"format {name!r} has no key; leave `key` out")
    return entry.build(key)
