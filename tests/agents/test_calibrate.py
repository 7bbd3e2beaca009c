"""`relpos calibrate` and `relpos track --calibration` on the command line."""

import json
import tomllib

import numpy as np
import pytest

from agents.evaluation.calibrate import (
    apply_calibrations,
    calibrate_imus,
    calibrate_magnetometers,
    calibrate_ranges,
)
from agents.simulation.simulate import simulate
from tests.command_line import relpos
from tracking.calibration import CalibrationError
from tracking.log import Log, write_log
from tracking.measurements import Kind, MeasurementBlock


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Simulate a drive in a building with much iron in its floor."""
    scenario = tmp_path_factory.mktemp("scenario") / "iron.toml"
    scenario.write_text('extends = "cars-nlos"\n[mag]\ndisturbance = 3.0\n')
    return simulate(scenario=str(scenario), seconds=25.0, seed=6, antenna_delay=0.3)


@pytest.fixture(scope="module")
def exact():
    """Simulate a drive with the same antennas and no other range errors."""
    return simulate(scenario="cars-nlos", seconds=25.0, seed=4, antenna_delay=0.3, channel="exact")


@pytest.fixture(scope="module")
def folder(log, tmp_path_factory):
    return write_log(tmp_path_factory.mktemp("log") / "run", log)


def rms(x):
    return np.sqrt(np.mean(x**2))


def test_antenna_delays_of_a_simulated_drive(exact):
    truth = calibrate_ranges(exact).calibration.ranges
    assert truth.slope == pytest.approx(1.0, abs=1e-3)
    # A simulated range keeps its error for a metre of driving, so the run has to be long.
    log = simulate(scenario="cars-nlos", seconds=60.0, seed=4, antenna_delay=0.3)
    found = calibrate_ranges(log)
    offset = found.calibration.ranges.offset
    assert offset == pytest.approx(truth.offset, abs=0.03)
    assert max(abs(b) for b in offset.values()) > 0.2
    assert found.calibration.ranges.slope == pytest.approx(1.0, abs=0.02)
    record = found.summary[0]
    assert record["nlos_share_inliers"] < record["nlos_share"]
    used = found.uwb.inlier
    assert rms(found.uwb.error_after[used]) < 0.5 * rms(found.uwb.error_before[used])


def test_what_is_found_is_what_is_applied(log):
    found = calibrate_ranges(log)
    again = calibrate_ranges(
        Log(
            name=log.name,
            constellation=log.constellation,
            block=found.calibration.apply(log.block, log.constellation),
            truth=log.truth,
        )
    )
    assert again.calibration.ranges.slope == pytest.approx(1.0, abs=1e-3)
    assert max(abs(b) for b in again.calibration.ranges.offset.values()) < 5e-3


def test_gyroscopes_at_rest_after_calibration(log):
    found = calibrate_imus(log)
    assert [r["sensor"] for r in found.summary] == ["imu"] * 3
    block = found.calibration.apply(log.block, log.constellation)
    still = (block.kind[0] == Kind.IMU) & (block.t[0] < 1.7)
    for n in range(3):
        before, after = (
            np.abs(b.values[0, still & (b.i[0] == n), :3].mean(axis=0)).max()
            for b in (log.block, block)
        )
        assert after < 2e-4 < before


def on_the_spot(log):
    """Return the log with magnetometers of nodes that rotate on one spot."""
    block = log.block
    values = block.values.copy()
    for n in range(log.constellation.n_nodes):
        mine = (block.kind[0] == Kind.MAG) & (block.i[0] == n)
        angle = 2.0 * block.t[0, mine]
        field = np.stack([20 * np.sin(angle), 20 * np.cos(angle), np.full(len(angle), -43.0)], 1)
        values[0, mine, :3] = field + [3.0 * n, -2.0, 1.0]
    fields = (block.t, block.kind, block.i, block.j, block.antenna_i, block.antenna_j)
    turned = MeasurementBlock(*fields, values, block.has_power, block.valid)
    return Log(name="turn", constellation=log.constellation, block=turned, truth=log.truth)


def test_magnetometers_that_turn_on_the_spot(log):
    found = calibrate_magnetometers(on_the_spot(log), seed=1)
    for n, result in enumerate(found.mag.values()):
        offset = result.calibration.mag_offset
        np.testing.assert_allclose(offset, [3.0 * n, -2.0, 0.0], atol=1e-6)


def test_a_drive_through_a_bent_field_is_refused(log):
    with pytest.raises(CalibrationError, match="node 1: .*on one spot"):
        calibrate_magnetometers(log)


@pytest.mark.parametrize("sensor", ["imu", "uwb"])
def test_files_and_json(folder, tmp_path, sensor):
    out = tmp_path / "out"
    done = relpos("calibrate", sensor, folder, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    records = [json.loads(line) for line in done.stdout.splitlines()]
    assert {r["sensor"] for r in records} == {sensor}
    assert sorted(p.name for p in out.iterdir()) == ["calibration.toml", "report.html"]
    raw = tomllib.loads((out / "calibration.toml").read_text())
    assert set(raw) == {"format", {"imu": "nodes", "uwb": "ranges"}[sensor]}
    page = (out / "report.html").read_text()
    assert page.count("data:image/svg+xml;base64") == 1


def test_tables_and_pictures_of_magnetometers(log, tmp_path):
    folder = write_log(tmp_path / "turn", on_the_spot(log))
    done = relpos("calibrate", "mag", folder, "--out", tmp_path / "out", "--seed", 3)
    assert done.returncode == 0, done.stderr
    assert "ellipse" in done.stdout
    assert "written" in done.stdout
    assert "image/svg+xml" in (tmp_path / "out" / "report.html").read_text()


def test_tracking_with_calibrations(folder, tmp_path):
    for sensor in ("imu", "uwb"):
        done = relpos("calibrate", sensor, folder, "--out", tmp_path / sensor)
        assert done.returncode == 0, done.stderr
    files = [tmp_path / s / "calibration.toml" for s in ("imu", "uwb")]
    options = [word for file in files for word in ("--calibration", file)]
    raw, corrected = relpos("track", folder, "--json"), relpos("track", folder, "--json", *options)
    assert corrected.returncode == 0, corrected.stderr
    shapes = [json.loads(done.stdout)["rmse_shape"] for done in (raw, corrected)]
    assert shapes[1] < 0.7 * shapes[0]
    twice = relpos("track", folder, *options, "--calibration", files[1])
    assert twice.returncode == 2
    assert "ranges: given twice" in twice.stderr


def test_bad_input_ends_in_one_line_and_writes_nothing(folder, log, tmp_path):
    blind = Log(name="blind", constellation=log.constellation, block=log.block)
    no_truth = write_log(tmp_path / "blind", blind)
    out = tmp_path / "out"
    bad = tmp_path / "bad.toml"
    bad.write_text("format = 1\nnode = 2\n")
    faults = [
        (["calibrate", "uwb", no_truth, "--out", out], "blind: no range has a true distance"),
        (["calibrate", "mag", folder, "--out", out], "on one spot"),
        (["calibrate", "imu", folder, "--out", out, "--gravity", "1"], "--gravity"),
        (["calibrate", "uwb", folder, "--out", out, "--seed", "-1"], "--seed"),
        (["calibrate", "uwb", folder, "--out", out, "--max-distance", "0"], "--max-distance"),
        (["calibrate", "uwb", folder], "--out"),
        (["calibrate", "imu", tmp_path / "nowhere", "--out", out], "no such folder"),
        (["track", folder, "--calibration", bad], "bad.toml, node: unknown"),
        (["track", folder, "--calibration", tmp_path / "none.toml"], "cannot be read"),
    ]
    for args, message in faults:
        done = relpos(*args)
        assert done.returncode == 2, args
        assert message in done.stderr
        assert "Traceback" not in done.stderr
        assert done.stdout == ""
    assert not out.exists()


def test_no_calibration_changes_nothing(log):
    assert np.array_equal(apply_calibrations(log, []).block.values, log.block.values)
