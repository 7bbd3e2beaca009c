"""Decoders: bytes of devices to readings.

To add one: a file and a line in `DECODERS`; see docs/reference/decoders.md for the contract.
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
    PeerReading,
    PoseReading,
    RangeReading,
    ScanReading,
    StateReading,
    StatusReading,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DecoderEntry:
    """A supported format and its fixed properties."""

    device: str
    """Devices that use the format, for display."""
    build: Callable[[bytes | None], Decoder]
    """Function from a key, or None, to the decoder of one port."""
    tells: tuple[type, ...]
    """Types of readings that the decoder may return."""
    baud: int = 115200
    """[baud] Usual setting of the device."""
    names_itself: bool = False
    """True if every reading names its sender; else the configuration of the port does."""
    tells_of_others: bool = False
    """True if readings name the nodes that they describe; their sender has no meaning."""
    has_time: bool = False
    """True if readings carry the device's clock; else they are stamped on arrival."""
    keyed: bool = False
    """True if messages carry an authentication code made with a key."""
    checked: bool = False
    """True if frames carry a check sum; else a damaged digit can pass."""
    request: bytes = b""
    """Bytes sent to the device on opening, see `hardware_bridge.links.ports.PortSpec`."""
    dtr: bool = True
    """State of the line DTR; False for a device whose motor it stops."""


DECODERS: dict[str, DecoderEntry] = {
    "relpos": DecoderEntry(
        device="nodes with our own firmware",
        build=RelposDecoder,
        tells=(
            ImuReading,
            StateReading,
            PeerReading,
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
"""Entries by name of the format as in a configuration."""


def make_decoder(name: str, key: bytes | None = None) -> Decoder:
    """Return a new decoder for one port.

    Args:
        name: A key of `DECODERS`.
        key: Key of the authentication code, for formats that have one.

    Raises:
        BridgeError: The format is unknown, or a key is given for a format without one.
    """
    entry = DECODERS.get(name)
    if entry is None:
        raise BridgeError(f"format {name!r} is not known; choose one of {', '.join(DECODERS)}")
    if key is not None and not entry.keyed:
        raise BridgeError(f"format {name!r} has no key; leave `key` out")
    return entry.build(key)
