"""What cars' own distance sensors see, as beams evenly round each car."""

from __future__ import annotations

import math

import numpy as np

from hardware_bridge.live.scanner import ScannerMount
from hardware_bridge.readings import ScanReading
from relpos_env.interface.beams import FARTHEST
from tracking.arrays import F64, I64

LASTS = 0.3
"""[s] A measurement counts for so long: a ring is read several times as often."""


class Near:
    """Of the cars of a group. A beam tells what is nearest in its sector."""

    def __init__(self, n_slots: int, n_beams: int) -> None:
        """Begin with nothing measured.

        Args:
            n_slots: Cars.
            n_beams: Round each of them; 0 for none.
        """
        shape = n_slots, n_beams
        self._distance: F64 = np.zeros(shape)
        self._t_ns: I64 = np.full(shape, -(1 << 62), dtype=np.int64)

    def take(self, slot: int, bearing: float, distance: float | None, t_ns: int) -> None:
        """One measurement.

        Args:
            slot: Of the car.
            bearing: [rad] 0 ahead, left is positive.
            distance: [m] None where nothing is.
            t_ns: When it came [ns].
        """
        n_slots, n_beams = self._distance.shape
        if not (n_beams and slot < n_slots and math.isfinite(bearing)):
            return
        beam = round(bearing / (2.0 * math.pi) * n_beams) % n_beams
        seen = FARTHEST if distance is None else min(max(distance, 0.0), FARTHEST)
        is_old = t_ns - self._t_ns[slot, beam] > LASTS * 1e9
        if is_old or seen <= self._distance[slot, beam]:
            self._distance[slot, beam], self._t_ns[slot, beam] = seen, t_ns

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
        fresh = t_ns - self._t_ns <= LASTS * 1e9
        distances: F64 = np.where(fresh, self._distance, 0.0)
        return distances
