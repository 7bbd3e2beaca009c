"""Encoder of a DW1000 board with the Arduino library: one line per range."""

from __future__ import annotations

from hardware_bridge.decoders.dw1000 import ID
from hardware_bridge.readings import RangeReading, Reading


class Dw1000Encoder:
    """A board that ranges with others; the format does not include its own id."""

    def __init__(self, device: str) -> None:
        self._device = device

    def encode(self, readings: list[Reading]) -> bytes:
        """Return a line for each range to a board with an id of this format."""
        return "".join(
            range_line(r) for r in readings if isinstance(r, RangeReading) and ID.fullmatch(r.to)
        ).encode()


def range_line(reading: RangeReading) -> str:
    """Return the line that the library's example prints."""
    power = "nan" if reading.rx_power is None else f"{reading.rx_power:.2f}"
    return f"from: {reading.to}\t Range: {reading.distance:.2f} m\t RX power: {power} dBm\r\n"
