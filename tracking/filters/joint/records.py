"""Records of every node, pair and group, so that kernels have few arguments."""

from __future__ import annotations

import numpy as np

NODE = np.dtype(
    [
        ("t_pre", "f8"),  # time up to which inertial samples are preintegrated [s]
        ("t_state", "f8"),  # time of the last STATE event [s]
        ("t_last_range", "f8"),  # time of its last range [s]
        ("interval", "f8"),  # running mean of the time between two of its ranges [s]
        ("antenna", "i8"),  # antenna of its last range
        ("cos_yaw", "f8"),  # yaw of the last STATE event, as measured
        ("sin_yaw", "f8"),
        ("yaw_rate", "f8"),  # [rad/s]
        ("accel_mean", "f8"),  # running mean of |accel| [m/s2]
        ("accel_var", "f8"),  # running mean square of |accel| about its mean [m2/s4]
        ("turning", "f8"),  # running mean of the angular rate [rad/s]
        ("t_first", "f8"),  # time of its first sample, or the first after a long silence [s]
        ("t_oriented", "f8"),  # start of its orientation, continuous since [s]
        ("has_ahrs_feedback", "?"),  # True if VQF reports its corrections
        ("tilt_correction0", "f8"),  # accumulated tilt correction about x and y [rad]
        ("tilt_correction1", "f8"),
        ("gyro0", "f8"),  # gyroscope bias that VQF removes, three axes [rad/s]
        ("gyro1", "f8"),
        ("gyro2", "f8"),
        ("gyro_var", "f8"),  # its variance [(rad/s)^2]
        ("t_moved", "f8"),  # last time of motion, by acceleration or angular rate [s]
        ("t_accelerated", "f8"),  # last time of motion by acceleration [s]
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
        ("impact_threshold", "f8"),  # infinite for vehicles without one
        ("impact_noise_ratio", "f8"),
        ("bias_var", "f8"),
        ("bias_tau", "f8"),
        ("bias_tau_with_ahrs_feedback", "f8"),
        ("first_gyro_var", "f8"),
        ("gyro_drift2", "f8"),
        ("by_gyroscope", "?"),  # True if its heading is the first one plus gyroscope rates
        ("vertical_bias_var", "f8"),
        ("vertical_bias_tau", "f8"),
        ("initial_tilt_speed2", "f8"),
        ("offset_var", "f8"),
        ("offset_tau", "f8"),
        ("heading_var", "f8"),
        ("heading_tau", "f8"),
        ("first_heading_var", "f8"),
        ("speed_var", "f8"),
        ("sideways_var", "f8"),  # 0 for vehicles that may move sideways
        ("ahead", "f8"),  # mount: means and variances
        ("ahead_var", "f8"),
        ("slip", "f8"),
        ("slip_var", "f8"),
        ("aside", "f8"),
        ("accuracy", "f8"),  # 0 for static nodes [m]
        ("i_pos", "i8"),  # first state of its position
        ("i_vel", "i8"),  # first of its velocity; -1 for static nodes, as next and `i_heading`
        ("i_tilt_bias", "i8"),
        ("i_acc_bias", "i8"),  # first of its accelerometer offset; -1 for none
        ("i_heading", "i8"),
        ("i_gyro_bias", "i8"),  # first of its residual gyroscope bias; -1 for none
        ("i_mount", "i8"),  # first of its mount, `ahead` and `slip`; -1 for none
    ]
)
PAIR = np.dtype(
    [
        ("t_range", "f8"),  # time of the last range [s]
        ("t_used", "f8"),  # time of the last accepted range [s]
        ("interval", "f8"),  # running mean of the time between two ranges [s]
        ("nis", "f8"),  # NIS of the last range in the best hypothesis [-]
        ("mean_nis", "f8"),  # running mean NIS, with `largest_nis` for ranges not accepted [-]
        ("outlier_ratio", "f8"),  # running share of outliers [-]
        ("last_range", "f8"),  # its last range as reported, the frozen one [m]
        ("t_last", "f8"),  # time of its last range as reported [s]
        ("n_equal", "i8"),  # number of repeats of it
        ("distance_travelled", "f8"),  # distance both ends travelled during these [m]
        ("mean_residual", "f8"),  # running mean innovation, deviations limited to 1 m [m]
        ("mean_abs_residual", "f8"),  # running mean absolute deviation from it [m]
        ("last_used", "f8"),  # its last range in these statistics [m]
        ("rate_violation", "f8"),  # running mean of changes beyond those of `fastest` [m]
        ("start_r", "f8", (8,)),  # newest ranges of a pair not started, a ring buffer [m]
        ("start_t", "f8", (8,)),  # their times [s]
        ("start_n", "i8"),  # number of ranges collected
        ("t_start", "f8"),  # time of the first of them [s]
        ("surveyed", "f8"),  # surveyed distance [m]; 0 for none
        ("start_nlos_llr", "f8"),  # log-likelihood ratio of NLOS from their powers
        ("n_ranges", "i8"),
        ("residual", "f8"),  # its last range minus the corrected distance [m]
        ("has_residual", "?"),
        ("n_rejected", "i8"),  # number of ranges not accepted
        ("i", "i8"),  # constant: node indices, i < j
        ("j", "i8"),
        ("i_range_error", "i8"),  # constant: first state of its range error, -1 for none
    ]
)
GROUP = np.dtype(
    [
        ("alignment", "i8"),  # see `alignment.Alignment`
        ("n_illegal_steps", "i8"),  # transitions not allowed, see `alignment.set_alignment`
        ("degenerate", "?"),  # True while layout and mirror image are not distinguishable
        ("n_alive", "i8"),
        ("best", "i8"),
        ("undecided", "?"),  # all hypotheses are one, rotated, equally likely so far
        ("t", "f8"),  # time of the states [s]
        ("t_alignment", "f8"),  # start of the search for other rotations [s]
        ("t_check", "f8"),
        ("t_constraints", "f8"),
        ("t_gauge", "f8"),
        ("t_scoring_starts", "f8"),  # time before which no likelihood counts [s]
        ("heading_gauge_var", "f8"),  # variance of the rotation in the plane; 0 in space [rad2]
        ("mean_nis", "f8"),  # running mean NIS of pairs without a faulty node [-]
        ("misfit", "f8"),  # slow running mean of it [-]
        ("misfit_limit", "f8"),  # misfit that challenges the alignment [-]
        ("nis_sum", "f8"),
        ("nis_n", "i8"),
        ("loglik_sum", "f8"),  # sum and number over all ranges, in the best hypothesis then
        ("loglik_n", "i8"),
        ("white_var", "f8"),  # variance of the white noise of ranges, as learned [m2]
    ]
)
