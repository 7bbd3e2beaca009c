"""Encoder of a WitMotion IMU: a burst of frames per sample."""

from __future__ import annotations

from hardware_bridge.decoders.witmotion import (
    ACC,
    ACC_UNIT,
    FRAME,
    GYR,
    GYR_UNIT,
    MAG,
    MAG_UNIT,
    START,
)
from hardware_bridge.readings import ImuReading, Reading, Vector

TEMPERATURE = 2500
"""[0.01 degC] Reported temperature."""


class WitMotionEncoder:
    """A sensor; the format does not include its own id."""

    def __init__(self, device: str) -> None:
        self._device = device

    def encode(self, readings: list[Reading]) -> bytes:
        """Return accelerometer, gyroscope and, if present, magnetometer of each sample."""
        return b"".join(burst(r) for r in readings if isinstance(r, ImuReading))


def burst(reading: ImuReading) -> bytes:
    """Return the frames of one sample."""
    frames = frame(ACC, reading.acc, ACC_UNIT) + frame(GYR, reading.gyr, GYR_UNIT)
    return frames if reading.mag is None else frames + frame(MAG, reading.mag, MAG_UNIT)


def frame(kind: int, vector: Vector, unit: float) -> bytes:
    """Return the frame of one quantity, clipped to the range of the format."""
    counts = (min(max(round(value / unit), -32768), 32767) for value in vector)
    body = FRAME.pack(START, kind, *counts, TEMPERATURE, 0)[:-1]
    return body + bytes((sum(body) & 0xFF,))
