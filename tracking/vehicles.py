"""Motion constraints, noise and time constants by vehicle, in one table."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tracking.params.checks import check_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleParams:
    """Motion model and AHRS parameters of nodes on one kind of vehicle."""

    accel_psd: float = 0.1
    """[m/s2/sqrt(Hz)] White noise of the acceleration: sensor, vibration, tilt jitter."""
    bias_std: float = 0.3
    """[m/s2] Horizontal acceleration bias, mostly gravity through a tilt error."""
    bias_tau: float = 30.0
    """[s] Correlation time of the acceleration bias."""
    bias_tau_with_ahrs_feedback: float = 100.0
    """[s] Correlation time of the horizontal acceleration bias of nodes with an offset state in 3D
    whose VQF reports its tilt corrections, which are modelled apart, as is the gyroscope bias."""
    gyro_std: float = 3e-3
    """[rad/s] Initial residual gyroscope bias, unless rest has determined it better."""
    gyro_drift: float = 2e-4
    """[rad/s/sqrt(s)] Random walk of the gyroscope bias, if it has states."""
    vertical_bias_std: float = 0.1
    """[m/s2] Vertical acceleration bias, second-order in a tilt error: mostly the accelerometer
    offset, less the part that is estimated at rest."""
    vertical_bias_tau: float = 100.0
    """[s] Correlation time of the vertical acceleration bias."""
    initial_tilt_speed: float = 0.0
    """[m/s] Speed at which a node may move while its orientation converges. The initial tilt error
    of VQF is the mean acceleration since its first sample, a velocity change over that time."""
    offset_std: float | None = None
    """[m/s2] Accelerometer offset in the body frame, in 3D: a state of its own for bodies that turn
    about all axes, since it turns with them, unlike the bias. None for no such state."""
    offset_tau: float = 1000.0
    """[s] Correlation time of the accelerometer offset."""
    levelled: bool = False
    """The body stays level: the acceleration is taken in the plane of the body, free of tilt
    errors, and its bias rotates with the body."""
    heading_std: float = 0.05
    """[rad] Error of a magnetic heading, which changes with place and time."""
    heading_tau: float = 8.0
    """[s] Correlation time of the heading error."""
    first_heading_std: float | None = None
    """[rad] Initial heading error, until the group or a joining node has moved: at rest, local
    disturbances of the field do not average out. None for `heading_std`."""
    speed_std: float = 2.0
    """[m/s] Standard deviation of the group's mean velocity; bounds drift without a reference."""
    sideways_std: float | None = None
    """[m/s] Sideways speed of the rear axle, 20 times a second; None if it may move sideways."""
    ahead: float = 0.0
    """[m] Expected distance of the tracker ahead of that axle, if `Mount.ahead` is unknown."""
    ahead_std: float = 0.0
    """[m] Standard deviation of `ahead`."""
    slip: float = 0.0
    """[s2/m] Expected `Mount.slip` if unknown; none is as likely as that of soft tyres."""
    slip_std: float = 0.0
    """[s2/m] Standard deviation of `slip`."""
    impact_threshold: float | None = None
    """[m/s2] Acceleration of an impact, which stops the vehicle within a sample or two that may be
    saturated at 8 or 16 g. None for vehicles whose motion consists of impacts."""
    impact_noise_ratio: float = 0.25
    """[-] Velocity error added by such a sample, as a ratio of its velocity increment."""
    accuracy: float = 0.5
    """[m] A pair is OK while its expected RMS position error over all directions is at most this;
    the larger value of the two vehicles is used."""
    protection: float = 13.0
    """[-] Ratio of the protection radius of an OK pair to its expected error; the larger value of
    both vehicles is used. Fewer than 1 of 1000 OK samples of simulated runs exceed the radius."""
    rests: bool = True
    """The vehicle rests at times, and its IMU detects the rest."""
    propagation_period: float = 0.02
    """[s] Period of covariance propagation of a group with such a node. Ranges in between use the
    older state, without the process noise since."""

    ahrs_accel_tau: float | None = None
    """[s] Time constant of VQF's accelerometer; None for `OrientationParams.tau_acc`. Longer trusts
    the gyroscope more: the sideways acceleration of a car or robot in a curve lasts for seconds and
    would be taken for tilt, and be missing from the acceleration."""
    ahrs_accel_tau_with_bias: float | None = None
    """[s] `ahrs_accel_tau` for filters with acceleration bias states; None for no difference."""
    pair_accel_psd: float = 0.15
    """[m/s2/sqrt(Hz)] White noise of the acceleration for filters without bias states: sensor,
    vibration and tilt error."""

    def __post_init__(self) -> None:
        check_numbers(
            self, may_be_zero=("ahead", "ahead_std", "slip", "slip_std", "initial_tilt_speed")
        )


_TURNED = VehicleParams(
    accel_psd=0.05, initial_tilt_speed=1.0, offset_std=0.2, ahrs_accel_tau_with_bias=10.0
)
"""Vehicles that rotate about all axes; their tilt depends on the estimated gyroscope bias."""
VEHICLES = {
    "car": VehicleParams(
        ahrs_accel_tau=30.0,
        pair_accel_psd=0.07,
        accel_psd=0.045,
        bias_std=0.05,
        bias_tau=100.0,
        levelled=True,
        heading_std=0.03,
        heading_tau=5.0,
        first_heading_std=0.1,
        sideways_std=0.08,
        accuracy=0.3,
        protection=6.0,
        ahead=0.15,
        ahead_std=0.15,
        slip=0.01,
        slip_std=0.02,
        impact_threshold=70.0,
        propagation_period=0.05,
    ),
    "robot": VehicleParams(
        protection=5.0,
        accel_psd=0.07,
        bias_std=0.1,
        bias_tau=30.0,
        levelled=True,
        ahrs_accel_tau=30.0,
        pair_accel_psd=0.07,
    ),
    # Limbs have larger slow errors, but a filter that may estimate them also makes them up.
    "human": VehicleParams(
        protection=5.0,
        accel_psd=0.1,
        bias_std=0.03,
        bias_tau=5.0,
        vertical_bias_std=0.03,
        vertical_bias_tau=5.0,
        heading_std=0.02,
        heading_tau=30.0,
    ),
    "hand": replace(_TURNED, pair_accel_psd=0.25, protection=8.0),
    "drone": replace(_TURNED, accel_psd=0.1, speed_std=10.0, rests=False),
    "none": replace(_TURNED, accel_psd=0.1, speed_std=10.0, rests=False),
}
"""Parameters by `NodeConfig.vehicle`."""
