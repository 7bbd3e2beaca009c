"""A capture of the raw bytes of a serial port, in a format with device timestamps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from agents.convert.sources import Record
from agents.errors import UsageError
from hardware_bridge.decoders import DECODERS, make_decoder
from hardware_bridge.readings import ImuReading, RangeReading

FORMATS = tuple(
    name
    for name, entry in DECODERS.items()
    if entry.has_time and not entry.keyed and RangeReading in entry.tells
)
"""Unsigned formats with ranges and device timestamps."""
CHUNK = 65536
"""[bytes] Size of a read."""


class Capture:
    """Streams are ``ranges`` (i, j, distance, rx_power, fp_power) and ``imu`` (node, gyr, acc)."""

    def __init__(self, path: Path, form: str) -> None:
        """Decode the file.

        Args:
            path: File with the bytes of one port.
            form: One of `FORMATS`.

        Raises:
            UsageError: The format is unknown, the file cannot be read, or it holds no frame of the
                format, a frame without a time, or frames of several clocks.
        """
        if form not in FORMATS:
            raise UsageError(f"format: expected one of {', '.join(FORMATS)}, got {form!r}")
        self._streams: dict[str, list[tuple[float, dict[str, Any]]]] = {"ranges": [], "imu": []}
        self._path, self._end, self._last = path, 0, 0
        self._clocks: set[str | None] = set()
        decoder = make_decoder(form)
        try:
            with path.open("rb") as file:
                while data := file.read(CHUNK):
                    for reading in decoder.feed(data):
                        if isinstance(reading, (RangeReading, ImuReading)):
                            self._take(reading)
        except OSError as error:
            raise UsageError(f"{path}: cannot be read ({error.strerror})") from error
        if not any(self._streams.values()):
            raise UsageError(f"{path}: expected ranges in the format {form!r}, found none")

    def names(self) -> list[str]:
        """Return the streams that have records."""
        return [name for name, rows in self._streams.items() if rows]

    def records(self, names: list[str]) -> Iterator[Record]:
        """Yield the readings of some streams, stream by stream, in the order of transmission."""
        for name in names:
            for k, (t, fields) in enumerate(self._streams[name]):
                yield Record(name, k, t, fields.__getitem__)

    def close(self) -> None:
        """Do nothing: no file stays open."""

    def _take(self, reading: RangeReading | ImuReading) -> None:
        t, device = self._time(reading), reading.source.device
        if isinstance(reading, ImuReading):
            self._streams["imu"].append(
                (t, {"node": device or self._path.stem, "gyr": reading.gyr, "acc": reading.acc})
            )
            return
        fields = {
            "i": reading.nearer or device or self._path.stem,
            "j": reading.to,
            "distance": reading.distance,
            "rx_power": reading.rx_power if reading.rx_power is not None else float("nan"),
            "fp_power": reading.fp_power if reading.fp_power is not None else float("nan"),
        }
        self._streams["ranges"].append((t, fields))

    def _time(self, reading: RangeReading | ImuReading) -> float:
        """Return the unwrapped time of the device clock [s]."""
        ticks, clock, device = reading.source.ticks, reading.source.clock, reading.source.device
        if ticks is None or clock is None:
            raise UsageError(f"{self._path}: a frame has no time; record it with `relpos live`")
        if not self._clocks:
            self._last = self._end = ticks
        self._clocks.add(device)
        if len(self._clocks) > 1:
            raise UsageError(
                f"{self._path}: has times of the clocks of {sorted(map(str, self._clocks))}, "
                "expected one device; record several with `relpos live`"
            )
        step = (ticks - self._last + clock.modulus // 2) % clock.modulus - clock.modulus // 2
        self._last, self._end = ticks, self._end + step
        return self._end / clock.hz
