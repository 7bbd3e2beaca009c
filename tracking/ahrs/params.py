"""Parameters of the orientation stage, each with unit, effect and source.

References:
    [1] Laidig, Seel, VQF, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tracking.params.checks import check_numbers
from tracking.sanity.params import SanityParams

VQF_TAU_ACC = 3.0
"""[s] Time constant of VQF's accelerometer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RestParams:
    """Rest detection of a sensor; the values are those of [1] sec. 3.4, except `rate`."""

    tau: float = 0.5
    """[s] Time constant of the low passes that readings are compared with."""
    after: float = 1.5
    """[s] Time for which readings must stay near their low passes."""
    rate: float = math.radians(4.0)
    """[rad/s] Largest deviation of the gyroscope. Noise peaks of `isas_walk1`, 0.5 to 0.8 deg/s per
    axis, exceed VQF's 2 deg/s, so that its bias would never be estimated."""
    accel: float = 0.5
    """[m/s2] Largest deviation of the accelerometer."""
    largest_bias: float = math.radians(2.0)
    """[rad/s] Largest gyroscope bias; a larger steady rate is a rotation."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasParams:
    """Estimation of the gyroscope bias; the values are those of [1] sec. 3.5."""

    start_std: float = math.radians(0.5)
    """[rad/s] Standard deviation before any measurement."""
    drift_std: float = math.radians(0.1)
    """[rad/s] Drift in `drift_time`."""
    drift_time: float = 100.0
    """[s] Time of the drift `drift_std`."""
    motion_std: float = math.radians(0.1)
    """[rad/s] Steady-state standard deviation in motion, at VQF's `tau_acc`. Motion shows the bias
    by tilt corrections, which are delayed by that time constant. An estimate that follows them as
    fast regardless oscillates, by tilts of 5 to 10 degrees at 30 s: so the variance of the measured
    bias is proportional to the square of the time constant."""
    rest_std: float = math.radians(0.03)
    """[rad/s] Steady-state standard deviation at rest."""
    vertical_share: float = 1e-4
    """[-] Ratio of the variance in motion to that about the vertical, which motion hides."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticParams:
    """Detection of disturbed magnetic fields; the values are those of [1] sec. 3.6."""

    tau: float = 0.05
    """[s] Time constant of the low pass of norm and dip."""
    reference_tau: float = 20.0
    """[s] Time constant with which the reference field follows."""
    norm_change: float = 0.1
    """[-] Largest relative difference of an undisturbed field's norm."""
    dip_change: float = math.radians(10.0)
    """[rad] Largest difference of an undisturbed field's dip."""
    new_after: float = 20.0
    """[s] Turning time in a new field after which it is accepted."""
    first_after: float = 5.0
    """[s] Turning time in the first field after which it is accepted."""
    least_turn: float = math.radians(20.0)
    """[rad/s] Least rate that counts as turning."""
    undisturbed_after: float = 0.5
    """[s] Time for which a field must match the reference before it is used again."""
    longest_rejection: float = 60.0
    """[s] Longest time for which a disturbed field is rejected."""
    rejection_factor: float = 2.0
    """[-] Divides the heading gain in a field that stays disturbed; undisturbed time makes up for
    rejected time by this factor."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class OrientationParams:
    """Parameters of the orientation stage."""

    tau_acc: float = VQF_TAU_ACC
    """[s] Time constant of VQF's accelerometer. Longer trusts the gyroscope more. VQF default."""
    tau_mag: float = 9.0
    """[s] Time constant of VQF's magnetometer. VQF default."""
    bias: BiasParams = field(default_factory=BiasParams)
    """Estimation of the gyroscope bias."""
    rest: RestParams = field(default_factory=RestParams)
    """Rest detection of a sensor."""
    magnetic: MagneticParams = field(default_factory=MagneticParams)
    """Detection of disturbed magnetic fields."""
    max_gap: float = 0.5
    """[s] Longest gap that is filled by interpolated samples, over which the gyroscope is
    integrated. After a longer one the orientation is initialised again with a magnetometer; without
    one it is kept."""
    lost_after: float = 1.5
    """[-] Factor on a sensor's period above which samples between two others are lost."""
    stamp_gain: float = 0.05
    """[-] Share of a stamp's deviation from steady sampling by which the gyroscope's integration
    time follows it: jitter is smoothed over 20 samples."""
    gravity_tau: float = 0.5
    """[s] Time constant with which a node at rest estimates gravity as its own accelerometer reads
    it, which removes the vertical part of its offset."""
    settling: float = 1.5
    """[s] Time for which an orientation that starts in motion is not used; its heading is averaged
    from then on: the first tilts follow single accelerations, and headings depend on tilts. Limbs
    that jump start up to 180 deg off and are within 3 deg after 1.5 s."""
    settling_accel: float = 3.0
    """[m/s2] Deviation of a specific force's norm from gravity that counts as a start in motion:
    taken for gravity, such a force tilts by up to 17 deg and more."""
    sanity: SanityParams = field(default_factory=SanityParams)
    """Thresholds of doubtful samples."""
    doubtful_psd: float = 1.5
    """[m/s2/sqrt(Hz)] Added noise of an acceleration that is saturated or replaces a spike: that of
    a node without an IMU. Such a reading is nearer to the acceleration than none."""

    def __post_init__(self) -> None:
        check_numbers(self)
