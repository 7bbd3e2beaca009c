"""No pair is ok whose expected error is larger than the accuracy, static nodes or not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.exact_motion import ExactGroup
from tracking import Tracker, TrackerParams
from tracking.estimate import Status
from tracking.filters.joint.params import JointParams
from tracking.filters.params import FilterParams
from tracking.measurements import Kind


class AmongFixed(ExactGroup):
    """The first node moves, the others are static; these range each other at first only."""

    def _measure(self, dt):
        self.pos[:, 1:], self._vel[:, 1:] = self.pos[:1, 1:], 0.0
        fixed = [replace(node, kind="static") for node in self.constellation.nodes[1:]]
        nodes = (self.constellation.nodes[0], *fixed)
        self.constellation = replace(self.constellation, nodes=nodes)
        block = super()._measure(dt)
        first = (block.kind[0] == Kind.RANGE) & (block.t[0] < 1.0)
        return block.take((block.i[0] == 0) | first)


@pytest.fixture(scope="module", params=[0.03, 0.1, 0.3])
def walk(request):
    group = AmongFixed("robot", range(4), hz=20.0, seconds=40.0)
    params = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=request.param)))
    times = np.arange(1.0, 39.0, 0.1)
    return request.param, Tracker(group.constellation, params).run(group.block, times).take(0)


def test_what_is_ok_expects_to_be_within_the_accuracy(walk):
    accuracy, estimate = walk
    expected = np.sqrt(np.trace(estimate.cov[..., :3, :3], axis1=-2, axis2=-1))
    fixed = estimate.constellation.is_static[estimate.constellation.pairs].all(axis=1)
    settled = np.isin(estimate.status, (Status.OK, Status.LOST))
    is_ok = estimate.status == Status.OK
    assert expected[is_ok].max(initial=0.0) <= accuracy * (1.0 + 1e-9)
    # The other way round: between fixed nodes nothing else makes a pair lost.
    beyond = settled[:, fixed] & ~is_ok[:, fixed]
    assert (expected[:, fixed][beyond] > accuracy).all()
    assert settled[:, fixed].any()


def test_both_sides_of_the_accuracy_occur():
    """Otherwise the law above holds of nothing."""
    group = AmongFixed("robot", range(4), hz=20.0, seconds=40.0)
    times = np.arange(1.0, 39.0, 0.1)
    fixed = group.constellation.is_static[group.constellation.pairs].all(axis=1)
    shares = []
    for accuracy in (0.03, 1.0):
        params = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=accuracy)))
        found = Tracker(group.constellation, params).run(group.block, times).take(0)
        shares.append((found.status[:, fixed] == Status.OK).mean())
    assert shares[0] < 0.5 < shares[1]
