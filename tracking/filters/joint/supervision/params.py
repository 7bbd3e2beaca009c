"""Thresholds for faults of ranges, nodes and groups, and for the alignment."""

from __future__ import annotations

from dataclasses import dataclass

from tracking.params.checks import check_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class SupervisionParams:
    """Thresholds of supervision: the authors' choice on simulated runs, if no source is given."""

    nis_gain: float = 0.05
    """[-] Gain per range of a pair's mean NIS and outlier ratio; larger: faster, noisier."""
    group_nis_gain: float = 0.01
    """[-] Gain per range of the group's mean NIS; larger: faster, noisier."""
    residual_gain: float = 0.1
    """[-] Gain per range of a pair's residuals, to follow nodes that drift; larger: noisier."""
    largest_nis: float = 25.0
    """[-] Limit of a range's NIS in the mean NIS, and its value in that of a pair if it is not
    accepted. Larger: outliers count more."""
    outlier_nis: float = 6.0
    """[-] NIS from which on a range is an outlier, one in seventy; larger: fewer are."""
    group_outlier_ratio: float = 0.1
    """[-] No pair of a group is ok above this mean outlier share of its pairs; larger: pairs of a
    group with many outliers stay ok."""
    residual_clip: float = 1.0
    """[m] Limit of a range's deviation in residual statistics; larger: outliers count more."""
    fastest: float = 10.0
    """[m/s] Rate at which ranges change without a jump; larger: fewer jumps are counted."""
    missed_intervals: float = 3.0
    """[-] Mean intervals without a range after which a pair or node is silent; larger: later."""
    interval_gain: float = 0.1
    """[-] Gain per interval of the mean interval between ranges; larger: faster, noisier."""
    longest_interval: float = 5.0
    """[s] Limit of an interval in the mean interval; larger: long gaps raise it more."""
    stale_share: float = 0.5
    """[-] Share of `JointParams.stale_std` squared: above it, variances of all distances of a
    silent node make it join again; at 2 m its direction may err by 20 degrees. Larger: later."""
    outlier_ratio: float = 0.6
    """[-] Outlier ratio above which a node is faulty, if the others fit; larger: fewer are."""
    fault_hysteresis: float = 0.5
    """[-] Share of `JointParams.node_bias_limit` above which a fault lasts; larger: shorter."""
    fault_time: float = 2.0
    """[s] Time without its cause after which a fault ends; larger: it ends later."""
    offset_std: float = 0.7
    """[m] First standard deviation of a faulty node's range offset; larger: it explains more."""
    offset_rate: float = 1.0
    """[m/sqrt(s)] Random walk of a faulty node's range offset; larger: it changes faster."""
    settled_ranges: float = 10.0
    """[-] Ranges of a pair before its residual counts against a position; larger: later."""
    largest_scatter: float = 0.25
    """[m] Scatter of residuals below which a pair counts against a position; larger: more do."""
    far_residual: float = 1.5
    """[m] Residual beyond which a node has diverged, if most of its own are and one is negative:
    obstacles do not shorten a range, calibrations err less. Larger: fewer nodes have."""
    largest_jump: float = 0.25
    """[m] Mean jump below which a residual beyond `far_residual` counts; larger: more do."""
    position_misfit: float = 24.0
    """[-] Loss of a node's position above which another is searched; larger: fewer searches."""
    position_gain: float = 0.25
    """[-] Share of that loss that the other position must stay below; larger: nodes move sooner."""
    frozen_ranges: float = 5.0
    """[-] Repeats of a range that may be chance; recordings that are rounded to a centimetre have
    runs of up to 11 at rest. Larger: frozen ranges are found later."""
    frozen_distance: float = 0.3
    """[m] Distance travelled by both ends that changes any range; larger: found later."""
    frozen_speed: float = 0.1
    """[m/s] Speed up to which a node may be at rest; larger: frozen ranges are found later."""
    survey_nis: float = 6.6
    """[-] NIS above which a survey counts against a hypothesis, one in a hundred; larger: fewer."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentParams:
    """Thresholds for the rotation and reflection of a group."""

    settling: float = 0.5
    """[s] Time after a node's first sample in which accelerations are no motion, as its attitude
    filter converges. Larger: groups start later."""
    orienting: float = 1.5
    """[s] Time after the first sample in which angular rates are no motion; larger: found later."""
    wheels_after: float = 4.0
    """[s] Time after a start on wheels in which likelihoods do not count, as velocities are not
    known yet. Larger: later decisions."""
    rest_time: float = 1.0
    """[s] Rest after the start that ends `wheels_after`; larger: a longer rest is needed."""
    degenerate: float = 2.5
    """[-] Least extent of a layout over its error below which it is degenerate; larger: sooner."""
    regular: float = 4.0
    """[-] Least extent over its error above which it is regular again; larger: later."""
    report_lead: float = 2.0
    """[-] Log-likelihood by which another hypothesis must lead to be reported; larger: later."""
    same_rotation: float = 0.15
    """[rad] Hypotheses that differ by a smaller rotation alone are merged; larger: fewer stay."""
    split_std: float = 0.25
    """[rad] Rotation error above which a hypothesis in the plane is replaced by one for every
    rotation and mirror image. Larger: fewer splits."""
    gauge_std: float = 0.05
    """[rad] Rotation error above which each range checks the null space; larger: cheaper."""
    misfit_time: float = 3.3
    """[s] Time constant of a group's misfit; larger: slower and steadier."""
    challenge_raise: float = 1.5
    """[-] Factor on the limit of the misfit by a challenge in the plane; larger: fewer follow."""
    challenge_time: float = 60.0
    """[s] Time constant of the limit's return to `JointStartParams.respawn_nis`; larger: slower."""
    challenge_position: float = 0.2
    """[m] Position error added by a challenge in the plane; larger: ranges correct it more."""
    challenge_speed: float = 0.5
    """[m/s] Velocity error added by a challenge in the plane; larger: it is corrected more."""
    mode_lead: float = 1.0
    """[-] Log-likelihood by which another mode must lead to be reported; larger: later."""
    challenger_lead: float = 5.0
    """[-] Log-likelihood by which a mode must lead a challenged rotation; larger: fewer succeed."""
    challenge_longest: float = 20.0
    """[s] Time after which a challenge without a likelier mode ends; larger: it ends later."""
    same_mode: float = 0.3
    """[rad] Modes that differ by a smaller rotation are one; no rotation is that near a mirror
    image. Larger: fewer modes."""
    mode_step: float = 0.02
    """[rad] Least rotation of a frame to its mode; larger: coarser, cheaper."""
    mode_std: float = 0.7
    """[rad] Rotation error of every mode below which each has its own filter; larger: sooner."""
    candidate_std: float = 0.15
    """[rad] Rotation error of every mode below which it becomes part of P; larger: sooner."""

    def __post_init__(self) -> None:
        check_numbers(self)
