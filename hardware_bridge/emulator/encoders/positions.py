"""Encoder of an external tracker: a JSON line per pair or node."""

from __future__ import annotations

import json
from typing import Any

from hardware_bridge.emulator.encoders.ticks import ticks_on
from hardware_bridge.readings import MICROSECONDS_64, PairReading, PoseReading, Reading
from tracking.estimate import Status


class PositionsEncoder:
    """A computer with the positions of all nodes; the format does not include its own id."""

    def __init__(self, device: str) -> None:
        self._device = device

    def encode(self, readings: list[Reading]) -> bytes:
        """Return a line for every reading of a pair or a node, with all digits."""
        lines = []
        for reading in readings:
            if isinstance(reading, PairReading):
                said = {"i": reading.i, "j": reading.j, **motion(reading)}
                if reading.status is not Status.OK:
                    said["status"] = reading.status.name.lower()
                if reading.nlos:
                    said["nlos"] = reading.nlos
            elif isinstance(reading, PoseReading):
                said = {"node": reading.node, **motion(reading)}
                if reading.q_wb is not None:
                    said["q"] = reading.q_wb
                if reading.speed is not None:
                    said["speed"] = reading.speed
            else:
                continue
            if reading.source.ticks is not None:
                said = {"time": ticks_on(MICROSECONDS_64, reading), **said}
            lines.append(json.dumps(said, separators=(",", ":")) + "\n")
        return "".join(lines).encode()


def motion(reading: PairReading | PoseReading) -> dict[str, Any]:
    """Return the known position, velocity and covariance of a reading."""
    said: dict[str, Any] = {}
    if reading.pos is not None:
        said["pos"] = reading.pos
    if reading.vel is not None:
        said["vel"] = reading.vel
    if reading.cov is not None:
        size = 3 if len(reading.cov) == 9 else 6
        said["cov"] = [reading.cov[at : at + size] for at in range(0, size * size, size)]
    return said
