"""Encoder of a board with uwb-core: one JSON line per range, as of 2021."""

from __future__ import annotations

from hardware_bridge.decoders.uwb_core import HEX_ID
from hardware_bridge.emulator.encoders.ticks import ticks_on
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import MICROSECONDS_32, RangeReading, Reading


class UwbCoreEncoder:
    """A board that ranges with others; `device` is its id in hex, such as "989C"."""

    def __init__(self, device: str) -> None:
        if not HEX_ID.fullmatch(device) or not 0 < int(device, 16) < 0xFFFF:
            raise BridgeError(f"device {device!r} is no id of uwb-core; give 1 to FFFE in hex")
        self._device = device

    def encode(self, readings: list[Reading]) -> bytes:
        """Return a line for each range between boards with ids of this format."""
        return "".join(
            self._line(r)
            for r in readings
            if isinstance(r, RangeReading) and HEX_ID.fullmatch(r.to)
        ).encode()

    def _line(self, reading: RangeReading) -> str:
        time = ticks_on(MICROSECONDS_32, reading)
        own = int(reading.nearer or self._device, 16)
        ends = f'"uid": {own},"ouid": {int(reading.to, 16)}'
        line = f'{{"utime": {time},"c": 278,{ends},"raz": [{reading.distance:.6f}]'
        if reading.rx_power is not None:
            line += f',"rssi": [{reading.rx_power:.6f}]'
        return line + "}\n"
