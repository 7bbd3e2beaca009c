"""Figures of `relpos bench codec`."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from agents.bench.codec.peer_pymavlink import CHUNK, Mavlink
from agents.bench.codec.workload import KEY, OTHERS, Stream, imu, mixture, ranges
from agents.bench.env.turns import best_of_turns
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.readings import Reading
from hardware_bridge.wire.encoder import RelposEncoder

Row = dict[str, Any]
TURNS = 7


def bench_codec(
    *, frames: int = 5000, progress: Callable[[float], None] | None = None
) -> list[Row]:
    """Measure decoding and encoding in frames per second.

    Args:
        frames: Number of frames per turn.
        progress: Called with the share done, 0 to 1.

    Raises:
        UsageError: pymavlink is not installed.
    """
    peer = Mavlink(frames)
    streams = {
        name: Stream([kind(k) for k in range(frames)], key=key)
        for name, kind, key in (
            ("IMU", imu, None),
            ("IMU, MAC", imu, KEY),
            (f"ranges to {OTHERS}", ranges, None),
            ("mixed", mixture, None),
            ("mixed, MAC", mixture, KEY),
        )
    }
    jobs: list[tuple[str, Callable[[], Any], Callable[[], Any]]] = []
    for name, stream in streams.items():
        jobs.append((f"decode to arrays, {name}", stream.decode, peer.decode))
    for name, stream in streams.items():
        jobs.append((f"decode to readings, {name}", _reader(stream), peer.decode))
    for name, stream in streams.items():
        jobs.append((f"encode arrays, {name}", stream.encode, peer.encode))
    sample = streams["IMU"]
    jobs.append(("encode readings, IMU", _writer(sample), peer.encode))
    rows: list[Row] = []
    for case, ours, theirs in jobs:
        best = best_of_turns([_turn(ours), _turn(theirs)], TURNS)
        rows.append(_row(case, peer.name, *(frames / seconds for seconds in best)))
        if progress is not None:
            progress(len(rows) / len(jobs))
    return rows


def _reader(stream: Stream) -> Callable[[], None]:
    """Return a function that decodes the bytes in chunks, as from a port."""
    data = stream.data.tobytes()
    chunks = [data[at : at + CHUNK] for at in range(0, len(data), CHUNK)]

    def read() -> None:
        decoder = RelposDecoder(stream.key)
        for chunk in chunks:
            decoder.feed(chunk)
        if decoder.counts.frames != stream.n:
            raise AssertionError("the decoder gives fewer frames than went in")

    return read


def _writer(stream: Stream) -> Callable[[], bytes]:
    readings: list[Reading] = RelposDecoder().feed(stream.data.tobytes())

    def write() -> bytes:
        return RelposEncoder(3, 1).encode(readings)

    return write


def _turn(call: Callable[[], Any]) -> Callable[[], float]:
    """Return a function that measures the time of a call [s]."""

    def turn() -> float:
        began = time.perf_counter()
        call()
        return time.perf_counter() - began

    return turn


def _row(case: str, peer: str, value: float, peer_value: float) -> Row:
    return {
        "bench": "codec",
        "case": case,
        "value": value,
        "unit": "frames/s",
        "peer": peer,
        "peer_value": peer_value,
        "ratio": value / peer_value,
    }
