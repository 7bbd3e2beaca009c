"""Print the readings of one port as they arrive (`relpos sniff`)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

from agents.errors import UsageError
from agents.hardware.inspection.hearing import Formats, Hearing, known_formats, why_nothing_fits
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.link_state import LinkNotice
from hardware_bridge.links.links import Links
from hardware_bridge.links.ports import Chunk, PortSpec
from hardware_bridge.readings import Reading

TURN = 0.05
"""[s] Longest wait for bytes before the end time is checked."""
USUAL_BAUD = 115200
"""[1/s] Default baud rate."""
MOST_PENDING = 2000
"""[-] Readings kept per format until the format is detected."""

Show = Callable[[float, Reading], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sniffed:
    """Received bytes, frames and readings of a port."""

    seconds: float
    n_bytes: int
    format: str | None
    """Requested format, or the detected one; None if none fits."""
    readings: int
    frames: int
    damaged: int
    skipped: int
    strange: int
    """[-] Bytes outside of frames."""

    @property
    def record(self) -> dict[str, Any]:
        """JSON record."""
        return {"kind": "counts", **{f.name: getattr(self, f.name) for f in fields(self)}}


def sniff(
    port: str,
    *,
    format: str | None = None,
    baud: int | None = None,
    seconds: float | None = None,
    key: bytes | None = None,
    show: Show | None = None,
    show_chunk: Callable[[float, Chunk], None] | None = None,
    show_notice: Callable[[LinkNotice], None] | None = None,
    formats: Formats | None = None,
    now_ns: Callable[[], int] = time.monotonic_ns,
) -> Sniffed:
    """Listen to a port; only the request of a format given by name is written to it.

    Args:
        port: As in `PortSpec.port`.
        format: Name of a format; by default all are tried, and the detected one is shown.
        baud: Baud rate [1/s]; by default that of the format, else 115200.
        seconds: Duration [s]; None runs until interrupted.
        key: Key of formats with signed messages.
        show: Called with each reading and its time since the start [s].
        show_chunk: Called with the time [s] and the raw bytes, which then need not fit any format.
        show_notice: Called when the port is lost or reconnected.
        formats: Formats to try; by default all known formats.
        now_ns: Monotonic clock of the host [ns].

    Raises:
        BridgeError: The port cannot be opened, sends nothing, or nothing that can be decoded.
        UsageError: No such format, or a number out of range.
    """
    formats = known_formats() if formats is None else formats
    spec = _port_spec(port, format, baud, formats)
    if seconds is not None and not 0.1 <= seconds <= 86400.0:
        raise UsageError(f"--seconds: expected 0.1 to 86400, got {seconds:g}")
    Hearing.get_ready(formats)
    hearing = Hearing(formats, key)
    chooser = _Chooser(hearing, format, show)
    with Links([spec], now_ns) as links:
        start = now_ns()
        end = None if seconds is None else start + round(seconds * 1e9)
        links.drain_notices()
        try:
            while end is None or now_ns() < end:
                for chunk in links.wait(TURN):
                    t = (chunk.t_ns - start) / 1e9
                    if show_chunk is not None:
                        show_chunk(t, chunk)
                    chooser.take(t, chunk)
                for notice in links.drain_notices():
                    if show_notice is not None:
                        show_notice(notice)
        except KeyboardInterrupt:
            pass  # the user ends the command
        listened = (now_ns() - start) / 1e9
    sniffed = _sniffed(hearing, chooser, listened)
    if show_chunk is None:
        _check(hearing, format, spec.baud, formats, port)
    return sniffed


def _port_spec(port: str, format: str | None, baud: int | None, formats: Formats) -> PortSpec:
    """Return the settings of the port.

    Raises:
        UsageError: Invalid name of a port, or no such format.
    """
    if not port or "\0" in port:
        raise UsageError(f"PORT: expected the name of a port, got {port!r}")
    spec = PortSpec(name="port", port=port, baud=USUAL_BAUD if baud is None else baud)
    if format is None:
        return spec
    if format not in formats:
        raise UsageError(f"--format: expected one of {', '.join(formats)}, got {format!r}")
    entry = formats[format]
    baud = entry.baud if baud is None else baud
    return replace(spec, baud=baud, request=entry.request, dtr=entry.dtr)


class _Chooser:
    """Buffer of the readings of every format until the format is detected."""

    def __init__(self, hearing: Hearing, format: str | None, show: Show | None) -> None:
        self._hearing = hearing
        self.format = format
        self.shown = 0
        self._show = show
        self._pending: dict[str, list[tuple[float, Reading]]] = {}

    def take(self, t: float, chunk: Chunk) -> None:
        for name, readings in self._hearing.take(chunk).items():
            if self.format is None:
                held = self._pending.setdefault(name, [])
                held += [(t, reading) for reading in readings]
                del held[:-MOST_PENDING]
            elif name == self.format:
                self._give([(t, reading) for reading in readings])
        if self.format is None:
            self.format = self._hearing.best()
            if self.format is not None:
                self._give(self._pending.get(self.format, []))
                self._pending.clear()

    def _give(self, readings: list[tuple[float, Reading]]) -> None:
        self.shown += len(readings)
        if self._show is not None:
            for t, reading in readings:
                self._show(t, reading)


def _sniffed(hearing: Hearing, chooser: _Chooser, seconds: float) -> Sniffed:
    decoder = hearing.decoders.get(chooser.format) if chooser.format is not None else None
    counts = decoder.counts if decoder is not None else None
    return Sniffed(
        seconds=seconds,
        n_bytes=hearing.n_bytes,
        format=chooser.format,
        readings=chooser.shown,
        frames=counts.frames if counts else 0,
        damaged=counts.damaged if counts else 0,
        skipped=counts.skipped if counts else 0,
        strange=counts.strange if counts else 0,
    )


def _check(hearing: Hearing, format: str | None, baud: int, formats: Formats, port: str) -> None:
    best = hearing.best(format)
    if not hearing.n_bytes:
        raise BridgeError(
            f"{port}: silent: see that the device has power, its stream is switched on, and its TX "
            "is wired to RX"
        )
    if format is not None and not hearing.frames(format) and best is not None:
        raise BridgeError(f"{port}: sends {best}, not {format}: use --format {best}")
    if not hearing.frames(format or best or ""):
        raise BridgeError(f"{port}: {why_nothing_fits(hearing, baud, formats)}")


def as_record(t: float, reading: Reading) -> dict[str, Any]:
    """Return a reading as a JSON record, without fields that the device did not report."""
    record: dict[str, Any] = {"kind": kind_of(reading), "t_s": round(t, 6)}
    source = reading.source
    for name in ("device", "boot", "sequence", "ticks"):
        if getattr(source, name) is not None:
            record[name] = getattr(source, name)
    for name, value in zip(reading._fields, reading, strict=True):
        if name != "source" and value is not None:
            record[name] = _plain(value)
    return record


def as_line(t: float, reading: Reading) -> str:
    """Return a reading as a line of a table."""
    record = as_record(t, reading)
    values = [
        f"{name} {_short(value)}"
        for name, value in record.items()
        if name not in ("kind", "t_s", "device", "boot", "ticks")
    ]
    return f"{t:9.3f}  {record['kind']:<9}  {record.get('device', '-'):<6}  {'  '.join(values)}"


def kind_of(reading: Reading) -> str:
    """Return the kind of a reading, such as ``range`` for a `RangeReading`."""
    return type(reading).__name__.removesuffix("Reading").lower()


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _short(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(_short(v) for v in value)
    return f"{value:.3f}" if isinstance(value, float) else str(value)
