"""What is heard on a port: readings of its format, and which format the bytes really are."""

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
"""[-] With fewer good frames a format may have been met by chance."""
FITTING = 0.5
"""[-] Share of frames that must be good, and of bytes that must belong to frames."""
ENOUGH_BYTES = 64
"""[bytes] With fewer nothing can be said of the format."""


class Format(Protocol):
    """What must be known of a format, as `hardware_bridge.decoders.DECODERS` has it."""

    @property
    def build(self) -> Callable[[bytes | None], Decoder]:
        """A key, or None, to a decoder."""

    @property
    def baud(self) -> int:
        """[1/s] Of the device as it is usually set."""

    @property
    def request(self) -> bytes:
        """Sent when the port comes up."""

    @property
    def dtr(self) -> bool:
        """The line DTR."""

    @property
    def keyed(self) -> bool:
        """Whether messages may carry a code."""


Formats = Mapping[str, Format]


def known_formats() -> Formats:
    """All formats that can be read."""
    from hardware_bridge.decoders import DECODERS  # type: ignore[attr-defined]

    formats: Formats = DECODERS
    return formats


MOST_SAMPLES = 5000
"""[-] Of an IMU, that are looked at."""


@dataclass(slots=True)
class Voice:
    """One device on a port."""

    readings: int = 0
    imu: int = 0
    samples: list[tuple[float, ...]] = field(default_factory=list)
    """Angular rates and specific forces of the first `MOST_SAMPLES`."""
    ranges: dict[tuple[str | None, str], int] = field(default_factory=dict)
    """How many between which ends; the first is None where it is the speaker."""
    positions: int = 0
    """How often another tracker told of it, alone or in a pair."""
    missing: int = 0
    """Messages that its sequence numbers say were sent and did not arrive."""
    numbered: int = 0
    """Messages that arrived with a sequence number."""
    boots: int = 0
    """How often it started, while it was listened to."""
    last: tuple[int | None, int] | None = None
    """Boot and sequence number of its newest message."""


class Hearing:
    """Takes the bytes of one port; keeps numbers and some inertial samples, no bytes."""

    def __init__(self, formats: Formats, key: bytes | None = None) -> None:
        """Listen with every format.

        Args:
            formats: The formats that are tried.
            key: For those with a code; without it they take messages without one.
        """
        self.decoders: dict[str, Decoder] = {}
        for name, each in formats.items():
            try:
                self.decoders[name] = each.build(key if each.keyed else None)
            except BridgeError:
                continue  # a format that cannot be read without its key is not tried
        self._unchecked = {
            name: each.build(None) for name, each in formats.items() if each.keyed and key
        }
        """Of the formats with a code, without a look at it."""
        self.voices: dict[str, dict[str | None, Voice]] = {name: {} for name in self.decoders}
        """Format to device to what it said; None is a device that does not give its name."""
        self.n_bytes = 0
        self.chunks = 0
        self.longest_gap_ns = 0
        self._last_ns: int | None = None

    @staticmethod
    def get_ready(formats: Formats) -> None:
        """Decode something with every format: what is compiled only then would count as silence."""
        for decoder in Hearing(formats).decoders.values():
            decoder.feed(bytes(256))

    def take(self, chunk: Chunk) -> dict[str, list[Reading]]:
        """Decode with every format; format to readings, where there are any."""
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
        """Whether there are frames that are signed with another key than the one given."""
        return any(
            decoder.counts.frames > 0 and not self.frames(name)
            for name, decoder in self._unchecked.items()
        )

    def silent_until(self, t_ns: int) -> None:
        """Note the silence since the last bytes, at the end too."""
        if self._last_ns is not None:
            self.longest_gap_ns = max(self.longest_gap_ns, t_ns - self._last_ns)

    def frames(self, name: str) -> int:
        """Good frames as `name` reads them."""
        return self.decoders[name].counts.frames if name in self.decoders else 0

    def damaged_share(self, name: str) -> float:
        """Share of frames that were refused [-]; 0 if there were none at all."""
        if name not in self.decoders:
            return 0.0
        counts = self.decoders[name].counts
        return counts.damaged / max(1, counts.frames + counts.damaged)

    def strange_share(self, name: str) -> float:
        """Share of the bytes that belong to no frame [-]."""
        if name not in self.decoders:
            return 1.0
        return min(1.0, self.decoders[name].counts.strange / max(1, self.n_bytes))

    def fit(self, name: str) -> float:
        """How well the bytes are this format [-]: 0 not at all, 1 every frame and every byte."""
        if self.frames(name) < ENOUGH_FRAMES:
            return 0.0
        good = 1.0 - self.damaged_share(name), 1.0 - self.strange_share(name)
        return good[0] * good[1] if min(good) >= FITTING else 0.0

    def best(self, expected: str | None = None) -> str | None:
        """The format that fits best, if one does; of equals `expected`."""
        fitting = [
            (self.fit(name), name == expected, self.frames(name), name)
            for name in self.decoders
            if self.fit(name) > 0.0
        ]
        return max(fitting)[-1] if fitting else None


def why_nothing_fits(hearing: Hearing, baud: int, formats: Formats) -> str:
    """What to do where there are bytes and no frames."""
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
        + ", or the device speaks a format that is not known here"
    )


def _count(voices: dict[str | None, Voice], reading: Reading) -> None:
    source = reading.source
    if isinstance(reading, PairReading | PoseReading):
        names = (reading.i, reading.j) if isinstance(reading, PairReading) else (reading.node,)
        for name in names:
            told = voices.setdefault(name, Voice())
            told.readings += 1
            told.positions += 1
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
        return  # several readings of one message
    if voice.last is None or voice.last[0] != source.boot:
        voice.boots += 1
    else:
        ahead = (source.sequence - voice.last[1]) % (1 << 32)
        if ahead < 1 << 31:  # else it is an old one that came late
            voice.missing += ahead - 1
    voice.last = (source.boot, source.sequence)
    voice.numbered += 1
