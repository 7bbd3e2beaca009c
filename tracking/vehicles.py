"""Vehicles: motion constraints, noise and time constants by what carries a node, in one table."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tracking.params.checks import check_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleParams:
    """What is known about a node from the vehicle that carries it."""

    accel_psd: float = 0.1
    """[m/s2/sqrt(Hz)] White noise of the acceleration: sensor, vibration, tilt jitter."""
    bias_std: float = 0.3
    """[m/s2] Slow error of the acceleration, mostly gravity seen through a wrong tilt."""
    bias_tau: float = 30.0
    """[s] How long it stays the same."""
    bias_tau_with_ahrs_feedback: float = 100.0
    """[s] The same in space, with an offset, where VQF reports how its orientation is turned
    upright: what is left of it, and what the gyroscope makes it lean by has states of its own."""
    gyro_std: float = 3e-3
    """[rad/s] Residual bias of the gyroscope at first, unless it is known better from rest."""
    gyro_drift: float = 2e-4
    """[rad/s/sqrt(s)] How fast the bias of the gyroscope changes, where it has states."""
    vertical_bias_std: float = 0.1
    """[m/s2] The same along the vertical, where a wrong tilt shows by its square only: the offset
    of the accelerometer, less what is learned of it at rest."""
    vertical_bias_tau: float = 100.0
    """[s] How long that stays the same."""
    initial_tilt_speed: float = 0.0
    """[m/s] How fast it may move while its orientation is still being found. The tilt of VQF is
    at first off by the mean acceleration since its first sample, which over a time t is a change
    of velocity over t."""
    offset_std: float | None = None
    """[m/s2] Offset of the accelerometer in the body, in space: a state of its own where the body
    is turned about, since it turns with it, which `bias_std` does not. None for none."""
    offset_tau: float = 1000.0
    """[s] How long that stays the same."""
    levelled: bool = False
    """The body stays level: the acceleration is taken in the plane of the body, free of tilt
    errors, and its slow error turns with the body."""
    heading_std: float = 0.05
    """[rad] Error of a magnetic heading that changes with place and time."""
    heading_tau: float = 8.0
    """[s] How long it stays the same."""
    first_heading_std: float | None = None
    """[rad] The same at first, and until the group has moved: what bends the field where it stands
    is not averaged yet. Also of one that joins and has not driven. None for no more than later."""
    speed_std: float = 2.0
    """[m/s] Speed of the group as a whole; keeps a group without any reference from drifting."""
    sideways_std: float | None = None
    """[m/s] Sideways speed of the rear axle, 20 times a second; None for what may move sideways."""
    ahead: float = 0.0
    """[m] How far the tracker is expected ahead of that axle, where `Mount.ahead` is unknown."""
    ahead_std: float = 0.0
    """[m] Standard deviation of that."""
    slip: float = 0.0
    """[s2/m] `Mount.slip` where it is unknown: none is as likely as that of soft tyres."""
    slip_std: float = 0.0
    """[s2/m] Standard deviation of that."""
    impact_threshold: float | None = None
    """[m/s2] More is a blow: what carries it runs into something and stops within a sample or two,
    that may have been cut off at the end of the scale, 8 or 16 g. None for what moves by blows."""
    impact_noise_ratio: float = 0.25
    """[-] Error of what such a sample adds to the velocity, in terms of that."""
    accuracy: float = 0.5
    """[m] A pair is OK while the position error that it expects, as a root mean square over all
    directions, is at most this; of two vehicles the larger."""
    protection: float = 13.0
    """[-] Protection radius of an OK pair over its expected error; of two vehicles the larger. It
    was set so that fewer than 1 of 1000 OK samples of simulated runs are off by more."""
    rests: bool = True
    """It stands still now and then, and its IMU shows it."""
    propagation_period: float = 0.02
    """[s] The covariance of a group with such a node is carried forward so often; ranges in between
    do with its older state, without the noise of the time since."""

    ahrs_accel_tau: float | None = None
    """[s] Time constant of VQF's accelerometer; None is that of `OrientationParams.tau_acc`. Longer
    trusts the gyroscope more. What accelerates sideways for seconds in every curve, as cars and
    robots do, would pass for tilted, so that the acceleration lacks it."""
    ahrs_accel_tau_with_bias: float | None = None
    """[s] The same for filters with states for slow errors of accelerations; None is as without."""
    pair_accel_psd: float = 0.15
    """[m/s2/sqrt(Hz)] White noise of the acceleration for filters without such states: sensor,
    vibration and the slow error of a wrong tilt."""

    def __post_init__(self) -> None:
        check_numbers(
            self, may_be_zero=("ahead", "ahead_std", "slip", "slip_std", "initial_tilt_speed")
        )


_TURNED = VehicleParams(
    accel_psd=0.05, initial_tilt_speed=1.0, offset_std=0.2, ahrs_accel_tau_with_bias=10.0
)
"""What turns about all its axes: its tilt is as good as what is known of the gyroscope's bias."""
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
    # Limbs: larger slow errors are measured, but a filter that may move them also makes them up.
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
"""By `NodeConfig.vehicle`."""
