"""Parameters of the checks of inertial samples, each with unit, effect and source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.params.checks import check_numbers
from tracking.records import Records, record_of


@dataclass(frozen=True, slots=True, kw_only=True)
class SanityParams:
    """Thresholds of the checks upstream of the orientation filter.

    All are the authors' choice, for the noise of the recorded and simulated sensors.

    References:
        [1] Laidig, Caruso, Cereatti, Seel, BROAD - A benchmark for robust inertial orientation
            estimation, Data 6 (2021) 72.
    """

    stuck_after: float = 20.0
    """[-] Number of readings in a row, equal in all six axes, of a stuck sensor."""
    gyr_jump: float = 10.0
    """[rad/s] Rate change between two samples that no vehicle reaches: hard taps on a sensor reach
    4.2 (BROAD [1], trial 24), crashes of simulated cars 3.9. Larger: more spikes pass."""
    jump_period: float = 0.01
    """[s] Sample period from which on `gyr_jump` grows in proportion to the period."""
    acc_jump: float = 400.0
    """[m/s2] Change of the specific force between two samples that no vehicle reaches."""
    odd_most: float = 3.0
    """[-] Number of odd readings in a row after which readings are used again."""
    chance: float = 1e-5
    """[-] Probability below which a run of equal readings is not attributed to chance."""
    equal_least: float = 0.02
    """[-] Least assumed share of readings that equal their predecessor."""
    equal_most: float = 0.9
    """[-] Largest assumed share of readings that equal their predecessor."""
    equal_memory: float = 500.0
    """[-] Number of readings over which that share is averaged."""
    mean_memory: float = 100.0
    """[-] Number of readings over which the mean of an axis is taken."""
    limit_least: float = 0.5
    """[m/s2] Least distance of a saturation limit from the mean of its axis."""
    held_long: float = 20.0
    """[-] Number of repetitions of an axis, while others change, that counts as saturation."""
    held_change: float = 1.0
    """[m/s2] Change of the other axes that `held_long` requires."""
    whole_after: float = 100.0
    """[-] Number of unsaturated readings in a row before they correct the tilt again."""

    def __post_init__(self) -> None:
        check_numbers(self)

    def as_record(self) -> Records:
        """Return the record for kernels, (1), with the logarithm of `chance`."""
        record = record_of(self)
        record["chance"] = np.log(self.chance)
        return record
