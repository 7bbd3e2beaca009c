"""Parameters of the joint filter: every number with its unit, its effect and its source."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.errors import ConfigError
from tracking.filters.joint.supervision.params import AlignmentParams, SupervisionParams
from tracking.params.checks import check_numbers
from tracking.vehicles import VEHICLES, VehicleParams


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeErrorParams:
    """How a range errs in sight: white noise, and parts that stay while no node moves."""

    white_std: float = 0.05
    """[m] Of a single range."""
    fast_std: float = 0.03
    """[m] Multipath that changes within decimetres."""
    fast_length: float = 0.4
    """[m] Way of both ends after which it is another."""
    slow_std: float = 0.045
    """[m] Multipath and antennas, changing within metres."""
    slow_length: float = 8.0
    """[m]"""
    nonlinearity_gain: float = 1.0
    """[-] Trust lost where the filter is uncertain across a short line of sight, in units of the
    second-order error there. That error lasts, so it weighs more than once."""
    max_pairs: int = 28
    """[-] Larger groups have no states for these errors: their ranges count as worse and white."""
    lasting_weight: float = 10.0
    """[-] Factor on the variances of these errors there, as white noise of the same weight over
    a second of driving."""

    def __post_init__(self) -> None:
        check_numbers(self, may_be_zero=("fast_std", "slow_std", "nonlinearity_gain"))


@dataclass(frozen=True, slots=True, kw_only=True)
class NlosParams:
    """Ranges that are not line of sight, and those that are plainly wrong."""

    los_to_nlos_rate: float = 1.0
    """[1/s] How often a pair loses sight."""
    nlos_to_los_rate: float = 3.0
    """[1/s] How often it regains it."""
    los_to_nlos_rate_with_power: float = 1.0
    """[1/s] The same where powers are reported: each range measures the line of sight."""
    nlos_to_los_rate_with_power: float = 6.0
    """[1/s] The same where powers are reported."""
    nlos_bias: float = 0.1
    """[m] Mean of what most obstacles add to a range."""
    nlos_bias_std: float = 0.2
    """[m] Its standard deviation."""
    nlos_large_share: float = 0.0
    """[-] Share of obstacles that add much more."""
    nlos_large_share_with_power: float = 0.0
    """[-] The same where powers are reported."""
    nlos_bias_large: float = 0.6
    """[m] What they add, in the mean."""
    nlos_bias_large_std: float = 0.5
    """[m] Its standard deviation."""
    nlos_bias_length: float = 5.0
    """[m] Distance travelled by both ends after which the excess is another. Too short a length
    moves the layout where an obstacle lasts; the excess of one that passes is forgotten anyway when
    the line of sight is back."""
    white_std: float = 0.25
    """[m] White noise that is added behind an obstacle: the excess jumps where paths change."""
    repeats: float = 20.0
    """[-] Number of ranges in a row with the same excess: together they count as one."""
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

    def __post_init__(self) -> None:
        check_numbers(self, may_be_zero=("nlos_large_share", "nlos_large_share_with_power"))
        for name in ("nlos_large_share", "nlos_large_share_with_power"):
            share = getattr(self, name)
            if not 0.0 <= share <= 1.0:
                raise ConfigError(f"{name}: expected a share from 0 to 1, got {share}")


NLOS_IN_PLANE = NlosParams(
    los_to_nlos_rate=0.2, nlos_to_los_rate=1.0, nlos_large_share=0.3, nlos_bias_length=10.0
)
"""Without powers, small excesses are not told from other range errors: what counts are obstacles
that stay for a second and may add half a metre."""
NLOS_IN_SPACE = NlosParams(
    los_to_nlos_rate=0.5,
    nlos_to_los_rate=2.0,
    nlos_large_share=0.2,
    nlos_large_share_with_power=0.2,
    nlos_bias_length=10.0,
    white_std=0.2,
)
"""Published sets of ranges in buildings have an excess of 0.23 +- 0.38 m, 17 % beyond 0.5 m; these
numbers make it 0.20 +- 0.35 m and 13 %. Groups in the plane, with fewer ranges to spare, would take
wrong calibrations and absurd ranges for such obstacles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointStartParams:
    """Starting a group, or a node that joins it, and the bank of hypotheses."""

    k: int = 8
    """[-] Ranges per pair whose mean starts the shape, the paper's first k measurements."""
    max_age: float = 2.0
    """[s] The first k measurements must come within this time."""
    min_ranges: float = 3.0
    """[-] Minimum number of ranges of a pair that came in a longer time. The scatter of fewer is
    unknown: one may be absurd."""
    rotations_2d: int = 16
    """[-] Rotations tried in the plane, each with its mirror image."""
    rotation_width_2d: float = 2.4
    """[rad] Uncertainty of each of them, times their number: two fifths of the gap between two."""
    rotation_std_3d: float = 0.4
    """[rad] The same of a first rotation in space."""
    spare_hypotheses: int = 8
    """[-] Room in the plane for more hypotheses than rotations: two sides of newcomers."""
    modes_3d: int = 9
    """[-] Room for modes of the rotation of a group in space."""
    first_powers_most: float = 7.0
    """[-] Log-likelihood ratio that the powers of a pair's first ranges make at most."""
    position_std: float = 0.25
    """[m] Error of a node in the first shape."""
    speed_std: float = 1.5
    """[m/s] Of a node that was not seen at rest."""
    short_error: float = 0.12
    """[m] Scale of the errors of ranges that are too short, in the search for a node's position."""
    long_error: float = 0.3
    """[m] The same of ranges that are too long: obstacles lengthen them."""
    largest_loss: float = 16.0
    """[-] A single range says no more than this against a position, in squares of these scales."""
    far_weight: float = 0.01
    """[-] How much such a range still pulls."""
    join_spread: float = 0.75
    """[m] Others that extend less than this along an axis leave the side of a node open: along it,
    an error of a range counts several times."""
    second_side_loss: float = 9.0
    """[-] A second side that ranges say so much more against is none: three standard deviations of
    a single one."""
    prune: float = 20.0
    """[-] A hypothesis so much less likely than the best (log-likelihood) is dropped."""
    merge_distance: float = 0.15
    """[m] Two hypotheses as near as this in every pair are one."""
    nis_cap: float = 9.0
    """[-] A single measurement counts for at most this in the likelihood."""
    check_period: float = 0.1
    """[s] Time between two looks at the bank."""
    respawn_nis: float = 0.8
    """[-] Slow mean of the NIS of ranges from which on it is doubted how the layout is turned. It
    is 0.4 where all is well, as a range counts less than its noise alone would allow, and up
    to 1.0 in recordings of sensors that are known less well."""
    height_std: float = 1.0
    """[m] How much fixed nodes differ in height from each other, where nothing tells how the group
    is turned: people put them into rooms, which are wider than they are high."""
    challenger_penalty: float = 10.0
    """[-] Log-likelihood by which other rotations have to make up for being looked at so late."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class UpdateParams:
    """How a measurement corrects: linearisation, robust weights, what is at rest.

    All are the authors' choice, on simulated runs.
    """

    largest_bend: float = 0.2
    """[m] The error of linearisation counts for at most this."""
    reset_at_once: float = 0.1
    """[-] A sight that may have changed with a smaller probability is forgotten with the next
    prediction, which costs nothing."""
    contradiction_share: float = 0.7
    """[-] A pair whose mean NIS is above this share of `JointParams.pair_nis_limit` counts
    less (`contradiction_power`)."""
    contradiction_power: float = 4.0
    """[-] Power of the ratio of the two by which such a pair counts less."""
    least_sane: float = 0.5
    """[-] A range that means anything with less probability is refused."""
    least_trust: float = 1e-3
    """[-] A range that is trusted less corrects nothing."""
    glide_nis: float = 9.0
    """[-] A node that looks at rest, but whose velocity is known with this NIS, glides."""
    centre_std: float = 1.0
    """[m] Uncertainty of the centre of the group, which nothing measures."""
    centre_period: float = 1.0
    """[s] Time between two moves of the centre to the origin."""
    follow_share: float = 0.01
    """[-] The covariance follows the positions once measurements have moved them by this share of
    the extent of the group."""
    follow_false: float = 0.05
    """[-] Or once a range sees an uncertain rotation by this share of its noise."""
    follow_most: float = 0.3
    """[-] It follows by at most this share of the extent at once."""
    yaw_rate_tau: float = 0.05
    """[s] Low pass of the yaw rate of a vehicle that cannot move sideways."""
    rest_tau: float = 0.1
    """[s] Low passes of the rest detection."""
    rest_mean_share: float = 0.25
    """[-] Share of the squared mean acceleration that counts as variation there: a long push is no
    rest."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseLearningParams:
    """How the white noise of ranges is learned (`range_noise`); all are the authors' choice."""

    learns: bool = True
    """[-] Whether the white noise of ranges is learned; otherwise it stays that of
    `RangeErrorParams`."""
    white_step: float = 0.01
    """[-] Share by which a range moves the standard deviation."""
    white_gap: float = 0.3
    """[s] Two ranges of a pair are compared if they follow each other within this time."""
    most_learned: float = 5.0
    """[-] It becomes no larger than by this factor, and no smaller than at first: ranges that are
    rounded to a decimetre repeat themselves, and err all the same."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointParams:
    """One filter over all nodes."""

    vehicles: dict[str, VehicleParams] = field(default_factory=lambda: dict(VEHICLES))
    """By `NodeConfig.vehicle`."""
    range_error: RangeErrorParams = field(default_factory=RangeErrorParams)
    nlos: NlosParams = NLOS_IN_PLANE
    """In the plane."""
    nlos_in_space: NlosParams = NLOS_IN_SPACE
    noise_learning: NoiseLearningParams = field(default_factory=NoiseLearningParams)
    update: UpdateParams = field(default_factory=UpdateParams)
    start: JointStartParams = field(default_factory=JointStartParams)
    alignment: AlignmentParams = field(default_factory=AlignmentParams)
    supervision: SupervisionParams = field(default_factory=SupervisionParams)
    initial_heading_std: float = 0.1
    """[rad] Error of headings that start from `NodeConfig.initial_heading`."""
    initial_heading_tau: float = 300.0
    """[s] How long they keep it."""
    unaided_accel_psd: float = 1.5
    """[m/s2/sqrt(Hz)] Acceleration of a moving node without samples of its IMU."""
    attitude_reset_gap: float = 0.5
    """[s] After a longer silence of its IMU the orientation of a node is a new one: shorter gaps
    are filled (`OrientationParams.max_gap`)."""
    imu_timeout: float = 0.3
    """[s] A node whose IMU was silent for so long is unaided."""
    static_drift: float = 1e-4
    """[m/sqrt(s)] Static nodes may creep so much: keeps the covariance positive for ever."""
    survey_std: float = 0.02
    """[m] Standard deviation of a surveyed distance."""
    rest_accel: float = 0.12
    """[m/s2] A node whose acceleration varies less than this, and does not turn, may rest."""
    rest_rate: float = 0.06
    """[rad/s] A node that turns faster does not rest."""
    rest_after: float = 0.5
    """[s] It must have done so for so long."""
    rest_std: float = 0.02
    """[m/s] Speed of a node at rest."""
    constraint_period: float = 0.05
    """[s] Time between two uses of what is known about the vehicles."""
    range_timeout: float = 0.5
    """[s] A node without a range for so long joins again, if its distances to all others are less
    certain than 0.7 `stale_std` by now. More than the time between two ranges of a node."""
    lost_after: float = 1.0
    """[s] A pair without a range for so long is lost."""
    node_timeout: float = 5.0
    """[s] A node without a range for so long has left; its states are forgotten."""
    pair_nis_limit: float = 6.0
    """[-] A pair whose ranges misfit so badly, as a running mean of NIS, is doubtful."""
    node_bias_limit: float = 0.33
    """[m] A node all of whose ranges err by so much, over the root of their number, is doubted."""
    max_mounts: int = 12
    """[-] Larger groups have no states for where trackers sit on cars: it counts as noise. In
    groups of ten they are worth up to a tenth of the error, in groups of twenty nothing, at a third
    of the time of a start."""
    stale_std: float = 1.0
    """[m] Of positions of nodes that were silent, see `range_timeout`."""
    accuracy: float | None = None
    """[m] That of all pairs, in place of `VehicleParams.accuracy`."""

    def __post_init__(self) -> None:
        check_numbers(self)
