"""What is kept of every node, pair and group, as records, so that kernels get few arguments."""

from __future__ import annotations

import numpy as np

NODE = np.dtype(
    [
        ("t_pre", "f8"),  # time up to which the inertial samples are summed [s]
        ("t_state", "f8"),  # time of the last STATE event [s]
        ("t_last_range", "f8"),  # time of the last range it took part in [s]
        ("interval", "f8"),  # running mean of the time between two of these [s]
        ("antenna", "i8"),  # with which
        ("cos_yaw", "f8"),  # of the last STATE event, as measured
        ("sin_yaw", "f8"),
        ("yaw_rate", "f8"),  # [rad/s]
        ("accel_mean", "f8"),  # running mean of |accel| [m/s2]
        ("accel_var", "f8"),  # running mean square of accel about its mean [m2/s4]
        ("turning", "f8"),  # running mean of the angular rate [rad/s]
        ("t_first", "f8"),  # its first sample, or the first after a long silence [s]
        ("t_oriented", "f8"),  # since when its orientation goes on without a break [s]
        ("has_ahrs_feedback", "?"),  # VQF reports its corrections
        ("tilt_correction0", "f8"),  # by how much so far, about x and y [rad]
        ("tilt_correction1", "f8"),
        ("gyro0", "f8"),  # what is taken for the bias of its gyroscope [rad/s]
        ("gyro1", "f8"),
        ("gyro2", "f8"),
        ("gyro_var", "f8"),  # its variance [(rad/s)^2]
        ("t_moved", "f8"),  # last time it was not at rest [s]
        ("t_accelerated", "f8"),  # last time its acceleration showed it [s]
        ("accel_noise", "f8"),  # added noise density of its last sample [m/s2/sqrt(Hz)]
        ("fault", "i8"),  # see `faults.Fault`
        ("t_fault", "f8"),  # when its statistic was last beyond the limit [s]
        ("has_state", "?"),
        ("seen", "?"),
        ("present", "?"),
        ("static", "?"),  # constant from here on
        ("levelled", "?"),
        ("rests", "?"),
        ("psd2", "f8"),
        ("impact_threshold", "f8"),  # infinite for what moves by blows
        ("impact_noise_ratio", "f8"),
        ("bias_var", "f8"),
        ("bias_tau", "f8"),
        ("bias_tau_with_ahrs_feedback", "f8"),
        ("first_gyro_var", "f8"),
        ("gyro_drift2", "f8"),
        ("by_gyroscope", "?"),  # its heading is what its gyroscope adds to the first
        ("vertical_bias_var", "f8"),
        ("vertical_bias_tau", "f8"),
        ("initial_tilt_speed2", "f8"),
        ("offset_var", "f8"),
        ("offset_tau", "f8"),
        ("heading_var", "f8"),
        ("heading_tau", "f8"),
        ("first_heading_var", "f8"),
        ("speed_var", "f8"),
        ("sideways_var", "f8"),  # 0 for what may move sideways
        ("ahead", "f8"),  # of its mount: mean and variance of what is not known
        ("ahead_var", "f8"),
        ("slip", "f8"),
        ("slip_var", "f8"),
        ("aside", "f8"),
        ("accuracy", "f8"),  # 0 of static nodes [m]
        ("i_pos", "i8"),  # first state of its position
        ("i_vel", "i8"),  # of its velocity; -1 for static nodes, like the next two
        ("i_tilt_bias", "i8"),
        ("i_acc_bias", "i8"),  # of the offset of its accelerometer; -1 for none
        ("i_heading", "i8"),
        ("i_gyro_bias", "i8"),  # of what the bias of its gyroscope is off; -1 for none
        ("i_mount", "i8"),  # of its mount, `ahead` and `slip`; -1 where both are known
    ]
)
PAIR = np.dtype(
    [
        ("t_range", "f8"),  # time of the last range [s]
        ("t_used", "f8"),  # time of the last range that counted [s]
        ("interval", "f8"),  # running mean of the time between two ranges [s]
        ("nis", "f8"),  # NIS of the last range in the best hypothesis [-]
        ("mean_nis", "f8"),  # running mean of it, ranges that mean nothing with the largest [-]
        ("outlier_ratio", "f8"),  # running share of ranges that do not fit [-]
        ("last_range", "f8"),  # its last range as reported [m]
        ("t_last", "f8"),  # when it came [s]
        ("n_equal", "i8"),  # ranges before it that were equal
        ("distance_travelled", "f8"),  # what both ends travelled meanwhile [m]
        ("mean_residual", "f8"),  # running mean of innovations, none more than 1 m from it [m]
        ("mean_abs_residual", "f8"),  # running mean of their distance from it [m]
        ("last_used", "f8"),  # its last range that was used [m]
        ("rate_violation", "f8"),  # running mean of what they change faster than things move [m]
        ("start_r", "f8", (8,)),  # newest ranges of a pair not started, a ring [m]
        ("start_t", "f8", (8,)),  # their times [s]
        ("start_n", "i8"),  # how many came
        ("t_start", "f8"),  # when the first came [s]
        ("surveyed", "f8"),  # surveyed distance [m]; 0 for none
        ("start_nlos_llr", "f8"),  # what their powers say: log-likelihood ratio of no sight
        ("n_ranges", "i8"),
        ("residual", "f8"),  # its last range less the distance after it [m]
        ("has_residual", "?"),
        ("n_rejected", "i8"),  # ranges that hardly counted
        ("i", "i8"),  # constant: node indices, i < j
        ("j", "i8"),
        ("i_range_error", "i8"),  # constant: first state of its range error, -1 for none
    ]
)
GROUP = np.dtype(
    [
        ("alignment", "i8"),  # see `alignment.Alignment`
        ("n_illegal_steps", "i8"),  # of the alignment, see `alignment.set_alignment`
        ("degenerate", "?"),  # the layout could not be told from its mirror image
        ("n_alive", "i8"),
        ("best", "i8"),
        ("undecided", "?"),  # all hypotheses were one, turned: nothing has spoken for it yet
        ("t", "f8"),  # time of the states [s]
        ("t_alignment", "f8"),  # since when other turns are looked for [s]
        ("t_check", "f8"),
        ("t_constraints", "f8"),
        ("t_gauge", "f8"),
        ("t_scoring_starts", "f8"),  # until when no likelihood counts [s]
        ("heading_gauge_var", "f8"),  # of the rotation of a group in the plane; 0 in space [rad2]
        ("mean_nis", "f8"),  # running mean of NIS, of nodes without a fault [-]
        ("misfit", "f8"),  # slow running mean of that [-]
        ("misfit_limit", "f8"),  # how much of it brings up other rotations [-]
        ("surprise", "f8"),  # running mean of that of ranges, see `residuals.update_surprise` [-]
        ("surprise_sum", "f8"),  # of ranges since it was last updated
        ("surprise_n", "i8"),
        ("nis_sum", "f8"),
        ("nis_n", "i8"),
        ("loglik_sum", "f8"),  # of all ranges, in the hypothesis that was the best
        ("loglik_n", "i8"),
        ("white_var", "f8"),  # of ranges, as it is learned [m2]
    ]
)
