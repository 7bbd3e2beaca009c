"""A node whose estimate diverged by dead reckoning is recovered from its ranges."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tracking import Tracker
from tracking.estimate import Status
from tracking.measurements import Kind

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
AWAY = 30.0
"""[m] Position error of the first diverged node, with 5 m/s and unchanged covariance."""


def send_away(tracker, nodes):
    """Shift position and velocity of nodes in every hypothesis."""
    saved = tracker.save()
    state = saved["filter"]
    for k, node in enumerate(nodes):
        p, v = state.nodes["i_pos"][0, node], state.nodes["i_vel"][0, node]
        state.x[0, :, p] += AWAY * (k + 1.0)
        state.x[0, :, v] += 5.0
    tracker.restore(saved)


def errors_after(group, block, truth, gone, at, t):
    """Return distance errors, (time, pair) [m], and the estimate, after a divergence at `at`."""
    tracker = Tracker(group)
    tracker.step(block.take(block.t[0] <= at), at)
    send_away(tracker, gone)
    estimate = tracker.run(block.take(block.t[0] > at), t).take(0)
    found = np.linalg.norm(estimate.pos_ij_w, axis=-1)
    return np.abs(found - np.linalg.norm(truth(t), axis=-1)), estimate


@pytest.fixture(scope="module")
def space():
    """Names defined by `benchmarks/space_runs.py`."""
    return runpy.run_path(str(BENCHMARKS / "space_runs.py"))


@pytest.fixture(scope="module")
def swarm(space):
    return space["drones"](6)


@pytest.mark.parametrize(("gone", "within"), [((2,), 3.0), ((1, 3), 3.0), ((0, 1, 2, 4), 5.0)])
def test_drones_that_flew_away_come_back(swarm, gone, within):
    i, j = swarm.constellation.pairs.T

    def truth(t):
        where = swarm.positions(t)
        return where[:, j] - where[:, i]

    t = np.array([30.02, *np.arange(31.0, 40.0, 0.5)])
    error, estimate = errors_after(swarm.constellation, swarm.block, truth, gone, 30.0, t)
    assert error[0].max() > 20.0
    soon = t >= 30.0 + within
    assert (estimate.status[soon] != Status.STARTING).all()
    assert error[soon].max() < 1.0
    assert np.sqrt((error[soon] ** 2).mean()) < 0.25


def test_a_hand_that_went_away_from_fixed_nodes_comes_back(space):
    run = space["hand"](12)
    i, j = run.constellation.pairs.T

    def truth(t):
        where = run.positions(t)
        return where[:, j] - where[:, i]

    t = np.array([40.02, *np.arange(41.0, 50.0, 0.5)])
    error, estimate = errors_after(run.constellation, run.block, truth, (0,), 40.0, t)
    moving = i == 0
    assert error[0, moving].max() > 20.0
    assert np.sqrt((error[t >= 43.0][:, moving] ** 2).mean()) < 0.3
    assert not (estimate.status[:, ~moving] == Status.STARTING).any()


@pytest.mark.parametrize(("node", "rounds", "beyond"), [(0, 1, 20.0), (1, 2, 8.0), (2, 3, -2.5)])
def test_a_few_absurd_rounds_of_a_drone_send_it_nowhere(swarm, node, rounds, beyond):
    """All ranges of a drone have the same error for up to 3 rounds; its estimate is unaffected."""
    block, t = swarm.block, np.arange(30.1, 33.0, 0.1)
    i, j = swarm.constellation.pairs.T
    values = block.values.copy()
    of_it = (block.kind == Kind.RANGE) & ((block.i == node) | (block.j == node))
    first = np.nonzero(of_it[0] & (block.t[0] > 30.0))[0][: 4 * rounds]
    values[0, first, 0] = np.maximum(values[0, first, 0] + beyond, 0.1)
    estimate = Tracker(swarm.constellation).run(replace(block, values=values), t).take(0)
    where = swarm.positions(t)
    assert (estimate.status != Status.STARTING).all()
    error = np.linalg.norm(estimate.pos_ij_w, axis=-1)
    error -= np.linalg.norm(where[:, j] - where[:, i], axis=-1)
    assert np.abs(error).max() < 0.6
