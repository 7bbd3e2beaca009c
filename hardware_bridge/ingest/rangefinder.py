"""What cars' own distance sensors see, as beams evenly round each car."""

from __future__ import annotations

import math

import numpy as np

from hardware_bridge.ingest.scanner import ScannerMount
from hardware_bridge.readings import ScanReading
from relpos_env.interface.beams import FARTHEST
from tracking.arrays import F64, I64

LASTS, N_SPANS = 0.3, 6
"""[s, -] Time that a measurement counts, and number of spans that it is divided into. All spans but
one last longer than a turn of a slow scanner."""
SPAN_NS = round(LASTS * 1e9) // N_SPANS


class Near:
    """Of the cars of a group. A beam tells what is nearest in its sector."""

    def __init__(self, n_slots: int, n_beams: int) -> None:
        """Begin with nothing measured.

        Args:
            n_slots: Cars.
            n_beams: Round each of them; 0 for none.
        """
        shape = n_slots, n_beams, N_SPANS
        self._distance: F64 = np.zeros(shape)
        """Nearest of a span of time, the spans a ring [m]."""
        self._span: I64 = np.full(shape, -N_SPANS, dtype=np.int64)
        """Which span that was."""

    def take(self, slot: int, bearing: float, distance: float | None, t_ns: int) -> None:
        """One measurement.

        Args:
            slot: Of the car.
            bearing: [rad] 0 ahead, left is positive.
            distance: [m] None where nothing is.
            t_ns: When it came [ns].
        """
        n_slots, n_beams, _ = self._distance.shape
        if not (n_beams and slot < n_slots and math.isfinite(bearing)):
            return
        beam = round(bearing / (2.0 * math.pi) * n_beams) % n_beams
        seen = FARTHEST if distance is None else min(max(distance, 0.0), FARTHEST)
        span = t_ns // SPAN_NS
        at = slot, beam, span % N_SPANS
        if span != self._span[at] or seen < self._distance[at]:
            self._distance[at], self._span[at] = seen, span

    def take_scan(
        self, slot: int, reading: ScanReading, mount: ScannerMount | None, t_ns: int
    ) -> None:
        """What a scanner measured; a direction without a distance tells nothing."""
        if reading.distance is None or mount is None:
            return
        seen = mount.seen(reading.bearing, reading.distance)
        if seen is not None:
            self.take(slot, *seen, t_ns)

    def beams(self, t_ns: int) -> F64:
        """Distances now, (slot, beam) [m]; 0, a touch, where nothing was measured of late."""
        fresh = self._span > t_ns // SPAN_NS - N_SPANS
        nearest = np.where(fresh, self._distance, np.inf).min(axis=-1)
        distances: F64 = np.where(np.isfinite(nearest), nearest, 0.0)
        return distances
