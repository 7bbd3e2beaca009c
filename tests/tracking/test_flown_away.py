"""A node whose estimate left the group by dead reckoning is brought back by what it ranges."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from agents.simulate import simulate
from tracking import Tracker
from tracking.estimate import Status

DOCS = Path(__file__).parents[2] / "docs"
AWAY = 30.0
"""[m] How far off, with 5 m/s of speed, and as certain as before."""


def send_away(tracker, nodes):
    """Put nodes elsewhere, in every hypothesis."""
    saved = tracker.save()
    state = saved["filter"]
    for k, node in enumerate(nodes):
        p, v = state.nodes["at_p"][0, node], state.nodes["at_v"][0, node]
        state.x[0, :, p] += AWAY * (k + 1.0)
        state.x[0, :, v] += 5.0
    tracker.restore(saved)


def errors_after(group, block, truth, gone, at, t):
    """Errors of distances, (time, pair) [m], and the estimate, with nodes sent away at a time."""
    tracker = Tracker(group)
    tracker.step(block.take(block.t[0] <= at), at)
    send_away(tracker, gone)
    estimate = tracker.run(block.take(block.t[0] > at), t).take(0)
    found = np.linalg.norm(estimate.pos_ij_w, axis=-1)
    return np.abs(found - np.linalg.norm(truth(t), axis=-1)), estimate


@pytest.fixture(scope="module")
def swarm():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(DOCS), *sys.path])
        return runpy.run_path(str(DOCS / "space_runs.py"))["drones"](6)


@pytest.mark.parametrize("gone", [(2,), (1, 3), (0, 1, 2, 4)])
def test_drones_that_flew_away_come_back(swarm, gone):
    i, j = swarm.constellation.pairs.T

    def truth(t):
        where = swarm.positions(t)
        return where[:, j] - where[:, i]

    t = np.array([30.02, *np.arange(31.0, 40.0, 0.5)])
    error, estimate = errors_after(swarm.constellation, swarm.block, truth, gone, 30.0, t)
    assert error[0].max() > 20.0
    there = estimate.status != Status.STARTING
    assert there[4:].all()
    assert error[2:][there[2:]].max() < 1.0
    assert np.sqrt((error[4:] ** 2).mean()) < 0.25


@pytest.mark.parametrize("gone", [(0,), (2,)])
def test_a_car_that_drove_away_comes_back(gone):
    log = simulate(scenario="cars-los", seconds=30.0, seed=7001)
    group = log.constellation
    t = np.array([20.02, *np.arange(21.0, 28.0, 0.5)])
    error, estimate = errors_after(
        group, log.block, lambda t: log.truth.pairs(group, t)[0], gone, 20.0, t
    )
    assert error[0].max() > 20.0
    assert error[2:].max() < 0.6
    assert (estimate.status[-1] == Status.OK).all()
