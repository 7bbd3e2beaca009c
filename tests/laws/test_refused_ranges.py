"""Rejected ranges carry no information, even if they continue to arrive."""

from dataclasses import replace

import numpy as np
import pytest

from tests.exact_motion import ExactGroup
from tracking import Tracker
from tracking.estimate import Status
from tracking.measurements import Kind

ABSURD_FROM = 9.0


@pytest.mark.parametrize("filter", ["joint", "ekf-mds"])
def test_a_pair_all_of_whose_ranges_are_refused_becomes_lost(filter):
    group = ExactGroup("car", (0, 1, 2), at_rest=True, seconds=16.0)
    block = group.block
    absurd = (block.kind == Kind.RANGE) & (block.i == 0) & (block.t > ABSURD_FROM)
    absurd &= block.j == 1
    values = block.values.copy()
    far = np.random.default_rng(0).uniform(40.0, 250.0, absurd.sum())
    values[absurd, 0] = far
    block, times = replace(block, values=values), np.array([8.5, 15.5])
    estimate = Tracker(group.constellation, filter=filter).run(block, times).take(0)
    assert estimate.status[0, 0] in (Status.AMBIGUOUS, Status.OK)
    assert estimate.status[1, 0] == Status.LOST
    assert estimate.age[1, 0] > 6.0
