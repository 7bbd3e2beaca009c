"""Inertial sensors that stick, spike, saturate or fall silent, and a clock that is off.

Every run also checks what no fault may change: figures stay finite, covariances symmetric and
positive.
"""

import numpy as np
import pytest

from tracking.measurements import Kind

INERTIAL = range(6)
ACCELEROMETER = range(3, 6)
BEGIN, END = 30.0, 40.0


def each(n, rows):
    """Every n-th of the rows."""
    few = np.zeros_like(rows)
    few[np.nonzero(rows)[0][::n]] = True
    return few


def wild(values):
    return 50.0 * values


@pytest.mark.parametrize("stuck_at", ["the last value", "zero"])
def test_a_stuck_imu_is_not_believed(faults, stuck_at):
    """Ten seconds of the same six numbers: as uncertain as without, and good again later."""
    held = (lambda v: 0.0 * v) if stuck_at == "zero" else (lambda v: 0.0 * v + v[0])
    run = faults.run(lambda edit: edit.changed(edit.imu(), INERTIAL, held))
    assert run.sigma(BEGIN + 1.0, END) > 1.3 * faults.clean.sigma(BEGIN + 1.0, END)
    assert run.error(BEGIN, END) < 4.0 * run.sigma(BEGIN, END)
    faults.assert_as_good(run, END + 8.0)
    faults.assert_others_as_before(run, END + 3.0, np.inf)


@pytest.mark.parametrize("columns", [INERTIAL, ACCELEROMETER], ids=["all", "accelerometer"])
def test_wild_imu_samples_are_left_out(faults, columns):
    """One sample a second fifty times as large: nobody's accuracy changes."""
    run = faults.run(lambda edit: edit.changed(each(100, edit.imu()), columns, wild))
    faults.assert_as_good(run, BEGIN, END)
    faults.assert_others_as_before(run)


def test_a_saturated_accelerometer_stays_the_cars_own_trouble(faults):
    """Accelerations cut at 2 m/s2: the others keep their accuracy, the car regains its own."""
    cut = lambda v: v.clip(-2.0, 2.0)  # noqa: E731
    run = faults.run(lambda edit: edit.changed(edit.imu(), ACCELEROMETER, cut))
    faults.assert_others_as_before(run)
    faults.assert_as_good(run, END + 3.0)


def test_a_silent_imu_makes_the_car_less_certain(faults):
    """Ten seconds of ranges alone: the error grows, and the standard deviation with it."""
    run = faults.run(
        lambda edit: edit.without(edit.sent_by(Kind.IMU, Kind.MAG, begin=BEGIN, end=END))
    )
    assert run.sigma(BEGIN + 1.0, END) > 1.3 * faults.clean.sigma(BEGIN + 1.0, END)
    assert run.error(BEGIN, END) < 4.0 * run.sigma(BEGIN, END)
    faults.assert_others_as_before(run)
    faults.assert_as_good(run, END + 8.0)


def test_a_late_imu_costs_little(faults):
    """A car whose inertial clock is off by 50 ms: as good as before, and so the others."""
    run = faults.run(lambda edit: edit.later(edit.sent_by(Kind.IMU, Kind.MAG), 0.05))
    faults.assert_as_good(run)
    faults.assert_others_as_before(run, 15.0, np.inf)


def test_a_magnet_beside_a_car_turns_nothing(faults):
    """Five seconds of a field stronger than the earth's: position and heading hold."""

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
    assert angle.max() < np.radians(5.0)
