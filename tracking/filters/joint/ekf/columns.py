"""Columns of a node's preintegrated samples, and of the step derived from them.

A name is the index of the first of its columns: ``pre[i, DV + k]`` is axis k of node i.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel

DT = 0
"""Time since that of the states [s]."""
DV, DP = 1, 4
"""Increments of velocity and position by accelerations, three each [m/s, m]."""
BIAS_V, BIAS_P = 7, 9
"""Cosine and sine that rotate a bias with the body, integrated once and twice, two each [s, s2]."""
NOISE = 11
"""Added variance of the velocity [m2/s2]."""
ROTATION_V, ROTATION_P = 12, 21
"""Orientation, row by row, integrated once and twice, nine each [s, s2]; like all columns from here
on, for nodes with an accelerometer offset state."""
TILT_GAIN = 30
"""Increment of the horizontal bias by tilt corrections, two [m/s2]."""
GYRO_CHANGE = 32
"""Change of the gyroscope bias that VQF removes, three [rad/s]."""
GYRO_INFORMATION, GYRO_SUM = 35, 36
"""Information about that bias from rest [s2/rad2]; information times bias, three [s/rad]."""
N_PRE = 39

STEP_T = 0
"""Time of the step [s]."""
STEP_BIAS_P, STEP_BIAS_V = 1, 3
"""Cosine and sine parts that rotate the bias, for position and velocity, two each [s2, s]."""
BY_HEADING_P, BY_HEADING_V = 5, 7
"""Derivatives of position and velocity by the heading error, two each [m, m/s]."""
BY_OFFSET_V, BY_OFFSET_P = 9, 18
"""Derivatives of both by the accelerometer offset, row by row, nine each [s, s2]."""
UP_V, UP_P = 27, 28
"""Increments of velocity and position along z [m/s, m]."""
UP_BY_HEADING_V, UP_BY_HEADING_P = 29, 30
"""Their derivatives by the heading error through a tilt, times gravity [m2/s3, m2/s2]."""
TILT_STEP = 31
"""Increment of the horizontal bias, two [m/s2]."""
BY_GYRO = 33
"""Derivatives of the two biases and the heading error by the gyroscope bias, nine."""
N_STEP = 42


@small_kernel
def row_times(columns, i, at, v0, v1, v2):
    """Return the product of three columns of node i and a vector."""
    return columns[i, at] * v0 + columns[i, at + 1] * v1 + columns[i, at + 2] * v2
