"""Columns of the sums over a node's inertial samples, and of the step that they make.

A name is the first of as many columns as are given: ``pre[i, DV + k]`` is axis k of node i.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel

DT = 0
"""Time since the states' [s]."""
DV, DP = 1, 4
"""Velocity and way that accelerations add, three each [m/s, m]."""
BIAS_V, BIAS_P = 7, 9
"""Cosine and sine that turn a bias with the body, summed once and twice, two each [s, s2]."""
NOISE = 11
"""Variance of the velocity [m2/s2]."""
ROTATION_V, ROTATION_P = 12, 21
"""Orientation, row by row, summed once and twice, nine each [s, s2]; of nodes whose accelerometer
has an offset state, like all columns from here on."""
TILT_GAIN = 30
"""What corrections of the tilt add to the horizontal bias, two [m/s2]."""
GYRO_CHANGE = 32
"""By how much the bias that VQF takes off has changed, three [rad/s]."""
GYRO_INFORMATION, GYRO_SUM = 35, 36
"""Information about that bias from rest [s2/rad2]; the same times the bias, three [s/rad]."""
N_PRE = 39

STEP_T = 0
"""Time of the step [s]."""
STEP_BIAS_P, STEP_BIAS_V = 1, 3
"""Cosine and sine parts that turn the bias, of way and velocity, two each [s2, s]."""
BY_HEADING_P, BY_HEADING_V = 5, 7
"""Derivatives of way and velocity by the heading error, two each [m, m/s]."""
BY_OFFSET_V, BY_OFFSET_P = 9, 18
"""Derivatives by the offset of the accelerometer, row by row, nine each [s, s2]."""
UP_V, UP_P = 27, 28
"""What is added to velocity and way along z [m/s, m]."""
UP_BY_HEADING_V, UP_BY_HEADING_P = 29, 30
"""Derivatives of these by the heading error [m/s, m]."""
TILT_STEP = 31
"""What is added to the horizontal bias, two [m/s2]."""
BY_GYRO = 33
"""Derivatives of the two biases and the heading error by the bias of the gyroscope, nine."""
N_STEP = 42


@small_kernel
def row_times(columns, i, at, v0, v1, v2):
    """Three columns of node i, times a vector."""
    return columns[i, at] * v0 + columns[i, at + 1] * v1 + columns[i, at + 2] * v2
