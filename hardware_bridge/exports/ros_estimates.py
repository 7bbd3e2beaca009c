"""Estimates as ROS 2 messages.

Every pair is a ``nav_msgs/Odometry``: pose of node j in the body frame of node i with its
covariance, and the velocity difference in the axes of j. For viewers there is a tree of frames:
``map``, with the axes of the world, has the reference node at its origin and all others around. A
node without a measured orientation has a frame along the axes of the world.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from hardware_bridge.exports.ros_definitions import ODOMETRY, STRING, TF
from hardware_bridge.exports.ros_parts import Message, frame, header, quaternion, xyz
from hardware_bridge.exports.stamps import stamps_ns
from tracking.arrays import F64
from tracking.estimate import Status, TeamEstimate
from tracking.geometry import quat_conjugate, quat_multiply, quat_to_matrix

MAP = "map"
ANY_ANGLE = math.pi**2 / 3.0
"""[rad2] Variance of an unknown angle (uniform); the tracker estimates none."""
ANY_RATE = 1e6
"""[rad2/s2] Variance of angular rates, which are not part of an estimate."""
_NOTHING = (Status.ABSENT, Status.STARTING)
_NONE = (0.0, 0.0, 0.0)


def estimate_messages(estimate: TeamEstimate, reference: int, offset_ns: int) -> Iterator[Message]:
    """Yield messages in order of time.

    Args:
        estimate: Estimates, arrays over (time, ...).
        reference: Id of the node at the origin of ``map``.
        offset_ns: Offset added to every time [ns].

    Raises:
        BridgeError: A time is outside of the range of ROS.
    """
    constellation = estimate.constellation
    ids = constellation.ids
    stamps = stamps_ns(estimate.t, offset_ns)
    q_wb = np.where(estimate.has_orientation[..., None], estimate.q_wb, [1.0, 0.0, 0.0, 0.0])
    R_wb = quat_to_matrix(q_wb)  # noqa: N806
    has = ~np.isin(estimate.status, _NOTHING)
    for k, t_ns in enumerate(stamps):
        yield from _tree(estimate, constellation.index_of[reference], k, t_ns, q_wb[k], has[k])
        for p, (i, j) in enumerate(constellation.pairs):
            topic = f"/estimates/{frame(ids[i])}/{frame(ids[j])}"
            status = Status(int(estimate.status[k, p]))
            if status != Status.ABSENT:
                yield Message(t_ns, f"{topic}/status", STRING, {"data": status.name.lower()})
            if not has[k, p]:
                continue
            R_i, R_j = R_wb[k, i], R_wb[k, j]  # noqa: N806
            cov = estimate.cov[k, p]
            q_ij = quat_multiply(quat_conjugate(q_wb[k, i]), q_wb[k, j])
            pose = {
                "position": xyz(R_i.T @ estimate.pos_ij_w[k, p]),
                "orientation": quaternion(q_ij.tolist()),
            }
            velocity = R_j.T @ estimate.vel_ij_w[k, p]
            content: dict[str, Any] = {
                "header": header(t_ns, frame(ids[i])),
                "child_frame_id": frame(ids[j]),
                "pose": {
                    "pose": pose,
                    "covariance": _covariance(R_i.T @ cov[:3, :3] @ R_i, ANY_ANGLE),
                },
                "twist": {
                    "twist": {"linear": xyz(velocity), "angular": xyz(_NONE)},
                    "covariance": _covariance(R_j.T @ cov[3:, 3:] @ R_j, ANY_RATE),
                },
            }
            yield Message(t_ns, f"{topic}/odom", ODOMETRY, content)


def _tree(
    estimate: TeamEstimate, reference: int, k: int, t_ns: int, q_wb: F64, has: np.ndarray
) -> Iterator[Message]:
    """Yield the frames of one instant, if any other node is estimated relative to the reference."""
    constellation = estimate.constellation
    transforms = []
    for j, node in enumerate(constellation.ids):
        if j == reference:
            pos: Any = _NONE
        elif has[constellation.pair_index[reference, j]]:
            pair = constellation.pair_index[reference, j]
            pos = estimate.pos_ij_w[k, pair] * (1.0 if reference < j else -1.0)
        else:
            continue
        transforms.append(
            {
                "header": header(t_ns, MAP),
                "child_frame_id": frame(node),
                "transform": {"translation": xyz(pos), "rotation": quaternion(q_wb[j].tolist())},
            }
        )
    if len(transforms) > 1:
        yield Message(t_ns, "/tf", TF, {"transforms": transforms})


def _covariance(linear: F64, angular: float) -> list[float]:
    """Return a 6 x 6 matrix, row by row: linear part, and one variance for the angular part."""
    cov = np.diag([0.0, 0.0, 0.0, angular, angular, angular])
    cov[:3, :3] = linear
    return [float(v) for v in cov.ravel()]
