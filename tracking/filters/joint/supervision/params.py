"""What decides that ranges, nodes or the whole group are wrong, and what is done then."""

from __future__ import annotations

from dataclasses import dataclass

from tracking.params.checks import check_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class SupervisionParams:
    """Thresholds of the joint filter's supervision.

    All are the authors' choice, on simulated runs, where no other source is given.
    """

    nis_gain: float = 0.05
    """[-] Weight of a range in the running means of a pair's NIS and outliers."""
    group_nis_gain: float = 0.01
    """[-] The same in that of all pairs."""
    residual_gain: float = 0.1
    """[-] The same of its residuals, which have to follow those who drift away."""
    largest_nis: float = 25.0
    """[-] A single range moves the mean NIS by no more; one that means nothing counts as this."""
    outlier_nis: float = 6.0
    """[-] A range with a larger NIS does not fit, one in seventy."""
    surprise_limit: float = 1.2
    """[-] Nothing of a group is ok while the mean surprise of its ranges over `misfit_time` is
    larger; 0.5 is that of white noise alone."""
    residual_clip: float = 1.0
    """[m] A single range moves these means by no more."""
    fastest: float = 10.0
    """[m/s] Ranges that change faster jump."""
    missed_intervals: float = 3.0
    """[-] Mean intervals without a range after which a pair or a node is silent."""
    interval_gain: float = 0.1
    """[-] Weight of an interval in its running mean."""
    longest_interval: float = 5.0
    """[s] A longer one counts as this."""
    stale_share: float = 0.5
    """[-] Share of `JointParams.stale_std` squared, from which on a node that was silent starts
    again: the line of sight at 2 m may be off by 20 degrees."""
    outlier_ratio: float = 0.6
    """[-] A node of whose ranges a larger share does not fit is faulty, if the others fit."""
    fault_hysteresis: float = 0.5
    """[-] A fault lasts while its residual is above this share of its limit."""
    fault_time: float = 2.0
    """[s] And for so long after that."""
    offset_std: float = 0.7
    """[m] Standard deviation of the range offset that a faulty node may have at first."""
    offset_rate: float = 1.0
    """[m/sqrt(s)] Process noise of that offset."""
    settled_ranges: float = 10.0
    """[-] Ranges of a pair before its mean residual counts against a node's position."""
    largest_scatter: float = 0.25
    """[m] A pair whose residuals scatter more says nothing of it."""
    far_residual: float = 1.5
    """[m] A node most of whose residuals are larger, some of them negative, is somewhere else: no
    obstacle shortens a range, and no calibration by so much."""
    largest_jump: float = 0.25
    """[m] Such ranges change faster than `fastest` by less."""
    position_misfit: float = 24.0
    """[-] Sum of a node's misfits from which on another position is looked for."""
    position_gain: float = 0.25
    """[-] The other position has to bring the sum below this share."""
    frozen_ranges: float = 5.0
    """[-] Equal ranges after the first that may be chance; recordings that are rounded to a
    centimetre have runs of up to 11 at rest."""
    frozen_distance: float = 0.3
    """[m] Distance that both ends travel, over which a range cannot stay the same."""
    frozen_speed: float = 0.1
    """[m/s] A slower node may be at rest."""
    survey_nis: float = 6.6
    """[-] A surveyed distance counts against a hypothesis above this NIS, one in a hundred."""

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentParams:
    """Thresholds for the rotation and reflection of a group."""

    settling: float = 0.5
    """[s] The first samples of a node look like motion: its orientation is still being found."""
    orienting: float = 1.5
    """[s] Rotation means nothing for so long."""
    wheels_after: float = 4.0
    """[s] After a start in motion wheels do not count against a rotation for so long: velocities
    are not known yet."""
    stood_for: float = 1.0
    """[s] Unless the group has been at rest for so long."""
    degenerate: float = 2.5
    """[-] Least extent of a layout, in standard deviations, below which it is degenerate."""
    regular: float = 4.0
    """[-] Least extent above which it is no longer degenerate."""
    report_lead: float = 2.0
    """[-] Log-likelihood by which another hypothesis has to lead to be reported."""
    same_rotation: float = 0.15
    """[rad] Hypotheses that differ by a smaller rotation of the group alone are one."""
    split_std: float = 0.25
    """[rad] A hypothesis in the plane whose rotation is less certain is replaced by one for every
    rotation and mirror image."""
    gauge_std: float = 0.05
    """[rad] While the rotation is less certain, the null space is kept at every range."""
    misfit_time: float = 3.3
    """[s] Time constant of a group's misfit, on which the alignment is challenged."""
    challenge_raise: float = 1.5
    """[-] Factor on the misfit that begins another challenge after the first."""
    challenge_time: float = 60.0
    """[s] Time constant with which that limit returns to `JointStartParams.respawn_nis`."""
    challenge_position: float = 0.2
    """[m] Added standard deviation of positions on a challenge in the plane."""
    challenge_speed: float = 0.5
    """[m/s] Of velocities."""
    mode_lead: float = 1.0
    """[-] Log-likelihood by which another mode has to lead to be reported."""
    challenger_lead: float = 5.0
    """[-] The same where a rotation was known and is challenged."""
    challenge_longest: float = 20.0
    """[s] A challenge ends after so long without a likelier mode."""
    same_mode: float = 0.3
    """[rad] Modes that differ by a smaller rotation are one; no rotation is that near a mirror
    image."""
    mode_step: float = 0.02
    """[rad] The frame is turned to its mode by no smaller a step."""
    mode_std: float = 0.7
    """[rad] Each mode is filtered by itself once it is known so well."""
    candidate_std: float = 0.15
    """[rad] Its rotation goes into the covariance once it is known so well."""

    def __post_init__(self) -> None:
        check_numbers(self)
