"""A recorded run in memory, and the names of its columns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tracking.arrays import Bool
from tracking.constellation import Constellation
from tracking.log.truth import Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.params.short_repr import short_repr

FORMAT = 1
GYR = ("gyr_x", "gyr_y", "gyr_z")
ACC = ("acc_x", "acc_y", "acc_z")
MAG = ("mag_x", "mag_y", "mag_z")
QUAT = ("qw", "qx", "qy", "qz")
POWERS = ("rx_power_dbm", "fp_power_dbm")


@dataclass(frozen=True, slots=True, kw_only=True)
class Log:
    """A recorded run of one group."""

    __repr__ = short_repr

    name: str
    constellation: Constellation
    block: MeasurementBlock
    """All measurements, in order; IMU samples raw."""
    truth: Truth = field(default_factory=Truth.empty)
    nlos: Bool | None = None
    """Recorded label of each RANGE event, in order; for evaluation, not for tracking."""
    source: str = ""
    """Origin of the recording."""
    licence: str = ""
    range_noise: float | None = None
    """[m] Standard deviation of the white noise of its ranges if known; `joint` then does not
    estimate it."""
    accuracy: float | None = None
    """[m] Expected error up to which a pair is ok; None takes that of its vehicles."""
    unused_keys: tuple[str, ...] = ()
    """Keys of its meta.toml that are not read."""
    skipped: dict[str, int] = field(default_factory=dict)
    """Number of bad measurements left out while reading, per file."""

    @property
    def t_range(self) -> tuple[float, float]:
        """Times of the first and last range [s]."""
        t = self.block.t[0][self.block.kind[0] == Kind.RANGE]
        return float(t[0]), float(t[-1])

    @property
    def duration(self) -> float:
        """Time from the first to the last measurement [s]."""
        return float(np.ptp(self.block.t[0]))

    @property
    def n_ranges(self) -> int:
        """Number of UWB ranges, without surveys."""
        return self.block.count(Kind.RANGE)
