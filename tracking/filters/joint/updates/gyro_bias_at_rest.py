"""Measurement of the residual gyroscope bias at rest (`gyro_bias`)."""

from __future__ import annotations

from tracking.filters.joint.ekf.columns import GYRO_INFORMATION, GYRO_SUM
from tracking.filters.joint.ekf.scalar_update import compute_pht, kalman_update
from tracking.filters.joint.hypotheses.alignment import is_linear
from tracking.filters.joint.hypotheses.alignment_sensitivity import (
    accumulate_alignment_information,
    innovation_sensitivity,
)
from tracking.kernels.jit import small_kernel


@small_kernel
def update_gyro_bias_at_rest(s, h, i, work):
    """Correct hypothesis h with what VQF has learned of the gyroscope of node i at rest."""
    node, pre = s.nodes[i], s.preintegrated
    if pre[i, GYRO_INFORMATION] == 0.0:
        return
    taken, R = (node.gyro0, node.gyro1, node.gyro2), 1.0 / pre[i, GYRO_INFORMATION]
    for k in range(3):
        work.idx[0], work.val[0] = node.i_gyro_bias + k, 1.0
        S = compute_pht(s, h, 1, work) + R
        nu = pre[i, GYRO_SUM + k] * R - taken[k] - s.x[h, node.i_gyro_bias + k]
        if is_linear(s.group[0]):
            work.direct[:] = 0.0
            innovation_sensitivity(s, h, 1, work)
            accumulate_alignment_information(s, h, work, nu, S)
        kalman_update(s, h, work.w, nu, S)
