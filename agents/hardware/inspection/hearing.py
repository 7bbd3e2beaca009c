"""Statistics of the readings on a port, and detection of the format of its bytes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from hardware_bridge.decoders.base import Decoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import Chunk
from hardware_bridge.readings import (
    ImuReading,
    PairReading,
    PoseReading,
    RangeReading,
    Reading,
    Source,
    StateReading,
)

ENOUGH_FRAMES = 3
"""[-] Fewest good frames that detect a format; fewer may match by chance."""
FITTING = 0.5
"""[-] Smallest share of good frames, and of bytes within frames, of a detected format."""
ENOUGH_BYTES = 64
"""[bytes] Fewest bytes that detect a format."""


class Format(Protocol):
    """Properties of a format, as in `hardware_bridge.decoders.DECODERS`."""

    @property
    def build(self) -> Callable[[bytes | None], Decoder]:
        """Builder of a decoder from a key or None."""

    @property
    def baud(self) -> int:
        """[1/s] Usual baud rate of the device."""

    @property
    def request(self) -> bytes:
        """Bytes to send when the port comes up."""

    @property
    def dtr(self) -> bool:
        """State of the DTR line."""

    @property
    def keyed(self) -> bool:
        """True if messages may be signed."""


Formats = Mapping[str, Format]


def known_formats() -> Formats:
    """Return all formats that can be decoded."""
    from hardware_bridge.decoders import DECODERS  # type: ignore[attr-defined]

    formats: Formats = DECODERS
    return formats


MOST_SAMPLES = 5000
"""[-] Largest number of samples kept per IMU."""


@dataclass(slots=True)
class Voice:
    """Statistics of one device on a port."""

    readings: int = 0
    imu: int = 0
    samples: list[tuple[float, ...]] = field(default_factory=list)
    """Angular rates and specific forces of the first `MOST_SAMPLES` samples."""
    ranges: dict[tuple[str | None, str], int] = field(default_factory=dict)
    """Number of ranges by pair of ends; the first is None if it is the reporting device."""
    positions: int = 0
    """Number of its positions and relative positions from another tracker."""
    missing: int = 0
    """Number of lost messages by sequence number."""
    numbered: int = 0
    """Number of received messages with a sequence number."""
    boots: int = 0
    """Number of boots seen."""
    last: tuple[int | None, int] | None = None
    """Boot and sequence number of its latest message."""


class Hearing:
    """Decoders and statistics of one port; keeps counters and some IMU samples, no bytes."""

    def __init__(self, formats: Formats, key: bytes | None = None) -> None:
        """Build a decoder of every format.

        Args:
            formats: Formats to try.
            key: Key of formats with signed messages; None accepts unsigned messages.
        """
        self.decoders: dict[str, Decoder] = {}
        for name, each in formats.items():
            try:
                self.decoders[name] = each.build(key if each.keyed else None)
            except BridgeError:
                continue  # a format that requires a key is not tried without one
        self._unchecked = {
            name: each.build(None) for name, each in formats.items() if each.keyed and key
        }
        """Decoders of the formats with signed messages that do not verify signatures."""
        self.voices: dict[str, dict[str | None, Voice]] = {name: {} for name in self.decoders}
        """Statistics by format and device; None is a device that sends no id."""
        self.n_bytes = 0
        self.chunks = 0
        self.longest_gap_ns = 0
        self._last_ns: int | None = None

    @staticmethod
    def get_ready(formats: Formats) -> None:
        """Decode dummy bytes with every format, so that compilation does not count as a gap."""
        for decoder in Hearing(formats).decoders.values():
            decoder.feed(bytes(256))

    def take(self, chunk: Chunk) -> dict[str, list[Reading]]:
        """Decode with every format; return the readings by format, without empty lists."""
        self.n_bytes += len(chunk.data)
        self.chunks += 1
        self.silent_until(chunk.t_ns)
        self._last_ns = chunk.t_ns
        found = {}
        for decoder in self._unchecked.values():
            decoder.feed(chunk.data)
        for name, decoder in self.decoders.items():
            readings = decoder.feed(chunk.data)
            if readings:
                found[name] = readings
                for reading in readings:
                    _count(self.voices[name], reading)
        return found

    @property
    def has_another_key(self) -> bool:
        """True if frames are signed with another key than the given one."""
        return any(
            decoder.counts.frames > 0 and not self.frames(name)
            for name, decoder in self._unchecked.items()
        )

    def silent_until(self, t_ns: int) -> None:
        """Update the longest gap with the time since the last bytes [ns]."""
        if self._last_ns is not None:
            self.longest_gap_ns = max(self.longest_gap_ns, t_ns - self._last_ns)

    def frames(self, name: str) -> int:
        """Return the number of good frames in a format."""
        return self.decoders[name].counts.frames if name in self.decoders else 0

    def damaged_share(self, name: str) -> float:
        """Return the share of damaged frames in a format [-]; 0 without frames."""
        if name not in self.decoders:
            return 0.0
        counts = self.decoders[name].counts
        return counts.damaged / max(1, counts.frames + counts.damaged)

    def strange_share(self, name: str) -> float:
        """Return the share of bytes outside of frames in a format [-]."""
        if name not in self.decoders:
            return 1.0
        return min(1.0, self.decoders[name].counts.strange / max(1, self.n_bytes))

    def fit(self, name: str) -> float:
        """Return the match of the bytes with a format [-]: 0 none, 1 every frame and byte."""
        if self.frames(name) < ENOUGH_FRAMES:
            return 0.0
        good = 1.0 - self.damaged_share(name), 1.0 - self.strange_share(name)
        return good[0] * good[1] if min(good) >= FITTING else 0.0

    def best(self, expected: str | None = None) -> str | None:
        """Return the best-matching format, `expected` in case of a tie; None if none fits."""
        fitting = [
            (self.fit(name), name == expected, self.frames(name), name)
            for name in self.decoders
            if self.fit(name) > 0.0
        ]
        return max(fitting)[-1] if fitting else None


def why_nothing_fits(hearing: Hearing, baud: int, formats: Formats) -> str:
    """Return the likely reasons for bytes without frames."""
    if hearing.n_bytes < ENOUGH_BYTES:
        return f"only {hearing.n_bytes} bytes, too few to tell the format: listen longer"
    rates: dict[int, list[str]] = {}
    for name, each in formats.items():
        if each.baud != baud:
            rates.setdefault(each.baud, []).append(name)
    usual = "; ".join(f"{rate} for {', '.join(names)}" for rate, names in sorted(rates.items()))
    if hearing.has_another_key:
        return f"{hearing.n_bytes} bytes that are signed with another key than the one given"
    return (
        f"{hearing.n_bytes} bytes and no frame of any format: the baud rate {baud} seems wrong"
        + (f" (usual are {usual})" if usual else "")
        + ", or the device sends a format that is not known here"
    )


def _count(voices: dict[str | None, Voice], reading: Reading) -> None:
    source = reading.source
    if isinstance(reading, PairReading | PoseReading):
        names = (reading.i, reading.j) if isinstance(reading, PairReading) else (reading.node,)
        for name in names:
            voice = voices.setdefault(name, Voice())
            voice.readings += 1
            voice.positions += 1
        return
    voice = voices.setdefault(source.device, Voice())
    voice.readings += 1
    if isinstance(reading, ImuReading | StateReading):
        voice.imu += 1
        if isinstance(reading, ImuReading) and len(voice.samples) < MOST_SAMPLES:
            voice.samples.append((*reading.gyr, *reading.acc))
    elif isinstance(reading, RangeReading):
        ends = reading.nearer, reading.to
        voice.ranges[ends] = voice.ranges.get(ends, 0) + 1
    _count_sequence(voice, source)


def _count_sequence(voice: Voice, source: Source) -> None:
    if source.sequence is None or voice.last == (source.boot, source.sequence):
        return  # another reading of the same message
    if voice.last is None or voice.last[0] != source.boot:
        voice.boots += 1
    else:
        ahead = (source.sequence - voice.last[1]) % (1 << 32)
        if ahead < 1 << 31:  # otherwise an older message that arrived late
            voice.missing += ahead - 1
    voice.last = (source.boot, source.sequence)
    voice.numbered += 1
