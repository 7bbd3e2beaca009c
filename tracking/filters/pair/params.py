"""Parameters of the pair filters: every number with its unit, its effect and its source."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.params.checks import check_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class GateParams:
    """The outlier gate, which compares a range with the running average of accepted ranges.

    A range passes if it differs from the average by at most ``floor + speed_gain * max(|vel_ij|,
    min_speed) * lag``, where lag is `tau` plus the time since the last accepted range.
    """

    tau: float = 0.1
    """[s] Time constant of the running average. Longer is steadier and lags more."""
    floor: float = 0.35
    """[m] Constant part of the allowed difference, about four standard deviations of LOS ranges."""
    speed_gain: float = 1.5
    """[-] Factor on the motion since the average (speed times lag) in the allowed difference."""
    min_speed: float = 0.5
    """[m/s] Least relative speed that is assumed, since the estimate may still be wrong."""
    max_rejected: int = 8
    """[-] Number of ranges in a row outside the gate, the last of which restarts the average."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class MdsParams:
    """The MDS refinement over the group."""

    period: float = 0.012
    """[s] Shortest time between refinements: one ranging round of three nodes, more in large
    groups."""
    min_spread: float = 0.15
    """[m] Least RMS extent of a layout up to which a joining node is placed on both sides of it."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeErrorParams:
    """Errors of LOS ranges: white noise, and a slow error that changes with distance travelled."""

    white_std: float = 0.06
    """[m] Standard deviation of the white noise of a range."""
    slow_std: float = 0.045
    """[m] Standard deviation of the slow error, from multipath and antennas."""
    slow_length: float = 1.5
    """[m] Correlation length of the slow error over the relative distance travelled. It is below
    the true one: the covariance ignores MDS feedback, so the error would drift."""
    least_speed: float = 1.0
    """[m/s] Speed added in quadrature to the relative speed: the slow error decays at rest too."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class NlosParams:
    """NLOS ranges and outliers."""

    los_to_nlos_rate: float = 0.5
    """[1/s] Rate of transitions of a pair from LOS to NLOS."""
    nlos_to_los_rate: float = 5.0
    """[1/s] Rate of transitions of a pair from NLOS to LOS."""
    nlos_bias: float = 0.15
    """[m] Mean bias of an NLOS range."""
    nlos_bias_std: float = 0.12
    """[m] Standard deviation of the NLOS bias."""
    nlos_bias_length: float = 1.5
    """[m] Correlation length of the NLOS bias over the relative distance travelled."""
    white_std: float = 0.25
    """[m] Standard deviation of added white noise in NLOS: the bias jumps where paths change."""
    power_diff_los: float = 3.0
    """[dB] Expected received minus first-path power in LOS."""
    power_diff_los_std: float = 1.2
    """[dB] Standard deviation of the power difference in LOS."""
    power_diff_nlos: float = 8.0
    """[dB] Expected received minus first-path power in NLOS."""
    power_diff_nlos_std: float = 3.0
    """[dB] Standard deviation of the power difference in NLOS."""
    power_diff_weight: float = 0.2
    """[-] Weight of a power difference, below one since those of successive ranges are similar."""
    power_diff_most: float = 4.0
    """[-] Largest log-likelihood ratio, of either sign, from the powers of a single range."""
    least_prob: float = 1e-4
    """[-] Least probability of NLOS and of LOS."""
    outlier_prob: float = 1e-2
    """[-] Share of ranges that are outliers."""
    outlier_span: float = 20.0
    """[m] Width of the uniform distribution of outliers."""
    first_prob: float = 0.1
    """[-] NLOS probability of a pair when its filter starts."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelParams:
    """The non-holonomic constraint: the rear axle of a car does not slide sideways."""

    std: float = 0.15
    """[m/s] Standard deviation of the sideways speed of the axle: slip and heading errors."""
    period: float = 0.05
    """[s] Shortest time between two updates with the constraint."""
    jolt_nis: float = 25.0
    """[-] NIS above which an update loses weight, as in a jolt or a skid."""
    yaw_rate_tau: float = 0.05
    """[s] Time constant of the low-pass filter of the yaw rate."""
    group_speed_std: float = 2.0
    """[m/s] Initial and largest standard deviation per axis of the mean velocity of a group."""
    longest_gap: float = 1.0
    """[s] Longest interval over which an acceleration is integrated to the mean velocity."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class StartParams:
    """The start of a group, of a node that joins it, and the bank of hypotheses.

    Ranges determine the shape of a group up to a rotation and a reflection. The filter starts as
    a bank of rotated and reflected copies, which motion distinguishes.
    """

    k: int = 8
    """[-] Number of ranges with which a pair can start, the paper's first k measurements."""
    max_age: float = 2.0
    """[s] The first k measurements must come within this time."""
    min_ranges: float = 3.0
    """[-] Minimum number of ranges of a pair that came in a longer time. The scatter of fewer is
    unknown: one may be an outlier."""
    rotations_2d: int = 16
    """[-] Rotations tried in the plane, each with its mirror image."""
    prune: float = 40.0
    """[-] A hypothesis whose log-likelihood is lower than the best by more than this is dropped.
    Errors of real ranges are correlated over a second, which overstates their evidence."""
    merge_distance: float = 0.25
    """[m] Two hypotheses are merged if no pair differs by more than this, velocities over 1 s."""
    likelihood_tempering: float = 0.3
    """[-] Factor on the log-likelihood of a range: errors of successive ranges are correlated."""
    nis_cap: float = 6.0
    """[-] Largest NIS with which a single measurement enters the likelihood, outlier or not."""
    check_period: float = 0.25
    """[s] Shortest time between two checks of the bank."""
    report_lead: float = 2.0
    """[-] Log-likelihood by which another hypothesis has to lead to be reported."""
    degenerate: float = 1.0
    """[-] Extent of a layout along its shortest axis, in standard deviations, below which its
    reflection is not observable."""
    regular: float = 2.0
    """[-] Extent above which a layout that was degenerate gets its mirror image as a hypothesis."""
    reflection_nis: float = 3.0
    """[-] Mean NIS above which a layout of extent `regular` or more gets its mirror image."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairEkfParams:
    """Parameters of the filter with one extended Kalman filter per pair."""

    unaided_accel_psd: float = 0.7
    """[m/s2/sqrt(Hz)] White noise of the acceleration of a moving node without IMU samples."""
    imu_timeout: float = 0.3
    """[s] Age of the last IMU sample beyond which a node is unaided."""
    survey_std: float = 0.02
    """[m] Standard deviation of a surveyed distance."""
    lost_after: float = 1.0
    """[s] Age of the last accepted range beyond which a pair is LOST."""
    missed_intervals: float = 3.0
    """[-] Number of mean ranging intervals of a pair that replaces `lost_after` if it is longer."""
    node_timeout: float = 5.0
    """[s] Age of the last range beyond which a node has left and its filters are destroyed."""
    least_sane: float = 0.5
    """[-] Inlier probability of a range up to which it does not reset the age of its pair."""
    least_trust: float = 1e-3
    """[-] Inlier probability of a range up to which it does not correct the filter."""
    misfit_gain: float = 0.01
    """[-] Weight of a range in the running mean of a group's NIS."""
    largest_nis: float = 25.0
    """[-] Largest NIS with which a single range enters the mean NIS of a group."""
    interval_gain: float = 0.1
    """[-] Weight of an interval between two ranges of a pair in its running mean."""
    gate: GateParams = field(default_factory=GateParams)
    mds: MdsParams = field(default_factory=MdsParams)
    range_error: RangeErrorParams = field(default_factory=RangeErrorParams)
    nlos: NlosParams = field(default_factory=NlosParams)
    wheels: WheelParams = field(default_factory=WheelParams)
    start: StartParams = field(default_factory=StartParams)

    def __post_init__(self) -> None:
        check_numbers(self)
