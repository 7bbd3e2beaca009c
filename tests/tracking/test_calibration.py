"""Calibration: known errors are found and corrected, and poor data is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tracking.calibration import (
    Calibration,
    CalibrationError,
    NodeCalibration,
    RangeCalibration,
    RangeTable,
    calibrate_imu,
    calibrate_magnetometer,
    calibrate_uwb,
    calibration_toml,
    merge,
    range_table,
    read_calibration,
)
from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.errors import ConfigError
from tracking.log import Truth
from tracking.measurements import Kind, MeasurementBlock

FIELD_W = np.array([0.0, 20.0, -43.0])
SIX = [[0, 0, 0], [180, 0, 0], [90, 0, 0], [-90, 0, 0], [0, 90, 0], [0, -90, 0]]
GYR, ACC = np.array([0.01, -0.02, 0.005]), np.array([0.2, -0.15, 0.1])
SCALE = np.array([1.01, 0.99, 1.005])


def rng(seed=0):
    return np.random.default_rng(seed)


# Gyroscope and accelerometer


def rests(degrees, noise=0.0, scale=SCALE, seconds=3.0, seed=0):
    """Return poses at rest, each followed by a second of shaking."""
    draw, parts = rng(seed), []
    for euler in degrees:
        force = Rotation.from_euler("xyz", euler, degrees=True).inv().apply([0.0, 0.0, 9.81])
        still = np.tile([*GYR, *(force / scale + ACC)], (int(100 * seconds), 1))
        spread = noise * np.repeat([5e-4, 5e-3], 3)
        parts.append(still + spread * draw.standard_normal(still.shape))
        parts.append(still[:1] + draw.normal(size=(100, 6)) * np.repeat([0.5, 1.0], 3))
    imu = np.concatenate(parts)
    return np.arange(len(imu)) / 100.0, imu


def test_six_poses_give_offset_and_scale():
    exact = calibrate_imu(*rests(SIX))
    assert (exact.acc_method, exact.n_poses, exact.n_seen) == ("full", 6, 3)
    np.testing.assert_allclose(exact.calibration.gyr_offset, GYR, atol=1e-12)
    np.testing.assert_allclose(exact.calibration.acc_offset, ACC, atol=1e-9)
    np.testing.assert_allclose(exact.calibration.acc_scale, SCALE, atol=1e-9)
    noisy = calibrate_imu(*rests(SIX, noise=1.0))
    assert (np.abs(noisy.calibration.gyr_offset - GYR) < 5.0 * noisy.gyr_se).all()
    np.testing.assert_allclose(noisy.calibration.acc_offset, ACC, atol=2e-3)
    assert noisy.residual_after < 1e-3 < noisy.residual_before


def test_rest_is_found_where_it_is():
    rest = calibrate_imu(*rests(SIX, noise=1.0)).rest
    assert len(rest.n) == 6
    np.testing.assert_allclose(rest.span[:, 1] - rest.span[:, 0], 3.0, atol=0.6)
    np.testing.assert_allclose(rest.span[:, 0], 4.0 * np.arange(6), atol=0.3)


def test_one_pose_shows_the_part_along_gravity_only():
    found = calibrate_imu(*rests([[0, 0, 0]], scale=np.ones(3)))
    assert (found.acc_method, found.n_seen) == ("partial", 1)
    assert found.calibration.acc_scale is None
    length = np.linalg.norm(ACC + [0.0, 0.0, 9.81])
    assert np.linalg.norm(found.calibration.acc_offset) == pytest.approx(length - 9.81)
    level = calibrate_imu(*rests([[0, 0, 0]], scale=np.ones(3)), level=True)
    np.testing.assert_allclose(level.calibration.acc_offset, ACC, atol=1e-9)


def test_poses_that_are_alike_do_not_make_a_full_fit():
    alike = [[10 * k - 35, 12 * (k % 3), 0] for k in range(8)]
    found = calibrate_imu(*rests(alike))
    assert found.acc_method == "partial"


def test_a_slow_turn_is_no_rest():
    t, imu = rests([[0, 0, 0]] * 3)
    imu[400:700, 2] += 0.05
    found = calibrate_imu(t, imu)
    assert len(found.rest.n) == 2
    np.testing.assert_allclose(found.calibration.gyr_offset, GYR, atol=1e-12)


def shaken():
    t, imu = rests([[0, 0, 0]])
    return t, imu + rng().normal(size=imu.shape)


def dead():
    t, imu = rests([[0, 0, 0]])
    imu[:, 3:] = 0.0
    return t, imu


@pytest.mark.parametrize(
    ("data", "level", "reason"),
    [
        (shaken(), False, "0.0 s at rest"),
        (rests([[0, 0, 0]], seconds=0.6), False, "0.0 s at rest"),
        ((np.arange(5) / 100.0, np.zeros((5, 6))), False, "at rest"),
        (rests([[20, 0, 0]]), True, "tilted by 19 degrees"),
        (rests([[0, 0, 0]], scale=np.full(3, 9.81)), False, "is it in m/s2"),
        (rests(SIX, scale=np.array([1.3, 1.0, 1.0])), False, "scales"),
        (dead(), False, "0 m/s2 at rest, expected gravity"),
    ],
)
def test_poor_inertial_data_is_refused(data, level, reason):
    with pytest.raises(CalibrationError, match=reason):
        calibrate_imu(*data, level=level)


# Magnetometer


def turned(seed, soft, hard, n=1500):
    body = Rotation.random(n, rng=rng(seed)).inv().apply(FIELD_W)
    return body @ soft.T + hard


@settings(max_examples=15)
@given(
    parts=st.lists(st.floats(-0.15, 0.15), min_size=6, max_size=6),
    hard=st.tuples(*[st.floats(-80.0, 80.0)] * 3),
    seed=st.integers(0, 1000),
)
def test_any_iron_is_undone(parts, hard, seed):
    soft = np.eye(3)
    soft[np.triu_indices(3)] += parts
    soft = 0.5 * (soft + soft.T)
    soft /= np.cbrt(np.linalg.det(soft))
    found = calibrate_magnetometer(turned(seed, soft, np.array(hard), 600), rng=rng(seed))
    assert found.method == "ellipsoid"
    np.testing.assert_allclose(found.calibration.mag_offset, hard, atol=1e-6)
    np.testing.assert_allclose(found.calibration.mag_matrix, np.linalg.inv(soft), atol=1e-7)
    assert found.field == pytest.approx(np.linalg.norm(FIELD_W))


def test_noise_and_outliers_do_little():
    soft, hard = np.diag([1.1, 0.95, 1.0 / (1.1 * 0.95)]), np.array([15.0, -8.0, 22.0])
    mag = turned(1, soft, hard) + 0.35 * rng(2).standard_normal((1500, 3))
    mag[::20] += rng(3).normal(0.0, 100.0, (75, 3))
    found = calibrate_magnetometer(mag, rng=rng())
    np.testing.assert_allclose(found.calibration.mag_offset, hard, atol=0.1)
    np.testing.assert_allclose(found.calibration.mag_matrix, np.linalg.inv(soft), atol=0.01)
    assert found.inlier[::20].mean() < 0.1
    assert found.residual_after < 0.01 < found.residual_before


def ring(angles, axis=(0.0, 0.0, 1.0), soft=(1.1, 0.95, 1.0)):
    turn = Rotation.from_rotvec(angles[:, None] * np.array(axis))
    return turn.inv().apply(FIELD_W) * soft + [5.0, -3.0, 2.0]


def test_a_car_that_turns_on_the_spot():
    found = calibrate_magnetometer(ring(np.linspace(0.0, 12.0, 800)), rng=rng())
    assert found.method == "ellipse"
    np.testing.assert_allclose(found.calibration.mag_offset, [5.0, -3.0, 0.0], atol=1e-6)
    mean = np.sqrt(1.1 * 0.95)
    expected = np.diag([mean / 1.1, mean / 0.95, 1.0])
    np.testing.assert_allclose(found.calibration.mag_matrix, expected, atol=1e-7)
    half = calibrate_magnetometer(ring(np.linspace(0.0, 4.0, 800), soft=np.ones(3)), rng=rng())
    assert half.method == "circle"
    np.testing.assert_allclose(half.calibration.mag_offset, [5.0, -3.0, 0.0], atol=1e-6)
    assert half.calibration.mag_matrix is None


def cap():
    mag = turned(0, np.eye(3), np.zeros(3), 4000)
    return mag[mag[:, 2] > 0.0]


@pytest.mark.parametrize(
    ("mag", "reason"),
    [
        (np.zeros((20, 3)), "20 magnetometer readings"),
        (FIELD_W + 0.4 * rng().standard_normal((500, 3)), "hardly turned"),
        (cap(), "% of all directions seen"),
        (ring(np.linspace(0.0, 1.0, 500)), "% of a turn seen|hardly turned"),
        (ring(np.linspace(0.0, 12.0, 500), axis=(1.0, 0.0, 0.0)), "about one axis only"),
        (turned(0, np.diag([3.0, 1.0, 1.0]), np.zeros(3)), "axes of the ellipsoid differ"),
        (turned(0, 0.01 * np.eye(3), np.zeros(3)), "are the readings in uT"),
        (turned(0, np.eye(3), np.zeros(3)) * rng().uniform(0.5, 1.5, (1500, 1)), "varies by"),
    ],
    ids=["few", "still", "half a sphere", "arc", "wrong axis", "flat", "gauss", "uneven"],
)
def test_poor_magnetometer_data_is_refused(mag, reason):
    with pytest.raises(CalibrationError, match=reason):
        calibrate_magnetometer(mag, rng=rng())


# Ranges


def table(n=2000, nodes=4, slope=1.03, offset=(0.2, 0.1, -0.1, 0.3), noise=0.0, nlos=0.0,
          spread=(0.5, 7.5), star=False):  # fmt: skip
    draw = rng(4)
    i = np.zeros(n, dtype=np.int64) if star else draw.integers(0, nodes, n)
    j = (i + draw.integers(1, nodes, n)) % nodes
    d = draw.uniform(*spread, n)
    z = slope * d + np.array(offset)[i] + np.array(offset)[j] + noise * draw.standard_normal(n)
    late = draw.random(n) < nlos
    z[late] += draw.uniform(0.4, 2.5, late.sum())
    return RangeTable(np.arange(n) / 100.0, i, j, z, d, np.ones(n, dtype=bool)), late


def test_slope_and_delays_are_found():
    found = calibrate_uwb(table()[0], (7, 8, 9, 11), random_state=0)
    assert found.slope_fitted
    assert found.separable
    assert found.calibration.slope == pytest.approx(1.03, abs=1e-12)
    assert found.calibration.offset == pytest.approx({7: 0.2, 8: 0.1, 9: -0.1, 11: 0.3}, abs=1e-12)
    assert np.abs(found.error_after).max() < 1e-12
    assert found.inlier.all()


def test_ranges_behind_obstacles_do_not_count():
    data, late = table(noise=0.06, nlos=0.35)
    found = calibrate_uwb(data, (1, 2, 3, 4), random_state=0)
    assert found.calibration.slope == pytest.approx(1.03, abs=0.003)
    assert found.calibration.offset == pytest.approx({1: 0.2, 2: 0.1, 3: -0.1, 4: 0.3}, abs=0.02)
    assert found.inlier[late].mean() < 0.01
    assert found.inlier_share == pytest.approx(0.65, abs=0.03)
    assert found.residual_std == pytest.approx(0.06, abs=0.005)
    again = calibrate_uwb(data, (1, 2, 3, 4), random_state=0)
    assert again.calibration == found.calibration


def test_two_nodes_share_their_sum_evenly():
    found = calibrate_uwb(table(nodes=2)[0], (1, 2), random_state=0)
    assert not found.separable
    assert found.calibration.offset == pytest.approx({1: 0.15, 2: 0.15})


def test_a_star_has_right_sums():
    found = calibrate_uwb(table(star=True)[0], (1, 2, 3, 4), random_state=0)
    assert not found.separable
    b = found.calibration.offset
    assert [b[1] + b[k] for k in (2, 3, 4)] == pytest.approx([0.3, 0.1, 0.5])


def test_one_distance_gives_offsets_only():
    found = calibrate_uwb(table(slope=1.0, spread=(3.0, 3.5))[0], (1, 2, 3, 4), random_state=0)
    assert not found.slope_fitted
    assert found.calibration.slope == 1.0
    assert found.calibration.offset == pytest.approx({1: 0.2, 2: 0.1, 3: -0.1, 4: 0.3})


def test_a_node_with_a_handful_of_agreeing_ranges_has_no_offset():
    """Its ranges are NLOS with an error that varies all the time."""
    data = table(nodes=5, slope=1.0, offset=(0.2, 0.1, -0.1, 0.3, 0.1))[0]
    measured = data.measured.copy()
    of_last = np.flatnonzero((data.i == 4) | (data.j == 4))
    measured[of_last[5:]] += rng().uniform(1.0, 15.0, len(of_last) - 5)
    spoiled = replace(data, measured=measured)
    found = calibrate_uwb(spoiled, (1, 2, 3, 4, 5), random_state=0)
    assert found.calibration.offset == pytest.approx({1: 0.2, 2: 0.1, 3: -0.1, 4: 0.3}, abs=0.01)
    assert not found.used[of_last].any()


@pytest.mark.parametrize("b", [-1.4, 1.4])
def test_offsets_that_no_antenna_has_are_refused(b):
    """Exchanged marks of two boards fit three boards exactly."""
    with pytest.raises(
        CalibrationError, match=r"node 9: an offset of -?1\.40 m, expected within 1"
    ):
        calibrate_uwb(table(offset=(0.2, 0.1, b, 0.3))[0], (7, 8, 9, 11), random_state=0)


def unknown():
    data = table()[0]
    return replace(data, known=np.zeros(2000, dtype=bool))


def scattered():
    data = table()[0]
    measured = rng().uniform(0.0, 40.0, 2000)
    return replace(data, measured=measured)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (unknown(), "no range has a true distance"),
        (table(n=80)[0], "80 ranges have"),
        (table(spread=(9.0, 12.0))[0], "0 ranges have a true distance up to 8 m"),
        (scattered(), "% of the ranges agree|no line agrees"),
        (table(slope=1.3)[0], "a slope of 1.3"),
    ],
)
def test_poor_ranges_are_refused(data, reason):
    with pytest.raises(CalibrationError, match=reason):
        calibrate_uwb(data, (1, 2, 3, 4), random_state=0)


def test_antennas_are_turned_with_their_nodes():
    constellation = Constellation(
        nodes=(NodeConfig(id=1), NodeConfig(id=2)),
        antennas=(Antenna(id=5, node=1, offset_b=(0.5, 0.0, 0.0)),),
    )
    t = np.arange(5.0) / 10.0
    yaw = np.linspace(0.0, 1.0, 5)
    q = np.stack([np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)], axis=1)
    both = np.tile([True, False], 5)
    pos = np.zeros((10, 3))
    pos[1::2, 0] = 4.0
    quat = np.zeros((10, 4))
    quat[::2] = q
    truth = Truth(np.repeat(t, 2), np.tile([0, 1], 5), pos, quat, both, np.ones(10, dtype=bool))
    n = np.zeros(5, dtype=np.int64)
    block = MeasurementBlock.of_kind(
        Kind.RANGE, t, n, np.ones((5, 1)), j=n + 1, antennas=(n, n + 1)
    )
    found = range_table(block, constellation, truth)
    expected = np.hypot(4.0 - 0.5 * np.cos(yaw), 0.5 * np.sin(yaw))
    np.testing.assert_allclose(found.true, expected)
    blind = Truth(truth.t, truth.node, pos, quat, np.zeros(10, dtype=bool), truth.valid)
    assert not range_table(block, constellation, blind).known.any()


# Calibrations and their files


def vectors(most):
    return st.tuples(*[st.floats(-most, most)] * 3)


small = st.floats(-0.2, 0.2)
matrix = st.tuples(*[st.tuples(small, small, small)] * 3).map(
    lambda m: tuple(tuple(v + (r == c) for c, v in enumerate(row)) for r, row in enumerate(m))
)
scales = st.tuples(*[st.floats(0.5, 2.0)] * 3)
node = st.builds(
    NodeCalibration,
    gyr_offset=st.none() | vectors(1.0),
    acc_offset=st.none() | vectors(5.0),
    acc_scale=st.none() | scales,
    mag_offset=st.none() | vectors(50.0),
    mag_matrix=st.none() | matrix,
)
ids = st.integers(0, 2**16)
calibrations = st.builds(
    Calibration,
    nodes=st.dictionaries(ids, node, max_size=4),
    ranges=st.none()
    | st.builds(
        RangeCalibration,
        slope=st.floats(0.5, 2.0),
        offset=st.dictionaries(ids, st.floats(-10.0, 10.0)),
    ),
)


@settings(max_examples=50)
@given(calibration=calibrations)
def test_what_is_written_reads_back(calibration, tmp_path_factory):
    path = tmp_path_factory.mktemp("file") / "calibration.toml"
    path.write_text(calibration_toml(calibration))
    assert read_calibration(path) == calibration


FAULTS = [
    ("format = 2", "format: expected 1"),
    ("format = 1\nnode = 3", "node: unknown"),
    ("format = 1\n[nodes.1]\ngyr_offset = [0, 0, 0]", "nodes.1.gyr_offset: unknown"),
    ("format = 1\n[nodes.1]\ngyr_offset_rad_s = [0, 0]", "expected three numbers"),
    ("format = 1\n[nodes.1]\ngyr_offset_rad_s = [0, nan, 0]", "expected a number, found nan"),
    ("format = 1\n[nodes.x]\n", "nodes.x: expected a node id"),
    ("format = 1\n[nodes.1]\nmag_matrix = [[0,0,0],[0,0,0],[0,0,0]]", "positive determinant"),
    ("format = 1\n[nodes.1]\nmag_matrix = [1, 1, 1]", "nodes.1.mag_matrix: expected three"),
    ("format = 1\n[nodes.1]\nacc_scale = [1, 1, 9]", "acc_scale: expected numbers from 0.5"),
    ("format = 1\n[nodes.1]\nacc_offset_m_s2 = [500, 0, 0]", "expected numbers up to 5"),
    ("format = 1\n[nodes.1]\ngyr_offset_rad_s = [0, 40, 0]", "expected numbers up to 1"),
    ("format = 1\n[ranges]\nslope = 1\noffset_m = {1 = -180}", "ranges.offset_m.1: expected"),
    ("a = " + 5000 * "[", "not TOML"),
    ("format = 1\nnodes = 3", "nodes: expected a table"),
    ("format = 1\n[ranges]\nslope = 0.0\noffset_m = {}", "ranges.slope: expected 0.5 to 2"),
    ("format = 1\n[ranges]\nslope = 1.0", "ranges.offset_m: expected a table"),
    ("format = 1\n[ranges.offset_m]\n1 = 0.2", "ranges.slope: expected a number"),
    ("format =", "not TOML"),
    ("format = 1\n[ranges]\nslope = 1" + 400 * "0", "ranges.slope: expected a number"),
    ("format = 1\n[ranges]\nslope = 1" + 5000 * "0", "not TOML"),
]


@pytest.mark.parametrize(("text", "message"), FAULTS, ids=lambda v: v[:40].replace("\n", " "))
def test_a_wrong_file_is_named(text, message, tmp_path):
    path = tmp_path / "calibration.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message) as error:
        read_calibration(path)
    assert str(path) in str(error.value)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_calibration(tmp_path)


def test_merging_keeps_all_and_refuses_twice():
    gyr = Calibration(nodes={1: NodeCalibration(gyr_offset=(1.0, 2.0, 3.0))})
    mag = Calibration(nodes={1: NodeCalibration(mag_offset=(4.0, 5.0, 6.0))})
    ranges = Calibration(ranges=RangeCalibration(slope=1.1, offset={1: 0.1}))
    both = merge([gyr, mag, ranges])
    assert both.nodes[1] == NodeCalibration(gyr_offset=(1.0, 2.0, 3.0), mag_offset=(4.0, 5.0, 6.0))
    assert both.ranges == ranges.ranges
    with pytest.raises(ConfigError, match="nodes.1.gyr_offset: given twice"):
        merge([both, gyr])
    with pytest.raises(ConfigError, match="ranges: given twice"):
        merge([both, ranges])


def raw_block(constellation):
    one = np.array([0.5])
    index = lambda k: np.array([k])  # noqa: E731
    of_kind = MeasurementBlock.of_kind
    return MeasurementBlock.concatenate(
        [
            of_kind(Kind.MAG, one, index(0), np.array([[14.0, 5.0, 6.0]])),
            of_kind(Kind.IMU, one, index(0), np.array([[1.0, 2.0, 3.0, 0.0, 0.0, 10.0]])),
            of_kind(Kind.IMU, one, index(1), np.array([[1.0, 2.0, 3.0, 0.0, 0.0, 10.0]])),
            of_kind(Kind.RANGE, one, index(0), np.array([[5.5, -80.0, -85.0]]), j=index(1)),
            of_kind(Kind.RANGE, one, index(1), np.array([[0.2, 0.0, 0.0]]), j=index(0)),
            MeasurementBlock.empty(1, 1),
        ]
    )


def test_correction_of_every_kind():
    constellation = Constellation(nodes=(NodeConfig(id=1), NodeConfig(id=2)))
    block = raw_block(constellation)
    calibration = Calibration(
        nodes={
            1: NodeCalibration(
                gyr_offset=(0.1, 0.2, 0.3),
                acc_offset=(0.0, 0.0, 0.5),
                acc_scale=(1.0, 1.0, 2.0),
                mag_offset=(10.0, 0.0, 0.0),
                mag_matrix=((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            )
        },
        ranges=RangeCalibration(slope=1.25, offset={1: 0.3, 2: 0.2}),
    )
    out = calibration.apply(block, constellation)
    np.testing.assert_allclose(out.values[0, 0, :3], [5.0, 4.0, 6.0])
    np.testing.assert_allclose(out.values[0, 1, :6], [0.9, 1.8, 2.7, 0.0, 0.0, 19.0])
    np.testing.assert_array_equal(out.values[0, 2], block.values[0, 2])
    np.testing.assert_allclose(out.values[0, 3, :3], [4.0, -80.0, -85.0])
    assert out.values[0, 4, 0] == 0.01  # clipped to the least range
    np.testing.assert_array_equal(out.valid, block.valid)
    np.testing.assert_array_equal(block.values[0, 0, :3], [14.0, 5.0, 6.0])
    parts = [calibration.apply(block.take(slice(k, k + 1)), constellation) for k in range(6)]
    np.testing.assert_array_equal(MeasurementBlock.concatenate(parts).values, out.values)
    np.testing.assert_array_equal(Calibration().apply(block, constellation).values, block.values)


def test_a_calibration_must_fit_the_group():
    constellation = Constellation(nodes=(NodeConfig(id=1), NodeConfig(id=2)))
    block = raw_block(constellation)
    other = Calibration(nodes={7: NodeCalibration(gyr_offset=(0.0, 0.0, 0.0))})
    with pytest.raises(ConfigError, match="expected some of the nodes 1, 2, found only 7"):
        other.apply(block, constellation)
    half = Calibration(ranges=RangeCalibration(offset={1: 0.1}))
    with pytest.raises(ConfigError, match="found none of node 2"):
        half.apply(block, constellation)
