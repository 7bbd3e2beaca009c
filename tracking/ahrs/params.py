"""Parameters of the orientation stage: every number with its unit, its effect and its source.

References:
    [1] Laidig, Seel, VQF, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tracking.params.checks import check_numbers
from tracking.sanity.params import SanityParams

VQF_TAU_ACC = 3.0
"""[s] VQF's accelerometer time constant."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RestParams:
    """When a sensor lies still; the values are those of [1] sec. 3.4, but for `rate`."""

    tau: float = 0.5
    """[s] Time constant of the low passes that readings are compared with."""
    after: float = 1.5
    """[s] So long the readings must stay near their low passes."""
    rate: float = math.radians(4.0)
    """[rad/s] How near, of the gyroscope. VQF's 2 deg/s are passed by the noise alone of
    `isas_walk1`, 0.5 to 0.8 deg/s along each axis, so that its bias was never learned."""
    accel: float = 0.5
    """[m/s2] How near, of the accelerometer."""
    largest_bias: float = math.radians(2.0)
    """[rad/s] A steady rate above this is no bias of a gyroscope: something turns."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasParams:
    """How the bias of a gyroscope is learned; the values are those of [1] sec. 3.5."""

    start_std: float = math.radians(0.5)
    """[rad/s] Standard deviation before any measurement."""
    drift_std: float = math.radians(0.1)
    """[rad/s] Drift in `drift_time`."""
    drift_time: float = 100.0
    """[s] Time over which `drift_std` is stated."""
    motion_std: float = math.radians(0.1)
    """[rad/s] Standard deviation in the long run in motion, at VQF's `tau_acc`. What tells it are
    corrections of the tilt, which come later the longer that time constant is. What follows them
    as fast all the same swings, by tilts of 5 to 10 degrees at 30 s: so the variance of what they
    tell is in proportion to the square of the time constant."""
    rest_std: float = math.radians(0.03)
    """[rad/s] The same at rest."""
    vertical_share: float = 1e-4
    """[-] Share of what is forgotten about the vertical, which motion does not tell."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticParams:
    """When a magnetic field is disturbed; the values are those of [1] sec. 3.6."""

    tau: float = 0.05
    """[s] Low pass of length and dip."""
    reference_tau: float = 20.0
    """[s] Time constant with which what is known of the field follows."""
    norm_change: float = 0.1
    """[-] Relative difference in length of a field that is not disturbed."""
    dip_change: float = math.radians(10.0)
    """[rad] The same of the dip."""
    new_after: float = 20.0
    """[s] A new field is accepted after so much turning."""
    first_after: float = 5.0
    """[s] The first one."""
    least_turn: float = math.radians(20.0)
    """[rad/s] What counts as turning."""
    undisturbed_after: float = 0.5
    """[s] So long the field must be as known before it is believed again."""
    longest_rejection: float = 60.0
    """[s] So long a disturbed field is left out."""
    rejection_factor: float = 2.0
    """[-] How much slower the heading follows a field that stays disturbed, and how much faster
    undisturbed time makes up for disturbed time."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class OrientationParams:
    """What the orientation stage believes."""

    tau_acc: float = VQF_TAU_ACC
    """[s] VQF's accelerometer time constant. Longer trusts the gyroscope more. VQF default."""
    tau_mag: float = 9.0
    """[s] VQF's magnetometer time constant. VQF default."""
    bias: BiasParams = field(default_factory=BiasParams)
    """How the bias of a gyroscope is learned."""
    rest: RestParams = field(default_factory=RestParams)
    """When a sensor lies still."""
    magnetic: MagneticParams = field(default_factory=MagneticParams)
    """When a magnetic field is disturbed."""
    max_gap: float = 0.5
    """[s] Missing samples up to here are filled by interpolation, so that the gyroscope is
    integrated over them. After a longer silence the orientation is initialised again, where there
    is a magnetometer; elsewhere it goes on from where it was."""
    lost_after: float = 1.5
    """[-] Factor on the period of a sensor: samples further apart have lost some between."""
    stamp_gain: float = 0.05
    """[-] Share of the difference between a sample's stamp and that of a steady sensor by which the
    integration of the gyroscope follows it: jitter is smoothed over 20 samples."""
    gravity_tau: float = 0.5
    """[s] Time constant with which a node at rest learns the length of gravity that its own
    accelerometer reads, which removes the vertical part of its offset."""
    settling: float = 1.5
    """[s] An orientation that starts in motion is not used for so long, and its heading is averaged
    from then on: the first tilts follow single accelerations, and headings are measured with them.
    Limbs that jump start up to 180 deg off and are within 3 deg after 1.5 s."""
    settling_accel: float = 3.0
    """[m/s2] It starts in motion if the length of a specific force differs by more from gravity:
    taken for gravity, such a force tilts by up to 17 deg and more."""
    sanity: SanityParams = field(default_factory=SanityParams)
    """Which samples are doubtful."""
    doubtful_psd: float = 1.5
    """[m/s2/sqrt(Hz)] Added noise of an acceleration that is saturated or stands in for a spike:
    that of a node without an IMU. Such a reading is nearer to the acceleration than none."""

    def __post_init__(self) -> None:
        check_numbers(self)
