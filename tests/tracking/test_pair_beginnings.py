"""Initial rotations and reflections of the pair filters."""

import numpy as np
import pytest

from tracking import Constellation, NodeConfig, Tracker
from tracking.measurements import Kind, MeasurementBlock

FIXED = 5


def orientations(X, truth):
    """Return the rotation of every hypothesis, (hyp, pair, 3), to the truth, (hyp, 3, 3)."""
    U, _, Vt = np.linalg.svd(np.swapaxes(truth, -1, -2) @ X)
    return U @ Vt


@pytest.mark.parametrize("seed", range(6))
def test_nodes_that_join_one_by_one_are_tried_in_every_rotation_and_mirror_image(seed):
    """Three nodes in space are their own reflection; the fourth must get both."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(-3.0, 3.0, (FIXED, 3))
    nodes = tuple(NodeConfig(id=k, kind="static", vehicle="none") for k in range(FIXED))
    tracker = Tracker(Constellation(nodes=nodes, dimensions=3), filter="ekf-mds")
    pairs = tracker.constellation.pairs
    distance = np.linalg.norm(truth[pairs[:, 1]] - truth[pairs[:, 0]], axis=1)
    surveys = MeasurementBlock.of_kind(
        Kind.SURVEY, np.zeros(len(pairs)), pairs[:, 0], distance[:, None], j=pairs[:, 1]
    )
    tracker.step(surveys, 0.1)

    s = tracker.save()["filter"]
    X = s.x[0, :, s.alive[0], :3]
    assert len(X) == 48
    true = truth[pairs[:, 1]] - truth[pairs[:, 0]]
    found = orientations(X, true)
    assert np.abs(X @ np.swapaxes(found, -1, -2) - true).max() < 1e-3
    assert np.sum(np.linalg.det(found) > 0.0) == 24
    relative_covariance = np.linalg.norm(found[:, None] - found[None], axis=(2, 3))
    assert relative_covariance[~np.eye(48, dtype=bool)].min() > 0.5
