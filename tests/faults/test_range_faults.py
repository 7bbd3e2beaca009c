"""Ranges that are missing, late, wrongly calibrated, frozen, outliers or random.

Every run also asserts that estimates are finite, and covariances symmetric and positive definite.
"""

import numpy as np
import pytest

from tracking.measurements import Kind

BEGIN, END = 30.0, 40.0
RANGE = [0]


def test_a_silent_radio_loses_its_pairs_and_no_others(faults):
    """Pairs without ranges for 3 s are not ok after 1.2 s, and ok again 1 s after the end."""

    def silent(edit):
        return edit.ranges(BEGIN, BEGIN + 3.0)

    run = faults.run(lambda edit: edit.without(silent(edit)))
    assert run.ok_share(BEGIN + 1.2, BEGIN + 3.0) == 0.0
    assert run.ok_share(BEGIN + 4.0, END) == 1.0
    assert run.error(BEGIN, BEGIN + 3.0) < 0.3
    faults.assert_others_as_before(run, BEGIN, BEGIN + 3.0, lost=silent)
    faults.assert_as_good(run, BEGIN + 4.0)


def test_a_radio_that_is_silent_for_long_leaves_and_comes_back(faults):
    """After 8 s without ranges the car has been removed, joins again, and regains its accuracy."""
    run = faults.run(lambda edit: edit.without(edit.ranges(BEGIN, BEGIN + 8.0)))
    assert not run.runs[:, np.abs(run.t - BEGIN - 7.5).argmin()][:, run.touched].any()
    faults.assert_others_as_before(run, BEGIN, BEGIN + 8.0, allowance=0.01)
    faults.assert_as_good(run, BEGIN + 11.0)


def test_late_ranges_cost_little(faults):
    """Ranges of a car that are 50 ms late do not change the accuracy of any pair."""
    run = faults.run(lambda edit: edit.later(edit.ranges(0.0, np.inf), 0.05))
    faults.assert_as_good(run)
    faults.assert_others_as_before(run, 15.0, np.inf)


def test_a_late_clock_costs_little(faults):
    """A clock offset of 50 ms of a car does not change its accuracy; 5 mm for the others."""
    kinds = (Kind.IMU, Kind.MAG, Kind.RANGE)
    run = faults.run(lambda edit: edit.later(edit.sent_by(*kinds), 0.05))
    faults.assert_as_good(run)
    faults.assert_others_as_before(run, 15.0, np.inf, allowance=0.005)


def test_a_wrong_slope_costs_no_more_than_itself(faults):
    """Ranges that are 5 % too long add at most this error to the pairs of the car.

    The error stays within 2 sigma, and the others keep their accuracy.
    """
    run = faults.run(lambda edit: edit.changed(edit.ranges(0.0, np.inf), RANGE, lambda v: 1.05 * v))
    assert run.error() < 2.0 * run.sigma(15.0, np.inf)
    assert run.error() < np.hypot(faults.clean.error(), 0.05 * faults.clean.distance())
    faults.assert_others_as_before(run, 15.0, np.inf)


def test_a_wrong_offset_costs_no_more_than_itself(faults):
    """Ranges that are 0.3 m too long cause errors of less than 0.3 m."""
    run = faults.run(lambda edit: edit.changed(edit.ranges(0.0, np.inf), RANGE, lambda v: v + 0.3))
    assert run.error() < 0.3
    assert run.shape_error() < 2.0 * faults.clean.shape_error()


def test_absurd_ranges_count_for_nothing(faults):
    """Every tenth range 50 times as long does not change the accuracy of any pair."""

    def absurd(edit):
        rows = np.zeros(edit.t.shape, dtype=bool)
        rows[np.nonzero(edit.ranges())[0][::10]] = True
        return edit.changed(rows, RANGE, lambda v: 50.0 * v)

    run = faults.run(absurd)
    faults.assert_as_good(run, BEGIN, END)
    faults.assert_others_as_before(run)


def test_a_car_that_makes_its_ranges_up_is_not_believed(faults):
    """With random ranges for 10 s, pairs of the car are not ok, others as without its ranges."""
    rng = np.random.default_rng(9)
    made_up = lambda v: rng.uniform(0.5, 5.0, v.shape)  # noqa: E731
    run = faults.run(lambda edit: edit.changed(edit.ranges(), RANGE, made_up))
    assert run.ok_share(BEGIN + 1.0, END) < 0.1
    assert run.error(BEGIN, END) < 4.0 * run.sigma(BEGIN, END)
    faults.assert_others_as_without(run)
    faults.assert_as_good(run, END + 3.0)
    faults.assert_others_as_before(run, END + 3.0, np.inf)


@pytest.mark.parametrize("offset", [1.0, 0.5, 0.3, -1.0])
def test_a_wrong_calibration_is_noticed(faults, offset):
    """With a range offset for 10 s, pairs of the car are not ok and within 2.5 sigma.

    The detection of 0.3 m takes longer, since it is closer to ordinary range errors. The others
    keep their accuracy.
    """
    run = faults.run(lambda edit: edit.changed(edit.ranges(), RANGE, lambda v: v + offset))
    noticed = 3.0 if offset == 0.3 else 1.0
    assert run.ok_share(BEGIN + noticed, END) < 0.05
    assert run.error(BEGIN, END) < 0.2
    assert run.error(BEGIN, END) < 2.5 * run.sigma(BEGIN, END)
    faults.assert_others_as_before(run, allowance=0.01)
    assert run.ok_share(END + 4.0, np.inf) > 0.99
    faults.assert_as_good(run, END + 3.0)
    faults.assert_others_as_before(run, END + 3.0, np.inf)


@pytest.mark.parametrize("offset", [1.0, -1.0])
def test_a_wrong_calibration_is_noticed_among_three(small_faults, offset):
    """With a range offset in a group of three, pairs of the car are not ok and within 4 sigma.

    The other two cars have one range left, without redundancy.
    """
    run = small_faults.run(lambda edit: edit.changed(edit.ranges(), RANGE, lambda v: v + offset))
    assert run.ok_share(BEGIN + 1.0, END) < 0.05
    assert run.error(BEGIN, END) < 4.0 * run.sigma(BEGIN, END)
    without = small_faults.run(lambda edit: edit.without(edit.ranges()))
    assert run.shape_error(BEGIN, END) < 1.1 * without.shape_error(BEGIN, END) + 0.02
    small_faults.assert_as_good(run, END + 3.0)


def test_a_wrong_calibration_from_the_start_is_never_ok(faults):
    """If all ranges of a car are 1 m too long, its pairs are not ok; the others are unaffected."""
    run = faults.run(lambda edit: edit.changed(edit.ranges(0.0, np.inf), RANGE, lambda v: v + 1.0))
    assert run.ok_share(15.0, np.inf) < 0.1
    assert run.error() < 0.5
    faults.assert_others_as_before(run, 15.0, np.inf, allowance=0.01)


def test_ranges_that_stick_are_not_heard(faults):
    """Frozen ranges of all pairs of a car for 10 s have the effect of a silent radio."""

    def stuck(edit):
        for other in (0, 2, 3):
            rows = edit.of_pair(other, edit.ranges())
            edit.block = edit.changed(rows, RANGE, lambda v: 0.0 * v + v[0])
        return edit.block

    run = faults.run(stuck)
    assert run.ok_share(BEGIN + 2.0, END) < 0.05
    assert run.error(BEGIN, END) < 0.25
    faults.assert_others_as_before(run, lost=lambda edit: edit.ranges())
    faults.assert_as_good(run, END + 3.0)


def test_one_range_that_sticks_is_lost_alone(faults):
    """With one pair's range frozen for 10 s, this pair is not ok; all others are unaffected."""

    def stuck(edit):
        return edit.changed(edit.of_pair(0, edit.ranges()), RANGE, lambda v: 0.0 * v + v[0])

    run = faults.run(stuck)
    ok = run.estimate.ok[:, (run.t >= BEGIN + 2.0) & (run.t < END)].mean(axis=1)
    ok = np.median(ok, axis=0)
    assert ok[0] < 0.05
    assert ok[1:].min() > 0.95
    faults.assert_as_good(run, BEGIN, END)
    faults.assert_others_as_before(run, allowance=0.01)


def test_rounded_ranges_are_not_taken_for_stuck(faults):
    """Ranges rounded to 0.1 m, often equal in sequence, stay ok and keep the accuracy."""
    run = faults.run(
        lambda edit: edit.changed(edit.ranges(0.0, np.inf), RANGE, lambda v: v.round(1))
    )
    assert run.ok_share(15.0, np.inf) > 0.99
    faults.assert_as_good(run)
    faults.assert_others_as_before(run, 15.0, np.inf)
