"""Recovery of filters whose states are corrupted in mid-run."""

import numpy as np
import pytest

from agents.simulation.simulate import simulate
from tracking import Status, Tracker

SPOILED = 15.0
"""[s] Time of the corruption."""
END = 30.0


@pytest.fixture(scope="module", params=range(700, 704))
def log(request):
    """Simulate five cars that drive around a wall."""
    return simulate(scenario="ring-nlos", cars=5, seconds=END, seed=request.param)


def spoiled(log, spoil):
    """Return estimates after `spoil` changed the filter's positions and velocities, (node, 2)."""
    tracker = Tracker(log.constellation)
    before = log.block.t[0] <= SPOILED
    tracker.step(log.block.take(before), SPOILED)
    saved = tracker.save()
    state = saved["filter"]
    h, nodes = state.group["best"][0, 0], state.nodes[0]
    pos = np.array([state.x[0, h, n["i_pos"] : n["i_pos"] + 2] for n in nodes])
    vel = np.array([state.x[0, h, n["i_vel"] : n["i_vel"] + 2] for n in nodes])
    for node, p, v in zip(nodes, *spoil(pos, vel), strict=True):
        state.x[0, h, node["i_pos"] : node["i_pos"] + 2] = p
        state.x[0, h, node["i_vel"] : node["i_vel"] + 2] = v
    tracker.restore(saved)
    t = np.arange(SPOILED + 0.1, END, 0.1)
    estimate = tracker.run(log.block.take(~before), t).take(0)
    truth, _ = log.truth.pairs(log.constellation, t)
    return t, estimate, np.linalg.norm((estimate.pos_ij_w - truth)[..., :2], axis=-1)


def test_a_node_on_the_wrong_side_of_the_others_is_moved(log):
    """The node is mirrored at the best-fit line of the others: right again within three seconds."""

    def spoil(pos, vel):
        others = pos[1:] - pos[1:].mean(axis=0)
        across = np.linalg.svd(others)[2][1]
        pos[0] -= 2.0 * ((pos[0] - pos[1:].mean(axis=0)) @ across) * across
        return pos, vel

    t, estimate, error = spoiled(log, spoil)
    later = t > SPOILED + 3.0
    assert error[later].max() < 1.0
    assert np.median(error[later]) < 0.25
    assert (estimate.status[later] == Status.OK).mean() > 0.9


def test_a_layout_that_is_turned_round_is_found_out(log):
    """The layout is rotated by half a turn, which fits all ranges: found within ten seconds."""
    t, estimate, error = spoiled(log, lambda pos, vel: (-pos, -vel))
    later = t > SPOILED + 10.0
    wrong = (estimate.status == Status.OK) & (error > 1.0)
    assert not wrong[later].any()
    assert np.median(error[later]) < 0.4
