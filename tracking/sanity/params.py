"""What makes an inertial sample doubtful: every number with its unit, its effect and its source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.params.checks import check_numbers
from tracking.records import Records, record_of


@dataclass(frozen=True, slots=True, kw_only=True)
class SanityParams:
    """Thresholds of the checks before the orientation filter.

    All are the authors' choice, on the noise of the recorded and simulated sensors.
    """

    stuck_after: float = 20.0
    """[-] Readings in a row that are equal in all six axes; noise makes two of them rare."""
    gyr_jump: float = 25.0
    """[rad/s] A change between two samples that no vehicle makes."""
    acc_jump: float = 400.0
    """[m/s2] The same of the specific force."""
    odd_most: float = 3.0
    """[-] Odd readings in a row after which they are used after all."""
    chance: float = 1e-5
    """[-] A run of equal readings is chance as long as it is more likely than this."""
    equal_least: float = 0.02
    """[-] Least share of readings that are equal to the one before, however few came."""
    equal_most: float = 0.9
    """[-] Largest such share."""
    equal_memory: float = 500.0
    """[-] Readings over which that share is taken."""
    mean_memory: float = 100.0
    """[-] Readings over which the mean of an axis is taken."""
    limit_least: float = 0.5
    """[m/s2] The limit of an axis is at least so far from its mean."""
    held_long: float = 20.0
    """[-] An axis that repeats itself so often while others change is saturated."""
    held_change: float = 1.0
    """[m/s2] By so much others have to change."""
    whole_after: float = 100.0
    """[-] Readings in a row within the scale before they tell the tilt again."""

    def __post_init__(self) -> None:
        check_numbers(self)

    def as_record(self) -> Records:
        """For kernels, (1); `chance` is its logarithm."""
        record = record_of(self)
        record["chance"] = np.log(self.chance)
        return record
