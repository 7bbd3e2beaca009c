"""Intervals have their stated coverage, and pairs are kept together."""

import numpy as np
import pytest

from agents.comparison.statistics import Interval, mean, ratio


def test_the_value_is_the_mean_and_inside():
    values = np.random.default_rng(0).exponential(1.0, 60)
    found = mean(values)
    assert found.value == pytest.approx(values.mean())
    assert found.low < found.value < found.high
    assert mean(values) == found


def test_intervals_of_normal_values_are_students():
    values = np.random.default_rng(1).normal(3.0, 1.0, 400)
    half = 1.966 * values.std(ddof=1) / 20.0
    assert mean(values).ends == pytest.approx(
        [values.mean() - half, values.mean() + half], abs=0.01
    )


def test_they_hold_the_truth_about_as_often_as_they_say():
    rng = np.random.default_rng(2)
    found = [mean(rng.exponential(1.0, 40)) for _ in range(60)]
    assert sum(f.low <= 1.0 <= f.high for f in found) >= 51


def test_what_is_missing_is_left_out():
    values = np.array([1.0, np.nan, 3.0])
    assert mean(values).value == 2.0
    assert mean(np.full(3, np.nan)) is None
    assert ratio(values, np.array([2.0, 100.0, 2.0])).value == 1.0
    assert ratio(values, np.zeros(3)) is None


def test_one_episode_has_no_interval_and_equal_ones_an_empty_one():
    assert mean(np.array([2.0])) == Interval(2.0, None, None)
    assert mean(np.array([2.0])).ends is None
    assert mean(np.full(5, 2.0)) == Interval(2.0, 2.0, 2.0)


def test_pairs_cancel_what_makes_an_episode_hard():
    rng = np.random.default_rng(3)
    hard = rng.uniform(0.1, 1.0, 50)
    better = 0.8 * hard + rng.normal(0.0, 0.005, 50)
    found = ratio(better, hard)
    assert found.low < 0.8 < found.high
    assert found.high - found.low < 0.02
    assert ratio(rng.permutation(better), hard).high - found.high > 0.05


def test_a_driver_over_itself_is_one():
    values = np.random.default_rng(4).uniform(0.1, 1.0, 30)
    assert ratio(values, values) == Interval(1.0, 1.0, 1.0)
