"""Tracker on recordings of real sensors, against their reference measurements."""

import csv
import gzip
from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.track import track_log
from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.constellation import Constellation, NodeConfig
from tracking.filters import FILTERS
from tracking.filters.joint.params import JointParams
from tracking.filters.params import FilterParams
from tracking.findings import examine
from tracking.geometry import quat_conjugate, quat_multiply
from tracking.log import read_log
from tracking.measurements import Kind, MeasurementBlock
from tracking.metrics.bound import recorded_bound
from tracking.tracker import TrackerParams

LOGS = ("isas_walk1", "inrol_env1", "tiers_run01", "tiers_short")


@pytest.fixture(scope="module")
def results(data):
    checked = {name: examine(read_log(data / "logs" / name)) for name in LOGS}
    return {
        (name, filter_name): track_log(log, filter=filter_name, findings=found)
        for name, (log, found) in checked.items()
        for filter_name in FILTERS
    }


def test_every_log_gives_finite_figures(results):
    for (name, filter_name), result in results.items():
        summary = result.summary
        for key in ("rmse", "rmse_yaw", "yaw_deg", "rmse_shape", "nees", "nis"):
            assert summary[key] is not None, (name, filter_name, key)
            assert np.isfinite(summary[key])
        assert np.isfinite(result.estimate.pos_ij_w).all()


MIRRORED = pytest.mark.xfail(
    strict=True, reason="a mirror image is likelier by 10: 1.32 m; with half of them lost 0.34 m"
)


@pytest.mark.parametrize(
    ("name", "limit"), [pytest.param("isas_walk1", 0.30, marks=MIRRORED), ("inrol_env1", 0.20)]
)
def test_mds_keeps_the_shape(results, name, limit):
    assert results[name, "ekf-mds"].score.rmse_shape <= limit


@pytest.mark.parametrize("name", ["isas_walk1", "inrol_env1"])
def test_mds_is_better_than_filters_alone(results, name):
    refined = results[name, "ekf-mds"].score
    alone = results[name, "ekf"].score
    for figure in ("rmse", "rmse_yaw", "rmse_shape"):
        assert getattr(refined, figure) < getattr(alone, figure)


def test_one_filter_over_all_nodes_follows_a_hand_among_reflections(results):
    """Only measurements are used; at most 10 s are not scored."""
    found = results["inrol_env1", "joint"].score
    assert found.rmse <= 0.25
    assert found.rmse_shape <= 0.122
    assert found.ok_share >= 0.95


def test_ranges_of_radios_that_were_not_calibrated_are_found_to_be_long(data):
    """They are 0.36 m too long, of which a filter attributes a part to obstacles."""
    [found] = [f for f in examine(read_log(data / "logs" / "tiers_short"))[1] if "offset" in f.name]
    assert 0.2 < float(found.text.split(" when ")[1].split(" m shorter")[0]) < 0.4


LATE = pytest.mark.xfail(strict=True, reason="it takes 12 s to find the heading: 0.18 m")
DRIFTS = pytest.mark.xfail(
    strict=True, reason="its heading drifts by 7 degrees in three minutes: 0.177 and 0.153 m"
)


@pytest.mark.parametrize(
    "limit", [pytest.param(0.15, marks=LATE), pytest.param(0.165, marks=DRIFTS), 0.18]
)
def test_it_does_so_from_ten_seconds_on(results, limit):
    assert results["inrol_env1", "joint"].score.rmse_yaw <= limit


@pytest.mark.parametrize("limit", [pytest.param(0.15, marks=DRIFTS), 0.16])
def test_once_it_is_found_how_the_group_is_turned_it_is_so_for_good(data, limit):
    found = track_log(data / "logs" / "inrol_env1", skip=20.0).score
    assert found.rmse_yaw <= limit


@pytest.fixture(scope="module")
def settled_walk(data):
    """Score the walk once the rotation of the group is found; OK up to a metre."""
    params = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=1.0)))
    return track_log(data / "logs" / "isas_walk1", skip=20.0, params=params).score


def test_a_walk_is_followed_once_it_is_found_how_the_group_is_turned(settled_walk):
    assert settled_walk.rmse_yaw <= 0.27
    assert settled_walk.ok_share >= 0.95


@pytest.mark.xfail(strict=True, reason="its layout leans by 10 to 25 degrees at first: 0.1300 m")
def test_its_shape_is_too(settled_walk):
    """An unmeasured rotation met the limit by chance, as other initial headings showed."""
    assert settled_walk.rmse_shape <= 0.13


def test_recordings_are_near_what_their_ranges_allow(data):
    """The bound is for the noise of their ranges according to truth."""
    log = read_log(data / "logs" / "inrol_env1")
    found = track_log(log, bound=recorded_bound(log))
    for name, least in found.expected.items():
        assert getattr(found.score, name) < 1.25 * least, name


def test_gross_outliers_are_refused(results):
    """One fixed node of the walk has ranges that are metres too long."""
    assert results["isas_walk1", "ekf-mds"].n_rejected > 0


BROAD = {
    "02_undisturbed_slow_rotation_B": (0.40, 0.59),
    "16_undisturbed_fast_translation_B": (0.58, 0.50),
    "24_disturbed_tapping_A": (0.55, 0.90),
    "34_disturbed_attached_magnet_3cm": (0.63, 2.94),
}


@pytest.mark.parametrize("trial", BROAD)
def test_orientation_figures_of_broad(data, trial):
    """Compare inclination RMSE and heading error std [deg] of VQF with its default parameters."""
    with gzip.open(data / "imu_orientation" / f"{trial}.csv.gz", "rt") as file:
        rows = list(csv.DictReader(file))

    def columns(*names):
        return np.array([[float(r[n] or "nan") for n in names] for r in rows])

    n = len(rows)
    node = np.zeros(n, dtype=np.int64)
    t = np.arange(n) / 285.714
    imu = columns("gx", "gy", "gz", "ax", "ay", "az")
    mag = columns("mx", "my", "mz")
    block = MeasurementBlock.concatenate(
        [
            MeasurementBlock.of_kind(Kind.IMU, t, node, imu),
            MeasurementBlock.of_kind(Kind.MAG, t, node, mag),
        ]
    ).sorted()
    nodes = (NodeConfig(id=1, vehicle="hand", imu_hz=285.714), NodeConfig(id=2))
    out = Orientation(Constellation(nodes=nodes), OrientationParams()).step(block)
    q = out.values[0, out.valid[0] & (out.kind[0] == Kind.STATE), :4]
    truth = columns("qw", "qx", "qy", "qz")
    scored = np.isfinite(truth).all(axis=1) & (columns("moving")[:, 0] == 1.0)
    error = quat_multiply(q, quat_conjugate(truth))[scored]
    heading = 2.0 * np.arctan2(error[:, 3], error[:, 0])
    inclination = 2.0 * np.arccos(np.clip(np.hypot(error[:, 0], error[:, 3]), 0.0, 1.0))
    heading = np.angle(np.exp(1j * heading))
    heading = np.angle(np.exp(1j * (heading - np.angle(np.mean(np.exp(1j * heading))))))
    figures = np.degrees([np.sqrt(np.mean(inclination**2)), np.std(heading)])
    np.testing.assert_allclose(figures, BROAD[trial], atol=0.02)


@pytest.mark.parametrize("name", ["isas_walk1", "inrol_env1"])
@pytest.mark.parametrize("late", [1.0, -2.0])
def test_an_imu_on_another_clock_is_refused(data, name, late):
    """So far off, likelihoods have no slope towards the right clock."""
    log = read_log(data / "logs" / name)
    t = log.block.t + late * np.isin(log.block.kind, (Kind.IMU, Kind.MAG))
    moved = replace(log.block, t=t)
    _, found = examine(replace(log, block=moved.take(moved.order()[0])))
    assert [f.name for f in found if f.severity == "error"] == ["clock-offset"]


def test_an_image_that_one_pass_never_finds_is_not_ok_in_hindsight(data):
    """The path of this rig stays in a plane: the backward pass would be wrong in its first half."""
    log, found = examine(read_log(data / "logs" / "starloc_fast1"))
    for smooth in (None, "all"):
        result = track_log(log, findings=found, smooth=smooth)
        assert result.score.integrity_share <= 0.01
        assert "degenerate-motion" in {f.name for f in result.findings}
