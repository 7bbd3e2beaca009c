"""Groups whose pairs range a few times a second or less: start and consistency."""

from dataclasses import replace

import numpy as np
import pytest

from tests.exact_motion import ExactGroup
from tracking import Constellation, NodeConfig, Status, Tracker
from tracking.estimate import TeamEstimate
from tracking.findings import find_in_estimates, find_unused
from tracking.findings.ambiguity import find_ambiguous
from tracking.findings.truth import find_truth_errors
from tracking.log import Log
from tracking.log.truth import Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.metrics.integrity import wrong_while_ok


def thinned(group, rate, loss, seed):
    """Thin ranges of every pair to `rate` per second at times of its own; a share is lost."""
    block, rng = group.block, np.random.default_rng(seed)
    keep = block.kind[0] != Kind.RANGE
    for i, j in group.constellation.pairs:
        mine = np.nonzero((block.kind[0] == Kind.RANGE) & (block.i[0] == i) & (block.j[0] == j))[0]
        due = np.arange(rng.uniform(0.0, 1.0 / rate), group.t[-1], 1.0 / rate)
        at = np.unique(np.searchsorted(block.t[0, mine], due))
        at = at[(at < len(mine)) & (rng.random(len(at)) >= loss)]
        keep[mine[at]] = True
    return block.take(keep)


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0, 4.0, 6.0])
@pytest.mark.parametrize("n", [3, 5])
def test_every_group_with_enough_ranges_starts(n, rate, loss):
    """Also, no car is wrong while OK."""
    group = ExactGroup("car", range(n), hz=50.0, seconds=30.0)
    t = np.arange(0.5, 29.9, 0.1)
    for seed in range(3):
        block = thinned(group, rate, loss, seed)
        estimate = Tracker(group.constellation).run(block, t).take(0)
        runs = (estimate.status >= Status.AMBIGUOUS).all(axis=1)
        # Three consecutive recent ranges of every pair, or two seconds of more.
        assert t[runs][0] < 3.0 + 9.0 / (rate * (1.0 - loss))
        assert not wrong_while_ok(estimate, group.pairs(t)).any()


def test_a_pair_that_ranges_once_a_second_is_not_lost_between():
    group = ExactGroup("robot", range(3), hz=50.0, seconds=20.0, at_rest=True)
    t = np.arange(12.0, 19.5, 0.05)
    estimate = Tracker(group.constellation).run(thinned(group, 1.0, 0.0, 1), t).take(0)
    by_age = (estimate.status == Status.LOST) & (estimate.pos_std.max(axis=-1) < 1.0)
    assert not by_age.any()


def test_what_was_never_placed_is_told_with_what_it_lacks():
    group = ExactGroup("robot", range(4), hz=50.0, seconds=8.0)
    block = group.block
    of_last = (block.kind[0] == Kind.RANGE) & (block.j[0] == 3)
    few = of_last & (block.i[0] > 0)
    block = block.take(~few)
    log = Log(name="one-pair", constellation=group.constellation, block=block)
    estimate = Tracker(group.constellation).run(block, np.arange(0.5, 7.9, 0.1)).take(0)
    (found,) = find_in_estimates(log, estimate, 0)
    assert found.nodes == (13,)
    assert "node 13 was never placed" in found.text
    assert "with 1 nodes" in found.text
    assert "each of 3 placed nodes" in found.text


def test_without_any_imu_the_notes_say_what_cannot_be_known():
    group = ExactGroup("robot", range(3), hz=20.0, seconds=4.0)
    block = group.block.take(group.block.kind[0] == Kind.RANGE)
    log = Log(name="no-imu", constellation=group.constellation, block=block)
    assert [f.name for f in find_unused(log)] == ["no-imu"]
    assert find_unused(replace(log, block=group.block)) == []


def test_a_truth_on_another_clock_is_a_finding():
    group = ExactGroup("robot", range(3), hz=20.0, seconds=4.0)
    t, no = np.arange(0.0, 4.0, 0.5), np.zeros(8)
    truth = Truth(t, no.astype(int), np.zeros((8, 3)), np.zeros((8, 4)), no > 1, no < 1)
    log = Log(name="late", constellation=group.constellation, block=group.block, truth=truth)
    assert find_truth_errors(log) == []
    (found,) = find_truth_errors(replace(log, truth=replace(truth, t=t + 1e9)))
    assert found.name == "truth-clock"
    assert "no time in common" in found.text


@pytest.mark.parametrize("across", [0.0, 1.5])
def test_a_row_of_nodes_at_rest_is_its_own_mirror_image(across):
    """Four people in a row, or one of them off the row."""
    rng = np.random.default_rng(2)
    nodes = tuple(NodeConfig(id=k, vehicle="human") for k in range(4))
    where = np.array([[0.0, 0.0], [1.0, 0.01], [2.0, across], [3.5, -0.01]])
    who = Constellation(nodes=nodes, dimensions=2)
    rows = [(0.01 * k, *pair) for k in range(1500) for pair in who.pairs[k % 6][None]]
    t, i, j = np.array(rows).T
    i, j = i.astype(int), j.astype(int)
    ranges = np.linalg.norm(where[j] - where[i], axis=1) + 0.03 * rng.standard_normal(len(t))
    block = MeasurementBlock.of_kind(Kind.RANGE, t, i, ranges[:, None], j=j)
    log = Log(name="row", constellation=who, block=block)
    estimate = Tracker(who).run(block, np.arange(1.0, 14.9, 0.1)).take(0)
    found = [f.name for f in find_in_estimates(log, estimate, 0)]
    assert found == (["degenerate-layout"] if across == 0.0 else [])


def test_a_layout_that_motion_does_not_tell_from_its_mirror_image_is_a_finding():
    group = ExactGroup("robot", range(3), hz=20.0, seconds=8.0)
    log = Log(name="undecided", constellation=group.constellation, block=group.block)
    estimate = Tracker(group.constellation).run(group.block, np.arange(0.5, 7.9, 0.1)).take(0)
    assert find_in_estimates(log, estimate, 0) == []
    estimate.status[estimate.status == Status.OK] = Status.AMBIGUOUS
    (found,) = find_in_estimates(log, estimate, 0)
    assert (found.name, found.nodes) == ("undecided-layout", group.constellation.ids)
    without_imu = group.block.take(group.block.kind[0] == Kind.RANGE)
    assert find_in_estimates(replace(log, block=without_imu), estimate, 0) == []


@pytest.mark.parametrize("up", [0.02, 0.8])
def test_a_node_that_moves_in_a_plane_among_static_ones_is_a_finding(up):
    nodes = (NodeConfig(id=9), *(NodeConfig(id=k, kind="static", vehicle="none") for k in range(4)))
    who = Constellation(nodes=nodes, dimensions=3, heading="initial")
    t = np.arange(0.0, 20.0, 0.05)
    where = np.array([[0, 0, 0], [4, 0, 1], [0, 4, 2], [4, 4, -1.0]])
    path = np.stack([np.cos(t), np.sin(t), up * np.sin(3.0 * t)], axis=1) + 2.0
    path[200:] *= [1.0, 1.0, -1.0]  # the other image
    pos = np.concatenate([path[:, None], np.broadcast_to(where, (len(t), 4, 3))], axis=1)
    estimate = TeamEstimate.empty(who, t[None]).take(0)
    i, j = who.pairs.T
    estimate.pos_ij_w[...] = pos[:, j] - pos[:, i]
    estimate.status[...] = Status.AMBIGUOUS
    block = MeasurementBlock.of_kind(Kind.IMU, t, 0 * t.astype(int), np.zeros((len(t), 6)))
    log = Log(name="loop", constellation=who, block=block)
    (found,) = find_ambiguous(log, estimate)
    assert found.name == ("degenerate-motion" if up < 0.1 else "undecided-layout")
    assert found.nodes == (9,)
    estimate.status[...] = Status.OK
    names = [f.name for f in find_ambiguous(log, estimate)]
    assert names == (["degenerate-motion"] if up < 0.1 else [])
