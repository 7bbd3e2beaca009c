"""Frozen, spiking, saturated or silent inertial sensors, clock offsets and magnetic disturbances.

Every run also asserts that estimates are finite, and covariances symmetric and positive definite.
"""

import numpy as np
import pytest

from tracking.measurements import Kind

INERTIAL = range(6)
ACCELEROMETER = range(3, 6)
BEGIN, END = 30.0, 40.0


def each(n, rows):
    """Return the mask of every n-th row."""
    few = np.zeros_like(rows)
    few[np.nonzero(rows)[0][::n]] = True
    return few


def wild(values):
    return 50.0 * values


@pytest.mark.parametrize("stuck_at", ["the last value", "zero"])
def test_a_stuck_imu_is_not_believed(faults, stuck_at):
    """Ten seconds of constant samples increase the uncertainty; the accuracy recovers later."""
    held = (lambda v: 0.0 * v) if stuck_at == "zero" else (lambda v: 0.0 * v + v[0])
    run = faults.run(lambda edit: edit.changed(edit.imu(), INERTIAL, held))
    assert run.sigma(BEGIN + 1.0, END) > 1.3 * faults.clean.sigma(BEGIN + 1.0, END)
    assert run.error(BEGIN, END) < 4.0 * run.sigma(BEGIN, END)
    faults.assert_as_good(run, END + 8.0)
    faults.assert_others_as_before(run, END + 8.0, np.inf)


@pytest.mark.parametrize("columns", [INERTIAL, ACCELEROMETER], ids=["all", "accelerometer"])
def test_wild_imu_samples_are_left_out(faults, columns):
    """One sample per second that is 50 times as large does not change the accuracy of any pair."""
    run = faults.run(lambda edit: edit.changed(each(100, edit.imu()), columns, wild))
    faults.assert_as_good(run, BEGIN, END)
    faults.assert_others_as_before(run)


def test_a_saturated_accelerometer_is_doubted(faults):
    """Accelerations clipped at 2 m/s2 increase the uncertainty of the car, but not the errors."""
    cut = lambda v: v.clip(-2.0, 2.0)  # noqa: E731
    run = faults.run(lambda edit: edit.changed(edit.imu(), ACCELEROMETER, cut))
    faults.assert_as_good(run, BEGIN, END)
    assert run.sigma(BEGIN, END) > 1.05 * faults.clean.sigma(BEGIN, END)
    faults.assert_others_as_before(run)
    faults.assert_as_good(run, END + 3.0)


def test_one_saturated_axis_is_doubted(faults):
    """Clipping of the forward axis alone does not change the accuracy of any pair."""
    cut = lambda v: v.clip(-2.0, 2.0)  # noqa: E731
    run = faults.run(lambda edit: edit.changed(edit.imu(), ACCELEROMETER[:1], cut))
    faults.assert_as_good(run, BEGIN, END)
    faults.assert_others_as_before(run)


def test_an_accelerometer_saturated_from_the_start_is_the_cars_own_trouble(faults):
    """With a full scale of 2 m/s2, only the uncertainty of this car increases."""
    cut = lambda v: v.clip(-2.0, 2.0)  # noqa: E731
    run = faults.run(lambda edit: edit.changed(edit.imu(0.0, np.inf), ACCELEROMETER, cut))
    assert run.sigma(15.0, np.inf) > 1.1 * faults.clean.sigma(15.0, np.inf)
    assert run.error() < 4.0 * run.sigma(15.0, np.inf)
    faults.assert_others_as_before(run, 15.0, np.inf)


@pytest.mark.parametrize("limit", [20.0, 12.0])
def test_a_saturated_accelerometer_on_a_limb_does_not_lose_it(person, limit):
    """With clipped peaks of every swing, the limb stays ok and its error within 4 sigma."""
    cut = lambda v: v.clip(-limit, limit)  # noqa: E731
    run = person.run(lambda edit: edit.changed(edit.imu(0.0, np.inf), ACCELEROMETER, cut))
    assert run.error() < 1.7 * person.clean.error()
    assert run.error() < 4.0 * run.sigma(15.0, np.inf)
    assert run.ok_share(15.0, np.inf) > 0.9


def test_a_silent_imu_makes_the_car_less_certain(faults):
    """Ten seconds with ranges only increase the error and the standard deviation."""
    run = faults.run(
        lambda edit: edit.without(edit.sent_by(Kind.IMU, Kind.MAG, begin=BEGIN, end=END))
    )
    assert run.sigma(BEGIN + 1.0, END) > 1.3 * faults.clean.sigma(BEGIN + 1.0, END)
    assert run.error(BEGIN, END) < 4.0 * run.sigma(BEGIN, END)
    faults.assert_others_as_before(run, allowance=0.01)
    faults.assert_as_good(run, END + 8.0)


def test_a_late_imu_costs_little(faults):
    """An offset of the IMU clock of 50 ms does not change the accuracy of any pair."""
    run = faults.run(lambda edit: edit.later(edit.sent_by(Kind.IMU, Kind.MAG), 0.05))
    faults.assert_as_good(run)
    faults.assert_others_as_before(run, 15.0, np.inf)


def test_a_very_late_imu_costs_no_more_than_the_way_it_drives(faults):
    """An offset of 100 ms adds at most the distance driven in it; 1 cm for the other pairs."""
    run = faults.run(lambda edit: edit.later(edit.sent_by(Kind.IMU, Kind.MAG), 0.1))
    assert run.error() < faults.clean.error() + 0.1 * 0.5
    faults.assert_others_as_before(run, 15.0, np.inf, allowance=0.01)


def test_a_magnet_beside_a_car_turns_nothing(faults):
    """Five seconds of a field stronger than the earth's change neither position nor heading."""

    def magnet(edit):
        rows = edit.sent_by(Kind.MAG, begin=BEGIN, end=BEGIN + 5.0)
        return edit.changed(rows, range(3), lambda v: v + [60.0, -30.0, 20.0])

    run = faults.run(magnet)
    faults.assert_as_good(run, BEGIN, BEGIN + 5.0)
    faults.assert_as_good(run, BEGIN + 5.0)
    faults.assert_others_as_before(run, BEGIN, BEGIN + 5.0)
    angle = 2.0 * np.arccos(
        np.abs(np.sum(run.estimate.q_wb * faults.clean.estimate.q_wb, axis=-1)).clip(0.0, 1.0)
    )
    assert np.median(angle.max(axis=(1, 2))) < np.radians(5.0)
