"""Measurements of the cars' own distance sensors, as sensors evenly spaced around each car."""

from __future__ import annotations

import math

import numpy as np

from hardware_bridge.ingest.scanner import ScannerMount
from hardware_bridge.readings import ScanReading
from relpos_env.interface.rangefinders import FARTHEST
from tracking.arrays import F64, I64

LASTS, N_SPANS = 0.3, 6
"""[s, -] Validity of a measurement, and number of spans that it is divided into. All spans but one
together are longer than a revolution of a slow scanner."""
SPAN_NS = round(LASTS * 1e9) // N_SPANS


class Near:
    """Distance sensors of a group of cars. A sensor measures the nearest distance in its sector."""

    def __init__(self, n_slots: int, n_rangefinders: int) -> None:
        """Create sensors without measurements.

        Args:
            n_slots: Number of cars.
            n_rangefinders: Number of distance sensors around each car; 0 for none.
        """
        shape = n_slots, n_rangefinders, N_SPANS
        self._distance: F64 = np.zeros(shape)
        """[m] Nearest distance per time span, (slot, sensor, span); the spans are a ring buffer."""
        self._span: I64 = np.full(shape, -N_SPANS, dtype=np.int64)
        """[-] Number of the time span of each entry of `_distance`."""

    def take(self, slot: int, bearing: float, distance: float | None, t_ns: int) -> None:
        """Store one measurement.

        Args:
            slot: Slot of the car.
            bearing: Direction [rad], 0 ahead, left is positive.
            distance: Distance [m]; None if there is no object.
            t_ns: Arrival [ns].
        """
        n_slots, n_rangefinders, _ = self._distance.shape
        if not (n_rangefinders and slot < n_slots and math.isfinite(bearing)):
            return
        sensor = round(bearing / (2.0 * math.pi) * n_rangefinders) % n_rangefinders
        seen = FARTHEST if distance is None else min(max(distance, 0.0), FARTHEST)
        span = t_ns // SPAN_NS
        at = slot, sensor, span % N_SPANS
        if span != self._span[at] or seen < self._distance[at]:
            self._distance[at], self._span[at] = seen, span

    def take_scan(
        self, slot: int, reading: ScanReading, mount: ScannerMount | None, t_ns: int
    ) -> None:
        """Store a measurement of a scanner; one without a distance carries no information."""
        if reading.distance is None or mount is None:
            return
        seen = mount.seen(reading.bearing, reading.distance)
        if seen is not None:
            self.take(slot, *seen, t_ns)

    def distances(self, t_ns: int) -> F64:
        """Return the distances at `t_ns`, (slot, sensor) [m]; 0 without a recent one, a contact."""
        fresh = self._span > t_ns // SPAN_NS - N_SPANS
        nearest = np.where(fresh, self._distance, np.inf).min(axis=-1)
        distances: F64 = np.where(np.isfinite(nearest), nearest, 0.0)
        return distances
