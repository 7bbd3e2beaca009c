"""Consistency of the default filter on runs with known noise."""

import numpy as np
import pytest

from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import recordable
from tracking import Status, Tracker, TrackerParams
from tracking.filters import FilterParams
from tracking.metrics.score import score

SECONDS, SEEDS = 40.0, range(500, 506)


@pytest.fixture(scope="module")
def runs():
    """Return score, mean NIS and time that a pair was OK and wrong by a metre, of every seed."""
    joint = matched_params(recordable("cars-los"))
    params = TrackerParams(filter=FilterParams(joint=joint))
    out = []
    for seed in SEEDS:
        log = simulate(scenario="cars-los", seconds=SECONDS, seed=seed)
        t = log.truth.times()
        t = t[t >= log.t_range[0]]
        tracker = Tracker(log.constellation, params)
        estimate = tracker.run(log.block, t).take(0)
        truth, known = log.truth.pairs(log.constellation, t)
        error = np.linalg.norm(estimate.pos_ij_w - truth, axis=-1)
        wrong = ((estimate.status == Status.OK) & (error > 1.0)).sum(axis=0).max() * np.diff(t)[0]
        out.append((score(estimate, truth, known, 10.0), tracker.mean_nis()[0], wrong))
    return out


def test_errors_are_as_large_as_the_covariance_says(runs):
    """Limits for means of six short runs are wider than the documented band of 200 long ones."""
    nees = np.array([r[0].nees for r in runs], dtype=float)
    assert 0.5 < np.mean(nees) < 1.7


def test_innovations_are_as_large_as_their_variance_says(runs):
    assert 0.8 < np.mean([r[1] for r in runs]) < 1.2


def test_ok_is_never_said_of_a_mirror_image(runs):
    assert all(r[2] < 1.0 for r in runs)


def test_most_of_the_bias_of_a_drive_stays_below_ten_centimetres(runs):
    assert np.median([r[0].rmse_yaw for r in runs]) < 0.10
    assert np.median([r[0].rmse_shape for r in runs]) < 0.07
