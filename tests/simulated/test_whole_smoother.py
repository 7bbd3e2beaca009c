"""Smoothing of a whole recording: combination of a forward and a backward filter."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.track import track_log
from agents.simulation.simulate import simulate
from tests.exact_motion import ExactGroup
from tracking import Status, Tracker
from tracking.errors import ConfigError
from tracking.measurements import Kind, MeasurementBlock
from tracking.metrics.score import score
from tracking.whole_smoother import backwards, smooth_whole


def errors(log, t):
    truth, has = log.truth.pairs(log.constellation, t)
    plain = Tracker(log.constellation).run(log.block, t).take(0)
    whole = smooth_whole(log.constellation, log.block, t).estimate
    return [score(e, truth, has, t[0] + 10.0) for e in (plain, whole)]


@pytest.mark.parametrize("scenario", ["cars-los", "cars-nlos", "human"])
def test_it_is_nearer_to_the_truth_than_the_filter(scenario):
    t = np.arange(0.5, 39.5, 0.1)
    found = [errors(simulate(scenario=scenario, seconds=40.0, seed=s), t) for s in range(60, 64)]
    yaw = [whole.rmse_yaw / plain.rmse_yaw for plain, whole in found]
    shape = [whole.rmse_shape / plain.rmse_shape for plain, whole in found]
    assert np.mean(yaw) < 0.95
    assert np.mean(shape) < 0.95


def test_the_start_is_known_with_hindsight():
    """The backward pass has resolved the rotation where the forward filter has not yet."""
    log = simulate(scenario="cars-los", seconds=40.0, seed=61)
    t = np.arange(1.0, 39.0, 0.1)
    truth, _ = log.truth.pairs(log.constellation, t)
    plain = Tracker(log.constellation).run(log.block, t).take(0)
    whole = smooth_whole(log.constellation, log.block, t).estimate
    early = t < 2.0
    off = [np.linalg.norm(e.pos_ij_w - truth, axis=-1)[early].max() for e in (plain, whole)]
    assert off[0] > 1.0
    assert off[1] < 0.5
    assert not plain.ok[early].any()
    assert whole.ok[early].mean() > 0.8


def test_backwards_twice_is_as_it_was():
    group = ExactGroup("drone", range(4), hz=50.0, seconds=4.0, dimensions=3)
    block = group.block
    again = backwards(backwards(block))
    for name in MeasurementBlock.__slots__:
        np.testing.assert_allclose(getattr(again, name), getattr(block, name), atol=1e-12)


def test_who_joins_leaves_and_surveys_come_first():
    kinds = [Kind.JOIN, Kind.SURVEY, Kind.RANGE, Kind.LEAVE]
    t, none = np.array([1.0]), np.zeros((1, 3))
    parts = [
        MeasurementBlock.of_kind(kind, t + k, np.array([0]), none, j=np.array([1]))
        for k, kind in enumerate(kinds)
    ]
    turned = backwards(MeasurementBlock.concatenate(parts))
    assert turned.kind[0].tolist() == [
        Kind.JOIN, Kind.SURVEY, Kind.RANGE, Kind.SURVEY, Kind.LEAVE,
    ]  # fmt: skip
    assert turned.t[0].tolist() == [-4.0, -4.0, -3.0, -2.0, -1.0]


@pytest.mark.parametrize("vehicle", ["car", "robot", "human"])
def test_an_exact_run_is_followed_backwards_as_well(vehicle):
    """Motion constraints and dead reckoning are valid with reversed time."""
    group = ExactGroup(vehicle, range(4), hz=50.0, seconds=24.0, at_rest=True)
    t = np.arange(1.0, 23.5, 0.1)
    whole = smooth_whole(group.constellation, group.block, t).estimate
    off = np.linalg.norm(whole.pos_ij_w - group.pairs(t), axis=-1)
    assert np.median(off) < 0.08
    assert (whole.status == Status.OK).mean() > 0.9
    d = group.constellation.dimensions
    assert (np.linalg.eigvalsh(whole.cov[..., :d, :d])[whole.ok] > 0.0).all()


def test_a_log_is_smoothed_by_track_log():
    log = simulate(scenario="cars-los", seconds=20.0, seed=3)
    plain, whole = (track_log(log, smooth=how, findings=[]) for how in (None, "all"))
    assert whole.score.rmse_yaw < plain.score.rmse_yaw
    assert whole.nis == pytest.approx(plain.nis, rel=1e-9)
    assert whole.n_rejected == plain.n_rejected
    with pytest.raises(ConfigError, match="expected filter 'joint'"):
        track_log(log, filter="ekf", smooth="all", findings=[])


def test_a_pair_that_one_pass_knows_has_what_that_one_knows():
    log = simulate(scenario="cars-los", seconds=20.0, seed=3)
    # There are no later measurements at the end of a recording, nor earlier ones at its start.
    t = np.array([10.0, log.block.t[0, -1]])
    plain = Tracker(log.constellation).run(log.block, t).take(0)
    whole = smooth_whole(log.constellation, log.block, t).estimate
    np.testing.assert_allclose(whole.pos_ij_w[1], plain.pos_ij_w[1], atol=1e-6)
    assert (
        np.trace(whole.cov[0], axis1=-2, axis2=-1) < np.trace(plain.cov[0], axis1=-2, axis2=-1)
    ).all()
    assert replace(whole, t=plain.t).t is plain.t
