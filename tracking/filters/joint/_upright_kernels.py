"""What an orientation was turned upright by is known: so much more or less gravity is measured.

VQF turns what its gyroscope says upright, over some seconds, by what its accelerometer reads: by
its offset and by motion that lasts, too. A horizontal bias b is gravity seen through a tilt
(`_turned_kernels`), so after a turn by (t_x, t_y) about x and y of the world it is

    b + g (t_y, -t_x)

Where these turns are told, only what the gyroscope leans by is not known of the bias
(`_gyroscope_kernels`).
"""

from __future__ import annotations

from tracking.jit import small_kernel
from tracking.filters.joint._gyroscope_kernels import STEP, lean, take_gyroscope
from tracking.geometry import GRAVITY
from tracking.measurements import TOLD, UPRIGHT

GAIN = 30
"""First of two columns of the sums since the states' time: the bias that was added [m/s2]."""


@small_kernel
def take_upright(node, pre, i, values, e, k, anew):
    """Note how node i was turned upright between two STATE events, the later in column k."""
    told = node.at_o >= 0 and values[e, k, TOLD] != 0.0
    if told:
        turned0, turned1 = values[e, k, UPRIGHT], values[e, k, UPRIGHT + 1]
        begins = anew or not node.told
        if not begins:
            pre[i, GAIN] += GRAVITY * (turned1 - node.upright1)
            pre[i, GAIN + 1] -= GRAVITY * (turned0 - node.upright0)
        node.upright0, node.upright1 = turned0, turned1
        take_gyroscope(node, pre, i, values, e, k, begins)
    node.told = told


@small_kernel
def turn_upright(node, pre, x, h, i, cos_r, sin_r, w):
    """Add that to the bias of node i in hypothesis h, and write it to row i of w."""
    w[i, STEP] = cos_r * pre[i, GAIN] - sin_r * pre[i, GAIN + 1]
    w[i, STEP + 1] = sin_r * pre[i, GAIN] + cos_r * pre[i, GAIN + 1]
    b0, b1, y = lean(node, pre, x, h, i, cos_r, sin_r, w)
    w[i, STEP] += b0
    w[i, STEP + 1] += b1
    x[h, node.at_b] += w[i, STEP]
    x[h, node.at_b + 1] += w[i, STEP + 1]
    x[h, node.at_h] += y


@small_kernel
def bias_time(node):
    """How long the horizontal bias of a node stays the same [s]."""
    return node.told_bias_tau if node.told else node.bias_tau
