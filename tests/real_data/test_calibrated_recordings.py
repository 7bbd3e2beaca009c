"""Calibration of recorded ranges and sensors."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.calibrate import calibrate_imus, calibrate_magnetometers, calibrate_ranges
from tracking.calibration import CalibrationError, range_table
from tracking.log import read_log


def rms(x):
    return np.sqrt(np.mean(x**2))


@pytest.mark.parametrize("name", ["tiers_run01", "tiers_short"])
def test_robots_range_a_third_of_a_metre_too_long(data, name):
    found = calibrate_ranges(read_log(data / "logs" / name))
    record = found.summary[0]
    assert record["median_before_m"] == pytest.approx(0.36, abs=0.02)
    assert abs(record["median_after_m"]) < 0.01
    assert record["rms_after_m"] < 0.3 * record["rms_before_m"]
    assert record["inlier_share"] > 0.9


def test_the_first_half_corrects_the_second(data):
    """The tested ranges are not used for the calibration."""
    log = read_log(data / "logs" / "tiers_run01")
    middle = 0.5 * sum(log.t_range)
    halves = [replace(log, block=log.block.take(log.block.t[0] < middle))]
    halves.append(replace(log, block=log.block.take(log.block.t[0] >= middle)))
    calibration = calibrate_ranges(halves[0]).calibration
    c = log.constellation
    before, after = (
        range_table(block, c, log.truth)
        for block in (halves[1].block, calibration.apply(halves[1].block, c))
    )
    errors = [t.measured[t.known] - t.true[t.known] for t in (before, after)]
    assert abs(np.median(errors[1])) < 0.2 * abs(np.median(errors[0]))
    assert rms(errors[1]) < 0.5 * rms(errors[0])


def test_a_star_of_fixed_nodes_shows_sums_only(data):
    found = calibrate_ranges(read_log(data / "logs" / "isas_walk1"))
    assert not found.uwb.separable
    assert found.uwb.residual_std < 0.1


def test_a_hand_held_node_lay_still_before_and_after(data):
    found = calibrate_imus(read_log(data / "logs" / "isas_walk1"))
    assert len(found.imu[1].rest.n) == 2
    assert found.imu[1].acc_method == "partial"
    assert np.linalg.norm(found.imu[1].calibration.gyr_offset) < 0.02


def test_logs_without_such_a_sensor(data):
    log = read_log(data / "logs" / "tiers_run01")
    for calibrate in (calibrate_imus, calibrate_magnetometers):
        with pytest.raises(CalibrationError, match="tiers_run01: no"):
            calibrate(log)
