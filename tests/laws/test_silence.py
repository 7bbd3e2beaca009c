"""Old measurements expire: silence of all nodes, first ranges, status doubtful."""

from dataclasses import replace

import numpy as np
import pytest

from tracking import Status, Tracker
from tracking.filters import FILTERS
from tracking.measurements import Kind


def ranges_of(block, *nodes):
    """Return the mask of ranges between two nodes, or of all ranges of one, (event,)."""
    found = block.kind[0] == Kind.RANGE
    for node in nodes:
        found &= (block.i[0] == node) | (block.j[0] == node)
    return found


@pytest.mark.parametrize("name", FILTERS)
def test_after_a_common_silence_the_group_begins_anew(name, make_group):
    """The first transmitter after the silence has been silent as long as the others."""
    group = make_group(n=4, seconds=40.0)
    b = group.block
    silent = ranges_of(b) & (b.t[0] > 8.0) & (b.t[0] < 16.0)
    block = b.take(~silent)
    after = block.t[0, ranges_of(block) & (block.t[0] >= 16.0)][0]
    t = np.array([7.9, after + 0.01, 39.9])
    estimate = Tracker(group.constellation, filter=name).run(block, t).take(0)
    assert np.isin(estimate.status[1], (Status.ABSENT, Status.STARTING)).all()
    for k in (0, 2):
        assert np.isin(estimate.status[k], (Status.OK, Status.AMBIGUOUS)).all()
    if name == "joint":
        assert (estimate.status[2] == Status.OK).all()
        assert np.abs(estimate.pos_ij_w[2] - group.pairs(t)[2]).max() < 0.3


@pytest.mark.parametrize("name", FILTERS)
def test_first_ranges_of_long_ago_place_nobody(name, make_group):
    """The first range of a joining node is four seconds old when it ranges the other two."""
    if name.startswith("paper"):
        pytest.skip("the paper names no age of the first k measurements")
    group = make_group(n=4, seconds=12.0)
    b = group.block
    early = ranges_of(b, 3, 0) & (b.t[0] < 4.0)
    late = (ranges_of(b, 3, 1) | ranges_of(b, 3, 2)) & (b.t[0] > 8.0)
    block = b.take(~ranges_of(b, 3) | early | late)
    status = Tracker(group.constellation, filter=name).run(block, np.array([11.9])).status[0, 0]
    for k in range(3):
        assert status[group.constellation.pair_index[k, 3]] == Status.STARTING


def test_a_doubt_ends_where_a_single_other_is_left(make_group):
    """Ranges to a single node carry no information about a common offset."""
    group = make_group(n=4, seconds=30.0)
    b = group.block
    values = b.values.copy()
    values[0, ranges_of(b, 0) & (b.t[0] > 8.0) & (b.t[0] < 14.0), 0] += 0.8
    left = ranges_of(b, 0) & ~ranges_of(b, 0, 1) & (b.t[0] > 14.0)
    block = replace(b, values=values).take(~left)
    t = np.array([10.0, 12.0, 13.9, *np.arange(19.0, 30.0)])
    status = Tracker(group.constellation).run(block, t).status[0]
    pair = group.constellation.pair_index[0, 1]
    assert (status[:3, pair] == Status.DOUBTFUL).all()
    assert (status[3:, pair] != Status.DOUBTFUL).all()


@pytest.mark.parametrize("name", FILTERS)
def test_who_was_heard_and_never_started_is_absent_again(name, make_group):
    """Two of three nodes range a few times, too few for a start; then all are silent."""
    group = make_group(n=3, seconds=20.0)
    b = group.block
    few = ranges_of(b, 0, 1) & (b.t[0] < 0.2)
    block = b.take(~ranges_of(b) | few)
    t = np.array([0.3, 4.0, 6.0, 19.0])
    status = Tracker(group.constellation, filter=name).run(block, t).status[0]
    pair = group.constellation.pair_index[0, 1]
    assert status[:, pair].tolist() == [
        Status.STARTING,
        Status.STARTING,
        Status.ABSENT,
        Status.ABSENT,
    ]
