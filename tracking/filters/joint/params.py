"""Parameters of the joint filter: every number with its unit, its effect and its source."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.errors import ConfigError
from tracking.filters.joint.supervision.params import AlignmentParams, SupervisionParams
from tracking.params.checks import check_numbers
from tracking.vehicles import VEHICLES, VehicleParams


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeErrorParams:
    """LOS range errors: white noise, and lasting parts that decay with the distance travelled."""

    white_std: float = 0.05
    """[m] White noise of a range, the least that is learned; larger: ranges correct less."""
    fast_std: float = 0.03
    """[m] Fast lasting error: multipath that changes in decimetres; larger: ranges correct less."""
    fast_length: float = 0.4
    """[m] Correlation length of the fast error over distance travelled; larger: slower decay."""
    slow_std: float = 0.045
    """[m] Slow lasting error: multipath and antennas, in metres; larger: ranges correct less."""
    slow_length: float = 8.0
    """[m] Correlation length of the slow error in LOS over that distance; larger: slower decay."""
    nonlinearity_gain: float = 1.0
    """[-] Factor on the second-order error of a range, added as noise; it lasts, so it counts more
    than once. Larger: near, uncertain nodes are corrected less."""
    max_pairs: int = 66
    """[-] Pairs up to which lasting errors are states, else white noise; larger: slower."""
    lasting_weight: float = 10.0
    """[-] Factor on the variances of lasting errors without states, which are white noise of the
    same weight over a second of driving. Larger: ranges correct less."""

    def __post_init__(self) -> None:
        check_numbers(self, may_be_zero=("fast_std", "slow_std", "nonlinearity_gain"))


@dataclass(frozen=True, slots=True, kw_only=True)
class NlosParams:
    """NLOS ranges and outliers."""

    los_to_nlos_rate: float = 1.0
    """[1/s] Rate of transitions from LOS to NLOS of a pair; larger: NLOS is more probable."""
    nlos_to_los_rate: float = 3.0
    """[1/s] Rate of transitions from NLOS to LOS of a pair; larger: NLOS is less probable."""
    los_to_nlos_rate_with_power: float = 1.0
    """[1/s] Rate from LOS to NLOS where each range has powers; larger: NLOS is more probable."""
    nlos_to_los_rate_with_power: float = 6.0
    """[1/s] Rate from NLOS to LOS where each range has powers; larger: NLOS is less probable."""
    nlos_bias: float = 0.1
    """[m] Mean bias of a range behind most obstacles; larger: NLOS ranges are shortened more."""
    nlos_bias_std: float = 0.2
    """[m] Standard deviation of `nlos_bias`; larger: NLOS ranges correct less."""
    nlos_large_share: float = 0.0
    """[-] Share of obstacles with a large bias (no powers); larger: more ranges count as NLOS."""
    nlos_bias_large: float = 0.6
    """[m] Mean of a large bias; larger: longer ranges count as NLOS."""
    nlos_bias_large_std: float = 0.5
    """[m] Standard deviation of a large bias; larger: a wider span of ranges counts as NLOS."""
    nlos_bias_length: float = 5.0
    """[m] Correlation length of the bias, over the distance travelled; larger: it lasts longer. Too
    short, it moves the layout where an obstacle lasts; LOS resets the bias anyway."""
    white_std: float = 0.25
    """[m] White noise added to NLOS ranges, whose bias jumps; larger: these ranges correct less."""
    repeats: float = 20.0
    """[-] Successive ranges with one bias, counted as one without states; larger: less weight."""
    power_diff_los: float = 3.0
    """[dB] Mean of received minus first-path power in LOS; larger: NLOS is less probable."""
    power_diff_los_std: float = 1.2
    """[dB] Standard deviation in LOS; larger: a large difference is weaker evidence of NLOS."""
    power_diff_nlos: float = 8.0
    """[dB] Mean of received minus first-path power in NLOS; larger: NLOS is less probable."""
    power_diff_nlos_std: float = 3.0
    """[dB] Standard deviation in NLOS; larger: a small difference is weaker evidence of LOS."""
    power_diff_weight: float = 0.2
    """[-] Weight of a power difference: successive ones are correlated; larger: they count more."""
    power_diff_most: float = 4.0
    """[-] Largest log-likelihood ratio from the powers of a range; larger: they can count more."""
    least_prob: float = 1e-4
    """[-] Bound of the probabilities of NLOS and of LOS; larger: transitions are found sooner."""
    outlier_prob: float = 1e-2
    """[-] Prior probability of an outlier; larger: ranges with large residuals correct less."""
    outlier_span: float = 20.0
    """[m] Width of the outliers' uniform density; larger: fewer ranges are taken for outliers."""

    def __post_init__(self) -> None:
        check_numbers(self, may_be_zero=("nlos_large_share",))
        if not 0.0 <= self.nlos_large_share <= 1.0:
            raise ConfigError(
                f"nlos_large_share: expected a share from 0 to 1, got {self.nlos_large_share}"
            )


NLOS_IN_SPACE = NlosParams(
    los_to_nlos_rate=0.5,
    nlos_to_los_rate=2.0,
    nlos_large_share=0.2,
    nlos_bias_length=10.0,
    white_std=0.2,
)
"""Published sets of ranges in buildings have a bias of 0.23 +- 0.38 m, 17 % beyond 0.5 m; these
values give 0.20 +- 0.35 m and 13 %. Groups in the plane have fewer ranges to spare and would take
wrong calibrations and absurd ranges for such obstacles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointStartParams:
    """Start of a group, join of a node, and the bank of hypotheses."""

    k: int = 8
    """[-] Ranges of a pair in `max_age` that make it ready, the paper's k; larger: later start."""
    max_age: float = 2.0
    """[s] Window of first ranges, and least wait of pairs with fewer; larger: older ones count."""
    min_ranges: float = 3.0
    """[-] Least number of first ranges of a pair with fewer than `k`. The scatter of fewer is
    unknown: one may be absurd. Larger: such pairs start later."""
    rotations_2d: int = 16
    """[-] Rotations tried in the plane, each with its mirror image; larger: finer, slower."""
    rotation_width_2d: float = 2.4
    """[rad] Error of each rotation times `rotations_2d`, 2/5 of the gap; larger: more overlap."""
    rotation_std_3d: float = 0.4
    """[rad] Standard deviation of the first rotation in space; larger: it is corrected more."""
    spare_hypotheses: int = 8
    """[-] Places of the bank in the plane beyond its rotations; larger: more second sides fit."""
    modes_3d: int = 7
    """[-] Places of the bank in space; larger: more modes of the rotation can be followed."""
    first_powers_most: float = 7.0
    """[-] Largest log-likelihood ratio from a pair's first powers; larger: they can count more."""
    position_std: float = 0.25
    """[m] Least standard deviation of a first position; larger: ranges correct it more."""
    speed_std: float = 1.5
    """[m/s] First velocity of a node not at rest, per axis; larger: it is corrected more."""
    short_error: float = 0.12
    """[m] Scale of the errors of too short ranges in multilateration; larger: they count less."""
    long_error: float = 0.3
    """[m] Scale of too long ranges in multilateration (obstacles); larger: they count less."""
    largest_loss: float = 16.0
    """[-] Limit of a range's loss in multilateration, squared scales; larger: outliers pull
    more."""
    far_weight: float = 0.01
    """[-] Factor on the weight of a range at `largest_loss`; larger: outliers pull more."""
    join_spread: float = 0.75
    """[m] RMS extent of the other nodes along an axis up to which the side of a node is open: a
    range error counts several times along it. Larger: more joins on two sides."""
    second_side_loss: float = 9.0
    """[-] Loss up to which a second side is kept, 3 sigma of one range; larger: more are kept."""
    prune: float = 20.0
    """[-] Log-likelihood behind the best that drops a hypothesis; larger: dropped later."""
    merge_distance: float = 0.15
    """[m] Hypotheses that differ by less at every node are merged; larger: fewer are kept."""
    nis_cap: float = 9.0
    """[-] Largest NIS that one measurement adds against a hypothesis; larger: one can decide."""
    check_period: float = 0.1
    """[s] Period of supervision, pruning and alignment; larger: slower reaction, cheaper."""
    respawn_nis: float = 0.8
    """[-] Slow mean NIS of ranges that challenges the alignment: 0.4 if all is well, as ranges
    count less than noise allows, up to 1.0 with less known sensors. Larger: fewer challenges."""
    height_std: float = 1.0
    """[m] Prior spread of the heights of fixed nodes while the rotation is unknown: rooms are wider
    than they are high. Larger: their heights say less about the rotation."""
    challenger_penalty: float = 10.0
    """[-] Log-likelihood deficit at which challenging rotations start; larger: fewer succeed."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class UpdateParams:
    """Updates: linearisation, robust weights, rest; the authors' choice, on simulated runs."""

    largest_bend: float = 0.2
    """[m] Limit of the second-order error of a range; larger: it can lower the weight more."""
    reset_at_once: float = 0.1
    """[-] Probability of an NLOS transition from which on the slow error is reset at once; below
    it, with the next prediction, which costs nothing. Larger: later resets, cheaper."""
    contradiction_share: float = 0.7
    """[-] Share of `JointParams.pair_nis_limit` above which the mean NIS of a pair lowers the
    weight of its ranges (`contradiction_power`). Larger: fewer pairs are affected."""
    contradiction_power: float = 4.0
    """[-] Power of mean NIS over that limit by which the weight is divided; larger: less weight."""
    least_sane: float = 0.5
    """[-] Inlier probability above which a range is accepted, not an outlier; larger: fewer are."""
    least_trust: float = 1e-3
    """[-] Weight up to which a range corrects nothing; larger: more ranges are left out."""
    glide_nis: float = 9.0
    """[-] NIS of the velocity above which a node that looks at rest glides; larger: more ZUPTs."""
    centre_std: float = 1.0
    """[m] Standard deviation of the unobservable centre; relative positions do not depend on it."""
    centre_period: float = 1.0
    """[s] Period with which the centre is moved to the origin; larger: cheaper, more drift."""
    follow_share: float = 0.01
    """[-] Correction over the group's extent that shifts the null space; larger: less often."""
    follow_false: float = 0.05
    """[-] False rotation information over noise that shifts the null space; larger: less often."""
    follow_most: float = 0.3
    """[-] Largest shift of the null space over the group's extent; larger: it follows further."""
    yaw_rate_tau: float = 0.05
    """[s] Low pass of the yaw rate in non-holonomic constraints; larger: smoother, later."""
    rest_tau: float = 0.1
    """[s] Low passes of the rest detector; larger: smoother, later."""
    rest_mean_share: float = 0.25
    """[-] Share of the squared mean acceleration added to its variance: a long push is no rest.
    Larger: less rest is detected."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseLearningParams:
    """Learning of the white noise of ranges (`range_noise`); all are the authors' choice."""

    learns: bool = True
    """[-] True if the white noise of ranges is learned; else that of `RangeErrorParams` holds."""
    white_step: float = 0.01
    """[-] Relative change of the standard deviation by one range; larger: faster, noisier."""
    white_gap: float = 0.3
    """[s] Time between two ranges of a pair below which they are compared; larger: more are."""
    most_learned: float = 5.0
    """[-] Largest factor on the first standard deviation, which is also the least: ranges rounded
    to a decimetre repeat themselves, and err all the same. Larger: noisier ranges are learned."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointParams:
    """Parameters of the joint filter."""

    vehicles: dict[str, VehicleParams] = field(default_factory=lambda: dict(VEHICLES))
    """Vehicles by `NodeConfig.vehicle`."""
    range_error: RangeErrorParams = field(default_factory=RangeErrorParams)
    nlos: NlosParams = field(default_factory=NlosParams)
    """NLOS ranges of groups in the plane."""
    nlos_in_space: NlosParams = NLOS_IN_SPACE
    noise_learning: NoiseLearningParams = field(default_factory=NoiseLearningParams)
    update: UpdateParams = field(default_factory=UpdateParams)
    start: JointStartParams = field(default_factory=JointStartParams)
    alignment: AlignmentParams = field(default_factory=AlignmentParams)
    supervision: SupervisionParams = field(default_factory=SupervisionParams)
    initial_heading_std: float = 0.1
    """[rad] Error of headings from `NodeConfig.initial_heading`; larger: corrected more."""
    initial_heading_tau: float = 300.0
    """[s] Correlation time of the error of initial headings; larger: it lasts longer."""
    unaided_accel_psd: float = 1.5
    """[m/s2/sqrt(Hz)] Acceleration of a node without IMU samples; larger: ranges move it more."""
    attitude_reset_gap: float = 0.5
    """[s] Gap of the IMU after which an orientation counts as new; shorter gaps are filled
    (`OrientationParams.max_gap`). Larger: it goes on over longer gaps."""
    imu_timeout: float = 0.3
    """[s] IMU silence that makes a node unaided; larger: its last acceleration is held longer."""
    blind_after: float = 2.0
    """[s] IMU silence after which a moving node does not tell a layout from its mirror image: pairs
    are `ambiguous` unless more nodes than dimensions do. Larger: they stay `ok` for longer."""
    static_drift: float = 1e-4
    """[m/sqrt(s)] Random walk of static nodes: P stays positive; larger: ranges move them more."""
    survey_std: float = 0.02
    """[m] Standard deviation of a surveyed distance; larger: it corrects less."""
    rest_accel: float = 0.12
    """[m/s2] RMS variation of the acceleration below which a node may rest; larger: more rest."""
    rest_rate: float = 0.06
    """[rad/s] Angular rate below which a node may rest; larger: more rest."""
    rest_after: float = 0.5
    """[s] Time without motion after which a node is at rest; larger: rest is detected later."""
    rest_std: float = 0.02
    """[m/s] Standard deviation of the velocity at rest, per axis; larger: ZUPTs correct less."""
    constraint_period: float = 0.05
    """[s] Period of motion constraints; larger: they correct less, at less cost."""
    range_timeout: float = 0.5
    """[s] Time without a range after which a node joins again if all its distances are less certain
    than 0.7 `stale_std`; above the interval of its ranges. Larger: it coasts longer."""
    lost_after: float = 1.0
    """[s] Least time without an accepted range after which a pair is `lost`; larger: later."""
    node_timeout: float = 5.0
    """[s] Time without a range after which a node has left, its states reset; larger: later."""
    pair_nis_limit: float = 6.0
    """[-] Running mean NIS of its ranges above which a pair is `doubtful`; larger: fewer are."""
    node_bias_limit: float = 0.33
    """[m] Common range error to n nodes, times root n, that is a node's fault; larger: fewer."""
    max_mounts: int = 12
    """[-] Largest group with states for unknown mounts, which are noise in larger ones; larger:
    slower. In groups of ten they are worth up to a tenth of the error, in groups of twenty nothing,
    at a third of the time of a start."""
    stale_std: float = 1.0
    """[m] Distance uncertainty that ends coasting, times 0.7 (`range_timeout`); larger: later."""
    accuracy: float | None = None
    """[m] Accuracy of all pairs in place of `VehicleParams.accuracy`; larger: more are `ok`."""

    def __post_init__(self) -> None:
        check_numbers(self)
