"""What rest tells of a gyroscope (`_gyroscope_kernels`) corrects all states."""

from __future__ import annotations

from tracking.jit import small_kernel
from tracking.filters.joint._alignment_kernels import is_linear
from tracking.filters.joint._gyroscope_kernels import KNOWN, REST
from tracking.filters.joint._linear_kernels import absorb, project
from tracking.filters.joint._open_kernels import tell_turn, turn_gradient


@small_kernel
def learn_at_rest(s, h, i, scratch):
    """Correct hypothesis h with what rest has told of the gyroscope of node i."""
    node, pre = s.nodes[i], s.pre
    if pre[i, KNOWN] == 0.0:
        return
    taken, R = (node.gyro0, node.gyro1, node.gyro2), 1.0 / pre[i, KNOWN]
    for k in range(3):
        scratch.idx[0], scratch.val[0] = node.at_g + k, 1.0
        S = project(s, h, 1, scratch) + R
        nu = pre[i, REST + k] * R - taken[k] - s.x[h, node.at_g + k]
        if is_linear(s.group[0]):
            scratch.direct[:] = 0.0
            turn_gradient(s, h, 1, scratch)
            tell_turn(s, h, scratch, nu, S)
        absorb(s, h, scratch.w, nu, S)
