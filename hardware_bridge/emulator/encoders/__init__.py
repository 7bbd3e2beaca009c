"""Encoders of emulated devices.

`decode(encode(readings))` returns the readings, within the resolution of the format.
"""

from __future__ import annotations

from collections.abc import Callable

from hardware_bridge.decoders.base import Encoder
from hardware_bridge.emulator.encoders.dw1000 import Dw1000Encoder
from hardware_bridge.emulator.encoders.dwm1001 import Dwm1001Encoder
from hardware_bridge.emulator.encoders.linktrack import LinkTrackEncoder
from hardware_bridge.emulator.encoders.positions import PositionsEncoder
from hardware_bridge.emulator.encoders.rplidar import RplidarEncoder
from hardware_bridge.emulator.encoders.uwb_core import UwbCoreEncoder
from hardware_bridge.emulator.encoders.witmotion import WitMotionEncoder
from hardware_bridge.errors import BridgeError

ENCODERS: dict[str, Callable[[str], Encoder]] = {
    "linktrack": LinkTrackEncoder,
    "uwb-core": UwbCoreEncoder,
    "dw1000": Dw1000Encoder,
    "dwm1001": Dwm1001Encoder,
    "witmotion": WitMotionEncoder,
    "rplidar": RplidarEncoder,
    "positions": PositionsEncoder,
}
"""Name of the format to a factory of the encoder from the name of its device."""


def make_encoder(name: str, device: str) -> Encoder:
    """Return the encoder of one device.

    Args:
        name: A key of `ENCODERS`.
        device: Id of the device as its format writes ids.

    Raises:
        BridgeError: Unknown format, or an invalid id.
    """
    if name not in ENCODERS:
        raise BridgeError(f"format {name!r} is not known; choose one of {', '.join(ENCODERS)}")
    return ENCODERS[name](device)
