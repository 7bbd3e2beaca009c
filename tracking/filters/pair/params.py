"""What the pair filters believe: every number with its unit, its effect and its source."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.params.checks import check_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class GateParams:
    """The outlier gate: a range against the running average of the past ones.

    A range passes when it differs from the average by less than
    ``floor + speed_gain * |vel_ij| * lag``, where lag is how old the average is.
    """

    tau: float = 0.1
    """[s] Time constant of the running average. Longer is steadier and lags more."""
    floor: float = 0.35
    """[m] What is allowed at rest: about four standard deviations of a range in sight."""
    speed_gain: float = 1.5
    """[-] How much of the motion since the average is allowed for."""
    min_speed: float = 0.5
    """[m/s] Relative speed assumed at least, since the estimate may still be wrong."""
    max_rejected: int = 8
    """[-] So many rejected in a row are believed after all: the average was wrong."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class MdsParams:
    """The refinement over the group."""

    period: float = 0.012
    """[s] Shortest time between two refinements: one ranging round of three nodes."""
    min_spread: float = 0.15
    """[m] A newcomer is placed on both sides of a layout that is flatter than this."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeErrorParams:
    """How a range errs in sight: white noise, and a part that lasts while no node moves."""

    white_std: float = 0.06
    """[m] Of a single range."""
    slow_std: float = 0.045
    """[m] Multipath and antennas: another one metres further."""
    slow_length: float = 1.5
    """[m] Relative way after which it is another. Shorter than it is: what MDS moves, a filter
    does not remember, and its range error would wander off."""
    least_speed: float = 1.0
    """[m/s] Relative speed counted at least. Zero keeps the error of a pair at rest for ever."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class NlosParams:
    """Ranges that are not line of sight, and those that are plainly wrong."""

    los_to_nlos_rate: float = 0.5
    """[1/s] How often a pair loses sight."""
    nlos_to_los_rate: float = 5.0
    """[1/s] How often it regains it."""
    nlos_bias: float = 0.15
    """[m] Mean of what is added to a range behind an obstacle."""
    nlos_bias_std: float = 0.12
    """[m] Its standard deviation."""
    nlos_bias_length: float = 1.5
    """[m] Relative way after which the excess is another."""
    white_std: float = 0.25
    """[m] White noise that is added behind an obstacle: the excess jumps where paths change."""
    power_diff_los: float = 3.0
    """[dB] Received minus first-path power in sight."""
    power_diff_los_std: float = 1.2
    """[dB]"""
    power_diff_nlos: float = 8.0
    """[dB] The same behind an obstacle."""
    power_diff_nlos_std: float = 3.0
    """[dB]"""
    power_diff_weight: float = 0.2
    """[-] Gaps of successive ranges are alike, so that each counts for less than one."""
    power_diff_most: float = 4.0
    """[-] Log-likelihood ratio that the powers of a single range make at most."""
    least_prob: float = 1e-4
    """[-] Neither NLOS nor its contrary is less probable."""
    outlier_prob: float = 1e-2
    """[-] Share of ranges that mean nothing."""
    outlier_span: float = 20.0
    """[m] They lie anywhere in so much."""
    first_prob: float = 0.1
    """[-] Probability that the first ranges of a pair have no line of sight."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelParams:
    """The rear axle of a car does not slide sideways."""

    std: float = 0.15
    """[m/s] Sideways speed of the axle, each time it is used: slip, and a heading that is wrong."""
    period: float = 0.05
    """[s] Time between two uses."""
    jolt_nis: float = 25.0
    """[-] A larger NIS counts less: a jolt, a skid."""
    yaw_rate_tau: float = 0.05
    """[s] Low pass of the yaw rate."""
    group_speed_std: float = 2.0
    """[m/s] Mean velocity of a group before its wheels tell."""
    longest_gap: float = 1.0
    """[s] Accelerations are summed to it over no longer time between two samples."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class StartParams:
    """Starting a group, or a node that joins it, and the bank of hypotheses.

    Ranges give the shape of a group but neither its rotation nor its mirror image. Both are
    tried: the filter starts as a bank of turned and mirrored copies, and motion tells.
    """

    k: int = 8
    """[-] Ranges per pair whose mean starts the shape, the paper's first k measurements."""
    max_age: float = 2.0
    """[s] The first k measurements must come within this time."""
    min_ranges: float = 3.0
    """[-] Minimum number of ranges of a pair that came in a longer time. The scatter of fewer is
    unknown: one may be absurd."""
    rotations_2d: int = 16
    """[-] Rotations tried in the plane, each with its mirror image."""
    prune: float = 40.0
    """[-] A hypothesis so much less likely than the best (log-likelihood) is dropped. Errors
    of real ranges are correlated over a second, so that their evidence counts too much."""
    merge_distance: float = 0.25
    """[m] Two hypotheses as near as this in every pair are one."""
    likelihood_tempering: float = 0.3
    """[-] So much each range counts in the likelihood: errors that last make successive ranges
    say the same thing."""
    nis_cap: float = 6.0
    """[-] A single range counts for at most this in the likelihood, outlier or not."""
    check_period: float = 0.25
    """[s] Time between two looks at the bank."""
    report_lead: float = 2.0
    """[-] Log-likelihood by which another hypothesis has to lead to be reported."""
    degenerate: float = 1.0
    """[-] Extent of a layout across itself, in standard deviations, below which its reflection
    cannot be told."""
    regular: float = 2.0
    """[-] Extent from which on its mirror image becomes a hypothesis again."""
    reflection_nis: float = 3.0
    """[-] So does it where the running mean of NIS is above this."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairEkfParams:
    """One extended Kalman filter per pair."""

    unaided_accel_psd: float = 0.7
    """[m/s2/sqrt(Hz)] White noise of the acceleration of a moving node without IMU samples."""
    imu_timeout: float = 0.3
    """[s] A node whose IMU was silent for so long is unaided."""
    survey_std: float = 0.02
    """[m] Standard deviation of a surveyed distance."""
    lost_after: float = 1.0
    """[s] A pair without an accepted range for so long is lost."""
    missed_intervals: float = 3.0
    """[-] Or without one for this many of its usual intervals, where those are long."""
    node_timeout: float = 5.0
    """[s] A node not heard for so long has left; its filters are destroyed."""
    least_sane: float = 0.5
    """[-] A range that means anything with less probability does not count as one."""
    least_trust: float = 1e-3
    """[-] A range that means anything with less probability corrects nothing."""
    misfit_gain: float = 0.01
    """[-] Weight of a range in the running mean of a group's NIS."""
    largest_nis: float = 25.0
    """[-] A single range moves it by no more."""
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
