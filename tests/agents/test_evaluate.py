"""Many simulated runs: figures are independent of the number of jobs, and lost runs are found."""

import json
from dataclasses import replace

import numpy as np
import pytest

from agents.errors import UsageError
from agents.evaluation.changes import (
    CLOCK_OFFSET,
    OUTLIER_SPAN,
    clock_offset,
    heading_error,
    imu_dropout,
    range_outliers,
    without_powers,
)
from agents.evaluation.evaluate import evaluate
from agents.evaluation.lost import lost_at
from agents.evaluation.over_time import NIS_EDGES, over_time
from agents.evaluation.suites import SUITES, Suite
from agents.evaluation.targets import outcomes
from agents.reports.evaluate_report import target_rows
from agents.simulation.simulate import record, simulate
from relpos_env.scenarios.cars import CARS_NLOS
from tests.command_line import relpos
from tracking.constellation import Constellation, NodeConfig
from tracking.estimate import Status, TeamEstimate
from tracking.measurements import Kind

KEYS = {
    "suite", "scenario", "filter", "seeds", "rmse", "rmse_yaw", "rmse_shape", "bound",
    "bound_yaw", "bound_shape", "ratio_bound", "ratio_shape", "lost_runs", "nees", "nis",
    "us_per_round", "paper", "gospa",
}  # fmt: skip


def small_suite():
    """Return cars with LOS and NLOS, and one run whose log is changed."""
    los, nlos, *_ = SUITES["paper"].cases
    changed = next(c for c in SUITES["robustness"].cases if c.change is range_outliers)
    return Suite(name="small", title="Small", cases=(los, nlos, changed), seeds=2, seconds=15.0)


@pytest.fixture(scope="module")
def result():
    return evaluate(suite=small_suite(), filters=("ekf-mds", "paper-ekf"))


def test_rows_have_all_figures(result):
    assert [(r["case"], r["filter"]) for r in result.records] == [
        (case, name)
        for case in ("cars-los", "cars-nlos", "range-outliers")
        for name in ("ekf-mds", "paper-ekf")
    ]
    for row in result.records:
        assert set(row) >= KEYS
        assert row["seeds"] == 2
        assert row["us_per_round"] > 0.0
        # Errors beyond the cut-off count as the cut-off, and paper-ekf has many.
        assert row["gospa"] > (row["rmse_yaw"] if row["filter"] == "ekf-mds" else 0.0)
        assert 0.0 < row["bound_shape"] < row["bound_yaw"] < row["bound"] < 1.0
    assert [r["paper"] for r in result.records] == [None, 0.396, None, 0.428, None, None]


def test_targets_are_what_is_asked_or_near_the_bound():
    figures = {"rmse_yaw": 0.08, "bound_yaw": 0.07, "rmse_shape": 0.05, "bound_shape": 0.02}
    yaw, shape = outcomes({"rmse_yaw": 0.05, "rmse_shape": 0.03}, figures)
    assert (yaw.limit, yaw.by_bound, yaw.met) == (pytest.approx(0.077), True, False)
    assert (shape.limit, shape.by_bound, shape.met) == (0.03, False, False)
    assert outcomes({"rmse_shape": 0.05}, figures)[0].met
    (unknown,) = outcomes({"rmse_yaw": 0.05}, {"rmse_yaw": None, "bound_yaw": None})
    assert (unknown.limit, unknown.met) == (0.05, False)


def test_rows_tell_the_targets(result):
    asked = [[(t["figure"], t["asked"]) for t in r["targets"]] for r in result.records]
    assert asked == [[("rmse_shape", 0.093)], [], [("rmse_shape", 0.102)], [], [], []]
    names = [row[:3] for row in target_rows(result)]
    assert names == [[case, "ekf-mds", "rmse_shape"] for case in ("cars-los", "cars-nlos")]


def test_rows_are_medians_and_sums_of_runs(result):
    row, case = result.records[0], result.cases[0]
    assert [r.seed for r in case.runs] == [0, 1]
    assert row["rmse"] == pytest.approx(np.mean([r.rmse for r in case.runs]))
    ratios = [r.rmse_yaw / r.bound_yaw for r in case.runs]
    assert row["ratio_bound"] == pytest.approx(np.mean(ratios))
    assert row["lost_runs"] == sum(r.lost_s is not None for r in case.runs)
    assert len(result.run_records) == 3 * 2 * 2


def test_cars_that_come_and_go_are_scored_by_gospa():
    case = next(c for c in SUITES["robustness"].cases if c.name == "come-and-go")
    suite = Suite(name="small", title="Small", cases=(case,), seeds=3, seconds=60.0)
    [row] = evaluate(suite=suite, filters=("joint",)).records
    assert row["bound"] is None
    # A node that left stays for a while, and a new one is missing at first: half a square metre
    # each, and at most three pairs.
    assert row["rmse"] < row["gospa"] < np.sqrt(1.5)


def test_figures_do_not_depend_on_the_number_of_jobs(result):
    shared = evaluate(suite=small_suite(), filters=("ekf-mds", "paper-ekf"), jobs=2)
    for alone, other in zip(result.run_records, shared.run_records, strict=True):
        assert alone.pop("us_per_round") > 0.0
        assert other.pop("us_per_round") > 0.0
        assert alone == other
    for mine, theirs in zip(result.cases, shared.cases, strict=True):
        for a, b in zip(mine.runs, theirs.runs, strict=True):
            np.testing.assert_array_equal(a.over_time.error, b.over_time.error)


def test_a_recorded_run_is_that_of_relpos_simulate():
    case = SUITES["paper"].cases[1]
    log, same = case.log(4, 15.0), simulate(scenario="cars-nlos", seconds=15.0, seed=4)
    np.testing.assert_array_equal(log.block.values, same.block.values)


def test_command_line_writes_a_report_and_rows(tmp_path):
    args = ("--seconds", 15, "--seeds", 1, "--suite", "scaling", "--filter", "ekf")
    done = relpos("evaluate", *args, "--json", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [r["nodes"] for r in rows] == [2, 3, 4, 6, 8, 10]
    lines = (tmp_path / "out" / "results.jsonl").read_text().splitlines()
    kept = [json.loads(line) for line in lines]
    assert kept[: len(rows)] == rows
    assert [r["seed"] for r in kept[len(rows) :]] == [0] * 6
    pictures = {p.name for p in (tmp_path / "out").glob("*.svg")}
    assert len(pictures) == 5
    assert "evaluate-scaling.svg" in pictures
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("data:image/svg+xml;base64") == 5
    again = relpos("evaluate", *args, "--out", tmp_path / "out")
    assert again.returncode == 2
    assert "exists already, expected a new or empty folder" in again.stderr


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--suite", "moon"], "--suite: expected one of paper, robustness, scaling, got 'moon'"),
        (
            ["--filter", "joint", "--filter", "magic"],
            "--filter: expected one of joint, ekf-mds, ekf",
        ),
        (["--filter", ""], "--filter: expected one of"),
        (["--seeds", "0"], "--seeds: expected 1 to 100000, got 0"),
        (["--jobs", "0"], "--jobs: expected 1 to 1024, got 0"),
        (["--seconds", "12"], "--seconds: expected 15 to 1800, got 12"),
        (["--seconds", "nan"], "--seconds: expected 15 to 1800"),
        (["--seeds", "two"], "--seeds"),
    ],
)  # fmt: skip
def test_faults_end_in_one_line_and_write_nothing(args, message, tmp_path):
    done = relpos("evaluate", *args, "--out", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_the_function_refuses_like_the_command():
    with pytest.raises(UsageError, match="--filter: expected names of"):
        evaluate(filters=())


def test_suites_are_sound():
    assert list(SUITES) == ["paper", "robustness", "scaling"]
    for suite in SUITES.values():
        names = [c.name for c in suite.cases]
        assert len(set(names)) == len(names)
        assert all(c.about for c in suite.cases)
    assert [c.scenario.n_cars for c in SUITES["scaling"].cases] == [2, 3, 4, 6, 8, 10]


@pytest.fixture(scope="module")
def log():
    return record(CARS_NLOS, seconds=24.0, seed=1)


def test_changes_change_what_they_say(log):
    rng = np.random.default_rng(0)
    kind, node = log.block.kind[0], log.block.i[0]
    ranges = kind == Kind.RANGE

    plain = without_powers(log, rng).block
    assert not plain.has_power.any()
    assert not plain.values[0, ranges, 1:].any()
    np.testing.assert_array_equal(plain.values[0, ranges, 0], log.block.values[0, ranges, 0])

    silent = imu_dropout(log, rng).block
    gap = np.diff(silent.t[0, (silent.kind[0] == Kind.IMU) & (silent.i[0] == 0)]).max()
    assert gap == pytest.approx(10.0, abs=0.03)
    assert log.block.n_events - silent.n_events == pytest.approx(2 * 1000, abs=4)

    turned = heading_error(log, rng).block.values[0]
    mine = (kind == Kind.MAG) & (node == 0)
    before, after = log.block.values[0, mine], turned[mine]
    angle = np.arctan2(after[:, 1], after[:, 0]) - np.arctan2(before[:, 1], before[:, 0])
    np.testing.assert_allclose((np.degrees(angle) + 180.0) % 360.0 - 180.0, 5.0)
    np.testing.assert_array_equal(turned[~mine], log.block.values[0, ~mine])

    late = clock_offset(log, rng).block
    assert (np.diff(late.t[0]) >= 0.0).all()
    for k, offset in ((0, CLOCK_OFFSET), (1, 0.0)):
        before = log.block.t[0, (kind == Kind.IMU) & (node == k)]
        after = late.t[0, (late.kind[0] == Kind.IMU) & (late.i[0] == k)]
        np.testing.assert_allclose(after, before + offset)
    late_ranges = late.values[0, late.kind[0] == Kind.RANGE]
    np.testing.assert_array_equal(late_ranges, log.block.values[0, ranges])

    wild = range_outliers(log, rng).block.values[0, ranges, 0]
    hit = wild != log.block.values[0, ranges, 0]
    assert hit.mean() == pytest.approx(0.02, abs=0.01)
    assert wild[hit].min() > 0.0
    assert wild.max() <= OUTLIER_SPAN


def test_cars_can_start_on_a_line():
    start = replace(CARS_NLOS, in_line=True).start(np.random.default_rng(0))
    assert np.ptp(start[:, 0]) == 0.0
    assert np.diff(start[:, 1]).min() > 2.0 * CARS_NLOS.car.length


def estimate_of(error, status=Status.OK):
    """Return two nodes 2 m apart with a given estimation error, at 10 Hz from second 1 on."""
    constellation = Constellation(nodes=tuple(NodeConfig(id=k) for k in range(2)), dimensions=2)
    error = np.asarray(error, dtype=np.float64)
    estimate = TeamEstimate.empty(constellation, 1.0 + 0.1 * np.arange(len(error)))
    truth = np.zeros_like(estimate.pos_ij_w)
    truth[..., 0] = 2.0
    estimate.pos_ij_w[:] = truth
    estimate.pos_ij_w[:, 0, 1] += error
    estimate.cov[..., :, :] = 0.25 * np.eye(6)
    estimate.status[:] = np.asarray(status)[..., None]
    return estimate, truth, np.ones(truth.shape[:2], dtype=bool)


def test_a_run_is_lost_when_wrong_for_more_than_a_second():
    wrong = np.zeros(200)
    wrong[50:60] = 1.5
    assert lost_at(*estimate_of(wrong), first=1.0) is None
    wrong[50:62] = 1.5
    assert lost_at(*estimate_of(wrong), first=1.0) == pytest.approx(7.0)
    wrong[55] = 0.5
    assert lost_at(*estimate_of(wrong), first=1.0) is None


def test_before_it_has_converged_a_run_is_not_lost_but_it_must():
    wrong = np.zeros(200)
    wrong[:60] = 1.5
    status = np.full(200, Status.AMBIGUOUS)
    status[70:] = Status.OK
    assert lost_at(*estimate_of(wrong, status), first=1.0) is None
    status[:] = Status.STARTING
    # Ten seconds after the first range without an estimate, and one more.
    assert lost_at(*estimate_of(0.0 * wrong, status), first=1.0) == pytest.approx(12.0)


def test_over_time_takes_means_in_bins():
    estimate, truth, known = estimate_of(np.full(100, 0.5))
    estimate.nis[50:, 0] = 3.1
    line = over_time(estimate, truth, known, 0.0, 11.0)
    assert np.isnan(line.error[:2]).all()
    np.testing.assert_allclose(line.error[2:], 0.5)
    # 0.5 m of error along one of two axes with a standard deviation of 0.5 m each.
    np.testing.assert_allclose(line.nees[2:], 0.5)
    assert line.nis_counts.sum() == 1
    assert line.nis_counts[np.searchsorted(NIS_EDGES, 3.1) - 1] == 1
