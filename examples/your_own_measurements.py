"""Feed the tracker by hand: nodes that send their own orientation and acceleration."""

import numpy as np

from tracking import Constellation, Kind, MeasurementBlock, NodeConfig, Tracker

constellation = Constellation(nodes=tuple(NodeConfig(id=k) for k in (1, 2, 3)), dimensions=2)
tracker = Tracker(constellation)
t = np.arange(1, 1500) / 100.0
angle = t[:, None] * [0.9, 1.3, 1.7] + [0.0, 2.0, 4.0]
centre = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 2.5]])
pos = centre + np.stack([np.cos(angle), np.sin(angle)], axis=-1)
accel = -(np.array([[0.9], [1.3], [1.7]]) ** 2) * (pos - centre)

blocks = []
for k in range(3):
    node = np.full(len(t), k)
    state = np.zeros((len(t), 7))  # orientation w x y z, then acceleration in the world frame
    state[:, 0], state[:, 4:6] = 1.0, accel[:, k]
    blocks.append(MeasurementBlock.of_kind(Kind.STATE, t, node, state))
for i, j in constellation.pairs:
    distance = np.linalg.norm(pos[:, j] - pos[:, i], axis=1)[:, None]
    ends = np.full(len(t), i), np.full(len(t), j)
    blocks.append(
        MeasurementBlock.of_kind(Kind.RANGE, t, ends[0], distance, j=ends[1], antennas=ends)
    )
estimate = tracker.step(MeasurementBlock.concatenate(blocks).sorted(), t[-1])
error = estimate.pos_ij_w[0, 0, :2] - (pos[-1, 1] - pos[-1, 0])
print(f"from ranges and accelerations alone: error of pair 1-2 is {np.linalg.norm(error):.3f} m")
