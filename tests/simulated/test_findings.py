"""Wrong units, axes, clocks and calibrations are detected, without false positives."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.track import track_log
from agents.simulation.simulate import simulate
from tests.second_world.record import record
from tests.second_world.world import draw
from tracking.constellation import NodeConfig
from tracking.errors import LogError
from tracking.findings import KINDS, Finding, examine, find_unused, refuse_errors
from tracking.findings.at_rest import correct_at_rest, find_in_samples, rest_of
from tracking.findings.gyroscope import find_gyroscope
from tracking.findings.turned_magnetometer import correct_magnetometers, turned
from tracking.log import read_log, write_log
from tracking.measurements import Kind


@pytest.fixture(scope="module")
def drive():
    return simulate(scenario="cars-los", seconds=40.0, seed=11)


def with_samples(log, kind, change):
    block = log.block
    values, rows = block.values.copy(), block.kind[0] == kind
    values[0, rows] = change(values[0, rows])
    return replace(log, block=replace(block, values=values))


def scaled(*factors):
    """Return a function that multiplies the first columns of samples by factors."""
    return lambda values: values * np.r_[factors, np.ones(values.shape[1] - len(factors))]


def stamped(log, late, node=None):
    block = log.block
    own = np.isin(block.kind[0], (Kind.IMU, Kind.MAG))
    if node is not None:
        own &= block.i[0] == node
    t = block.t.copy()
    t[0, own] += late
    block = replace(block, t=t)
    return replace(log, block=block.take(block.order()[0]))


def found_in(log):
    return {f.name for f in examine(log)[1]}


@pytest.mark.parametrize("name", ["cars-los", "cars-nlos", "human"])
@pytest.mark.parametrize("seed", [20, 21])
def test_nothing_is_wrong_with_what_is_right(name, seed):
    log = simulate(scenario=name, seconds=40.0, seed=seed)
    corrected, found = examine(log)
    assert [f for f in found if f.severity != "note"] == []
    assert corrected is log


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_wrong_with_strangers_cars(seed):
    assert all(KINDS[name].severity == "note" for name in found_in(record(draw(seed))))


@pytest.mark.parametrize(
    ("factors", "name"),
    [
        ((1, 1, 1, 1 / 9.81, 1 / 9.81, 1 / 9.81), "accel-units"),
        ((1, 1, 1, 1e3 / 9.81, 1e3 / 9.81, 1e3 / 9.81), "accel-units"),
        ((1, 1, 1, 3.28, 3.28, 3.28), "accel-units"),
        ((1, -1, -1, 1, -1, -1), "gravity-axis"),
        ((57.3, 57.3, 57.3, 1, 1, 1), "gyro-units"),
        ((-1, -1, -1, 1, 1, 1), "gyro-axes"),
    ],
)
def test_units_and_axes_that_make_estimates_wrong_are_refused(drive, factors, name):
    wrong = with_samples(drive, Kind.IMU, scaled(*factors))
    assert name in found_in(wrong)
    with pytest.raises(LogError, match=r"node \d.*expected|node \d.*explains"):
        track_log(wrong)


@pytest.mark.parametrize("name", ["cars-los", "human"])
def test_rates_in_degrees_are_named_in_a_log_that_is_read(tmp_path, name):
    """The reader must not leave out the samples that show the unit."""
    log = simulate(scenario=name, seconds=12.0, seed=20)
    write_log(tmp_path / "log", with_samples(log, Kind.IMU, scaled(57.3, 57.3, 57.3)))
    errors = [f for f in examine(read_log(tmp_path / "log"))[1] if f.severity == "error"]
    assert {f.name for f in errors} == {"gyro-units"}
    assert {n for f in errors for n in f.nodes} == set(log.constellation.ids)


def test_a_length_of_gravity_that_is_a_little_wrong_is_a_warning(drive):
    long = with_samples(drive, Kind.IMU, scaled(1, 1, 1, 1.08, 1.08, 1.08))
    _, found = examine(long)
    assert "gravity-length" in {f.name for f in found}
    assert set(found) <= set(track_log(long, findings=found).findings)


def test_a_gyroscope_that_reads_a_rotation_at_rest_is_a_warning(drive):
    def add(values):
        return values + np.r_[0.0, 0.0, 0.114, np.zeros(values.shape[1] - 3)]

    corrected, found = examine(with_samples(drive, Kind.IMU, add))
    assert {f.name for f in found} == {"gyro-bias"}
    imu = drive.block.kind[0] == Kind.IMU
    left = corrected.block.values[0, imu, :3] - drive.block.values[0, imu, :3]
    assert np.abs(left).max() < 0.01


def test_a_steady_turn_is_no_bias_that_is_taken_off(drive):
    """The IMU of a car on a circle appears to be at rest all the time."""
    t = drive.block.t[0][(drive.block.kind[0] == Kind.IMU) & (drive.block.i[0] == 0)]
    turning = np.random.default_rng(1).normal(0.0, 0.01, (len(t), 3)) + [0.0, 0.0, 0.15]

    def turn(values):
        return np.c_[turning, np.tile([0.0, 0.2, 9.81], (len(t), 1)), values[:, 6:]]

    circle = of_first(turn)(drive)
    corrected, found = correct_at_rest(circle)
    assert "gyro-bias" in {f.name for f in found}
    np.testing.assert_array_equal(corrected.block.values, circle.block.values)


def test_two_clocks_that_are_late_are_both_corrected(drive):
    corrected, found = examine(stamped(stamped(drive, 0.4, node=0), -0.3, node=2))
    assert {f.name for f in found} == {"clock-corrected"}
    assert {n for f in found for n in f.nodes} == {1, 3}
    now = corrected.block
    for node in (0, 2):
        before = drive.block.t[0][(drive.block.kind[0] == Kind.IMU) & (drive.block.i[0] == node)]
        after = now.t[0][(now.kind[0] == Kind.IMU) & (now.i[0] == node)]
        assert np.abs(after - before).max() < 0.05


def of_first(change, kind=Kind.IMU):
    """Return a function that changes the samples of one kind of the first car in a log."""

    def apply(log):
        block = log.block
        values, rows = block.values.copy(), (block.kind[0] == kind) & (block.i[0] == 0)
        values[0, rows] = change(values[0, rows])
        return replace(log, block=replace(block, values=values))

    return apply


def swapped(values):
    return values[:, [0, 1, 2, 4, 3, *range(5, values.shape[1])]]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (of_first(swapped), "x, y of its accelerometer were y, x"),
        (of_first(scaled(1, 1, 1, -1, -1)), "were -x, -y"),
        (of_first(scaled(-1, -1, -1), Kind.MAG), "were -x, -y"),
    ],
    ids=["accelerometer swapped", "accelerometer turned", "magnetometer with other signs"],
)
def test_an_imu_that_contradicts_the_ranges_is_refused_and_named(drive, wrong, said):
    with pytest.raises(LogError, match=r"node 1: ranges are likelier without") as raised:
        track_log(wrong(drive))
    assert said in str(raised.value)


def test_a_clock_that_runs_too_fast_is_refused(drive):
    block = drive.block
    t = block.t.copy()
    t[0, np.isin(block.kind[0], (Kind.IMU, Kind.MAG))] *= 1.02
    wrong = replace(block, t=t)
    wrong = replace(drive, block=wrong.take(wrong.order()[0]))
    assert "clock-rate" in found_in(wrong)


def test_the_clock_of_a_single_node_is_corrected(drive):
    corrected, found = examine(stamped(drive, 0.4, node=0))
    assert [(f.name, f.nodes) for f in found] == [("clock-corrected", (1,))]
    rows = (drive.block.kind[0] == Kind.IMU) & (drive.block.i[0] == 0)
    after = corrected.block.t[0][
        (corrected.block.kind[0] == Kind.IMU) & (corrected.block.i[0] == 0)
    ]
    assert np.abs(after - drive.block.t[0][rows]).max() < 0.04


@pytest.mark.parametrize(("node", "degrees"), [(0, 30.0), (2, -40.0)])
def test_a_magnetometer_that_is_turned_is_turned_back(drive, node, degrees):
    wrong = replace(drive, block=turned(drive.block, node, np.radians(degrees)))
    corrected, (found,) = examine(wrong)
    assert (found.name, found.nodes) == ("mag-turned", (drive.constellation.ids[node],))
    # Readings that are turned to the left are those of a sensor that is turned to the right.
    assert f"to the {'right' if degrees > 0.0 else 'left'} by about" in found.text
    t, before, after = (log.block.t[0] for log in (drive, wrong, corrected))
    np.testing.assert_array_equal(t, before)
    np.testing.assert_array_equal(t, after)
    own = (drive.block.kind[0] == Kind.MAG) & (drive.block.i[0] == node)
    right, back = (log.block.values[0, own, :2] @ [1.0, 1.0j] for log in (drive, corrected))
    assert abs(np.degrees(np.angle(back / right)).mean()) < 5.0
    rest = ~own
    np.testing.assert_array_equal(corrected.block.values[0, rest], drive.block.values[0, rest])


def test_magnetometers_that_are_all_turned_alike_turn_only_north(drive):
    block = drive.block
    for node in range(3):
        block = turned(block, node, 0.7)
    assert correct_magnetometers(replace(drive, block=block), lambda share: None)[1] == []


def test_of_a_group_that_is_lost_nothing_is_said():
    """In a steel hall, a quarter of the ranges is too long by more than 0.5 m."""
    log = simulate(scenario="warehouse", seconds=60.0, seed=20)
    assert {f.severity for f in examine(log)[1]} <= {"note"}


@pytest.mark.parametrize("order", [(1, 0, 2), (0, 2, 1), (2, 1, 0)])
def test_axes_of_a_magnetometer_are_named_where_bodies_turn_about_all(order):
    log = simulate(scenario="human", seconds=30.0, seed=2)
    sign = np.array([1.0, 1.0, -1.0])

    def turn(values):
        out = values.copy()
        out[:, :3] = values[:, order] * sign
        return out

    assert find_gyroscope(log) == []
    found = find_gyroscope(with_samples(log, Kind.MAG, turn))
    assert len(found) >= 4
    # Expected text: the axes of the sensor in terms of the recorded ones.
    back = np.argsort(order)
    named = ", ".join(("-" if sign[k] < 0.0 else "") + "mag_" + "xyz"[k] for k in back)
    assert all(f"were {named}, or all three" in f.text for f in found)


@pytest.mark.parametrize("late", [0.2, -0.2])
def test_a_clock_that_is_a_little_late_is_corrected(drive, late):
    log, found = examine(stamped(drive, late))
    assert [f.name for f in found] == ["clock-corrected"]
    size, way = found[0].text.split(" comes ")[1].split(" s ")
    assert float(size) == pytest.approx(abs(late), abs=0.03)
    assert way.startswith("later" if late > 0.0 else "earlier")
    before = drive.block.t[0][drive.block.kind[0] == Kind.IMU]
    after = log.block.t[0][log.block.kind[0] == Kind.IMU]
    assert np.abs(after - before).max() < 0.03
    assert (np.diff(log.block.t[0]) >= 0.0).all()


@pytest.mark.parametrize(("late", "node"), [(3.1, None), (-1.5, None), (3.0, 1)])
def test_a_clock_that_is_seconds_late_is_refused(drive, late, node):
    found = examine(stamped(drive, late, node))[1]
    assert "clock-offset" in {f.name for f in found}
    with pytest.raises(LogError, match="expected one clock"):
        refuse_errors(found)


def test_what_is_refused_is_tracked_if_asked_for(drive):
    wrong = with_samples(drive, Kind.IMU, scaled(1, 1, 1, 1 / 9.81, 1 / 9.81, 1 / 9.81))
    assert all(f.severity == "note" for f in track_log(wrong, findings=[]).findings)


def test_ranges_that_are_long_are_told():
    people = simulate(scenario="human", seconds=60.0, seed=2)
    long = with_samples(people, Kind.RANGE, lambda v: v + np.r_[0.4, np.zeros(v.shape[1] - 1)])
    [found] = [f for f in examine(long)[1] if f.name == "range-offset"]
    assert 0.15 < float(found.text.split(" when ")[1].split(" m shorter")[0]) < 0.45
    assert found.severity == "warning"


def test_rest_is_found_by_what_varies_not_by_what_is_read():
    rng, t = np.random.default_rng(0), np.arange(0.0, 6.0, 0.01)
    values = np.zeros((len(t), 6))
    values[:, :3] = [0.1, 0.0, 0.0] + 0.003 * rng.standard_normal((len(t), 3))
    values[:, 3:] = [0.0, 0.0, 9.7] + 0.03 * rng.standard_normal((len(t), 3))
    values[t > 3.0, :3] += rng.standard_normal((int((t > 3.0).sum()), 3))
    rest = rest_of(t, values)
    assert rest.seconds == pytest.approx(3.0, abs=1.0)
    np.testing.assert_allclose(rest.rate, [0.1, 0.0, 0.0], atol=0.01)
    assert rest.length == pytest.approx(9.7, abs=0.02)


@pytest.mark.parametrize(("vehicle", "count"), [("car", 1), ("hand", 0)])
def test_only_what_stays_level_has_an_upside(vehicle, count):
    t = np.arange(0.0, 3.0, 0.01)
    values = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, -9.81], (len(t), 1))
    values += 1e-3 * np.random.default_rng(1).standard_normal(values.shape)
    found = find_in_samples(NodeConfig(id=3, vehicle=vehicle), t, values)
    assert [f.name for f in found] == ["gravity-axis"] * count


def test_all_errors_are_told_at_once():
    errors = [Finding("gyro-axes", (k,), f"node {k}: off") for k in (1, 2)]
    refuse_errors([Finding("never-still", (1,), "node 1 never rests")])
    with pytest.raises(LogError, match=r"node 1: off.*\n.*node 2: off"):
        refuse_errors(errors)
    assert all(kind.meaning and kind.remedy for kind in KINDS.values())


def test_misspelt_keys_are_named(drive, tmp_path):
    write_log(tmp_path / "log", drive)
    meta = tmp_path / "log" / "meta.toml"
    text = meta.read_text().replace("[nodes.1]", "[nodes.1]\ninitial_heading = 0.3")
    meta.write_text(text.replace("dimensions", "accuracy = 0.2\ndimensions"))
    log = read_log(tmp_path / "log")
    assert log.unused_keys == ("accuracy", "nodes.1.initial_heading")
    (found,) = [f for f in find_unused(log) if f.name == "unused-keys"]
    assert found.severity == "warning"
    assert "accuracy, nodes.1.initial_heading" in found.text


def test_progress_of_checks_goes_up():
    shares = []
    examine(simulate(scenario="cars-los", seconds=8.0, seed=2), shares.append)
    assert len(shares) > 4
    assert shares == sorted(shares)
    assert shares[0] >= 0.0
    assert shares[-1] < 1.0


def test_ranges_that_the_filter_refuses_are_named(drive):
    """Ranges with errors of several metres cause a finding; ordinary ones do not."""
    rng = np.random.default_rng(3)

    def scatter(values):
        rows = rng.random(len(values)) < 0.5
        return np.where(rows[:, None], values + 20.0 * rng.random((len(values), 1)), values)

    refused = track_log(with_samples(drive, Kind.RANGE, scatter), findings=())
    assert [f.name for f in refused.findings] == ["ranges-refused"]
    assert track_log(drive, findings=()).findings == ()
