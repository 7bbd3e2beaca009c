"""Exports: other tools read the measurements and estimates unchanged."""

import errno

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from hardware_bridge.errors import BridgeError
from hardware_bridge.exports import export_log, export_mcap, export_tum, tum_text
from hardware_bridge.exports.ros_definitions import _FIELDS, definition
from hardware_bridge.exports.whole import whole_file, whole_folder
from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.estimate import Status, TeamEstimate
from tracking.geometry import GRAVITY, quat_from_yaw, quat_multiply, rotate
from tracking.log import read_log
from tracking.measurements import N_VALUES, Kind, MeasurementBlock

GROUP = Constellation(
    nodes=(
        NodeConfig(id=1, vehicle="car"),
        NodeConfig(id=5, vehicle="car"),
        NodeConfig(id=7, kind="static"),
        NodeConfig(id=8, kind="static"),
    ),
    antennas=(Antenna(id=10, node=1, offset_b=(0.1, 0.0, 0.0)),),
)
UTC = 1_760_000_000_123_456_789


def of_kind(kind, t, i, rows, j=None, power=None):
    n = len(t)
    i, j = (None if x is None else np.broadcast_to(np.array(x), n).copy() for x in (i, j))
    first = np.array([0, 1, 2, 3])
    return MeasurementBlock.of_kind(
        kind,
        np.array(t, dtype=float),
        i,
        np.array(rows, dtype=float),
        j=j,
        antennas=None if j is None else (first[i], first[j]),
        has_power=power,
    )


@pytest.fixture
def block():
    t = 100.0 + np.arange(40) / 10.0
    rng = np.random.default_rng(3)
    q, powered = quat_from_yaw(rng.normal(size=40)), np.arange(40) % 2 == 0
    return MeasurementBlock.concatenate(
        [
            of_kind(Kind.RANGE, t, 0, rng.uniform(1, 9, (40, 3)), j=1, power=powered),
            of_kind(Kind.SURVEY, t[:1], 2, [[4.0]], j=3),
            of_kind(Kind.IMU, t, 0, rng.normal(size=(40, 6)) + [0, 0, 0, 0, 0, 9.8]),
            of_kind(Kind.MAG, t, 0, rng.normal(size=(40, 3)) * 30),
            of_kind(Kind.STATE, t + 0.01, 1, np.concatenate([q, rng.normal(size=(40, 3))], axis=1)),
        ]
    )  # fmt: skip


@pytest.fixture
def estimate():
    t = 100.0 + np.arange(30) / 20.0
    e = TeamEstimate.empty(GROUP, t)
    rng = np.random.default_rng(4)
    pos_w = rng.normal(size=(30, 4, 3)) * 3
    vel_w = rng.normal(size=(30, 4, 3))
    i, j = GROUP.pairs.T
    e.pos_ij_w[:], e.vel_ij_w[:] = pos_w[:, j] - pos_w[:, i], vel_w[:, j] - vel_w[:, i]
    root = rng.normal(size=(30, GROUP.n_pairs, 6, 6)) * 0.1
    e.cov[:] = root @ np.swapaxes(root, -1, -2)
    e.q_wb[:] = quat_multiply(
        quat_from_yaw(rng.normal(size=(30, 4))), np.array([0.8, 0.36, 0.48, 0.0])
    )
    e.has_orientation[:, :2] = True
    e.status[:] = Status.OK
    e.status[:5] = Status.STARTING
    e.status[5] = Status.LOST
    e.status[:, GROUP.pair_index[0, 3]] = Status.ABSENT
    return e


def decoded(path):
    """Return lists of (log time, type, message) by topic."""
    found = {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        last = 0
        for schema, channel, message, content in reader.iter_decoded_messages():
            assert message.log_time >= last
            last = message.log_time
            found.setdefault(channel.topic, []).append((last, schema.name, content))
        statistics = reader.get_summary().statistics
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    return found, statistics.message_count, metadata


def vector(v):
    return np.array([v.x, v.y, v.z])


def wxyz(q):
    return np.array([q.w, q.x, q.y, q.z])


def test_mcap_holds_every_measurement(block, tmp_path):
    path = tmp_path / "new" / "run.mcap"
    n = export_mcap(path, block, GROUP, offset_ns=UTC, notes={"name": "run"})
    found, count, metadata = decoded(path)
    assert n == count == block.n_events
    assert metadata == {"relpos": {"name": "run"}}
    kind, values = block.kind[0], block.values[0]

    raw = found["/node_1/imu/data_raw"]
    for (t, type_, m), row, k in zip(raw, values[kind == Kind.IMU], range(40), strict=True):
        assert type_ == "sensor_msgs/msg/Imu"
        assert t == UTC + 100_000_000_000 + k * 100_000_000
        assert m.header.stamp.sec * 10**9 + m.header.stamp.nanosec == t
        assert m.header.frame_id == "node_1"
        assert np.array_equal(vector(m.angular_velocity), row[:3])
        assert np.array_equal(vector(m.linear_acceleration), row[3:6])
        assert m.orientation_covariance[0] == -1.0
    mag = [vector(m.magnetic_field) for _, _, m in found["/node_1/imu/mag"]]
    assert np.allclose(mag, values[kind == Kind.MAG, :3] * 1e-6, rtol=1e-12)
    for (_, _, m), row in zip(found["/node_5/imu/data"], values[kind == Kind.STATE], strict=True):
        assert np.array_equal(wxyz(m.orientation), row[:4])
        back = rotate(wxyz(m.orientation), vector(m.linear_acceleration)) - [0, 0, GRAVITY]
        assert np.allclose(back, row[4:7], atol=1e-12)
        assert m.angular_velocity_covariance[0] == -1.0

    survey, *ranges = sorted((m for _, _, m in found["/uwb/ranges"]), key=lambda m: -m.surveyed)
    assert (survey.node_i, survey.node_j, survey.range) == (7, 8, 4.0)
    assert [m.range for m in ranges] == values[kind == Kind.RANGE, 0].tolist()
    assert {(m.node_i, m.node_j, m.antenna_i, m.antenna_j) for m in ranges} == {(1, 5, 10, -1)}
    assert [m.has_power for m in ranges] == block.has_power[0, kind == Kind.RANGE].tolist()
    assert ranges[0].fp_power == values[0, 2]


def test_mcap_estimates_are_poses_in_the_frame_of_the_first_node(block, estimate, tmp_path):
    export_mcap(tmp_path / "a.mcap", block, GROUP, estimate)
    found, _, _ = decoded(tmp_path / "a.mcap")
    odom = found["/estimates/node_1/node_5/odom"]
    assert len(odom) == 25
    pos_b, _ = estimate.between_b(0, 1)
    q_ij = estimate.relative_orientation(0, 1)
    p = GROUP.pair_index[0, 1]
    for (t, _, m), k in zip(odom, range(5, 30), strict=True):
        assert t == 100_000_000_000 + k * 50_000_000
        assert (m.header.frame_id, m.child_frame_id) == ("node_1", "node_5")
        assert np.allclose(vector(m.pose.pose.position), pos_b[k])
        assert np.allclose(wxyz(m.pose.pose.orientation), q_ij[k])
        vel_w = rotate(estimate.q_wb[k, 1], vector(m.twist.twist.linear))
        assert np.allclose(vel_w, estimate.vel_ij_w[k, p])
        for cov, own in (
            (m.pose.covariance, estimate.cov[k, p, :3, :3]),
            (m.twist.covariance, estimate.cov[k, p, 3:, 3:]),
        ):
            cov = np.reshape(cov, (6, 6))
            assert np.allclose(np.linalg.eigvalsh(cov[:3, :3]), np.linalg.eigvalsh(own))
            assert cov[3, 3] > 3.0
        # The Mahalanobis norm does not depend on the axes.
        d, cov = vector(m.pose.pose.position), np.reshape(m.pose.covariance, (6, 6))[:3, :3]
        own = estimate.pos_ij_w[k, p]
        own_nees = own @ np.linalg.solve(estimate.cov[k, p, :3, :3], own)
        assert np.isclose(d @ np.linalg.solve(cov, d), own_nees)
    status = [m.data for _, _, m in found["/estimates/node_1/node_5/status"]]
    assert status == ["starting"] * 5 + ["lost"] + ["ok"] * 24
    assert "/estimates/node_1/node_8/status" not in found


def test_the_tree_of_frames_agrees_with_the_poses(block, estimate, tmp_path):
    export_mcap(tmp_path / "a.mcap", block, GROUP, estimate, reference=5)
    found, _, _ = decoded(tmp_path / "a.mcap")
    odom = {t: m for t, _, m in found["/estimates/node_1/node_7/odom"]}
    assert len(found["/tf"]) == len(odom) == 25
    for t, _, m in found["/tf"]:
        frames = {one.child_frame_id: one.transform for one in m.transforms}
        assert {one.header.frame_id for one in m.transforms} == {"map"}
        assert set(frames) == {"node_1", "node_5", "node_7", "node_8"}
        assert np.array_equal(vector(frames["node_5"].translation), np.zeros(3))
        # A static node without an orientation is aligned with the axes of the world.
        assert np.array_equal(wxyz(frames["node_7"].rotation), [1, 0, 0, 0])
        one, other = frames["node_1"], frames["node_7"]
        pose = odom[t].pose.pose
        placed = vector(one.translation) + rotate(wxyz(one.rotation), vector(pose.position))
        assert np.allclose(placed, vector(other.translation))


def test_definitions_are_complete():
    for name in _FIELDS:
        text = definition(name)
        assert text.count("MSG: ") == len(set(text.split("MSG: ")[1:]))
        for line in text.splitlines():
            kind = line.split("[")[0].split(" ")[0]
            assert "/" not in kind or f"MSG: {kind}\n" in text


def test_tum_is_position_from_the_reference_and_orientation(estimate, tmp_path):
    folder = export_tum(tmp_path / "tum", estimate, reference=5, offset_ns=UTC)
    assert sorted(p.name for p in folder.iterdir()) == ["node_1.txt", "node_7.txt", "node_8.txt"]
    lines = (folder / "node_1.txt").read_text().splitlines()
    assert lines[0] == "# timestamp tx ty tz qx qy qz qw"
    assert lines[1].split()[0] == "1760000100.423456789"
    rows = np.array([[float(v) for v in line.split()] for line in lines[1:]])
    assert rows.shape == (24, 8)
    assert np.allclose(rows[:, 1:4], estimate.between(1, 0)[0][6:], atol=1e-6)
    assert np.allclose(rows[:, [7, 4, 5, 6]], estimate.q_wb[6:, 0], atol=1e-8)
    still = np.loadtxt(folder / "node_7.txt")
    assert np.array_equal(still[:, 4:], np.tile([0.0, 0.0, 0.0, 1.0], (24, 1)))


def test_tum_needs_a_node_and_an_estimate(estimate, tmp_path):
    with pytest.raises(BridgeError, match="no node 3, expected one of 1, 5, 7, 8"):
        export_tum(tmp_path / "a", estimate, reference=3)
    estimate.status[:] = Status.STARTING
    with pytest.raises(BridgeError, match="no pair with node 1 ever had an estimate"):
        export_tum(tmp_path / "a", estimate)
    assert tum_text(estimate, 5, reference=1) == "# timestamp tx ty tz qx qy qz qw\n"
    assert list(tmp_path.iterdir()) == []


def test_a_log_folder_reads_back_to_the_last_bit(block, tmp_path):
    left_out = export_log(tmp_path / "log", block, GROUP, name="live", source="swarm")
    assert left_out == {}
    log = read_log(tmp_path / "log")
    assert (log.name, log.source) == ("live", "swarm")
    assert log.skipped == {}
    expected = block.sorted()
    for name in ("t", "kind", "i", "j", "antenna_i", "antenna_j", "has_power"):
        assert np.array_equal(getattr(log.block, name), getattr(expected, name)), name
    # Orientations are normalised, and missing powers are not written.
    unsaid = (expected.kind == Kind.RANGE) & ~expected.has_power
    values = np.where(
        unsaid[..., None] & (np.arange(N_VALUES) > 0),
        0.0,
        expected.values,
    )
    assert np.allclose(log.block.values, values, rtol=1e-15)


def test_what_a_log_has_no_place_for_is_left_out_and_counted(block, tmp_path):
    nan = float("nan")
    odd = MeasurementBlock.concatenate(
        [
            block,
            of_kind(Kind.RANGE, [101.0] * 4, 0, [[0.0], [1001.0], [nan], [-1.0]], j=1),
            of_kind(Kind.RANGE, [nan], 0, [[1.0]], j=1),
            of_kind(Kind.RANGE, [101.0], 1, [[1.0]], j=1),
            of_kind(Kind.SURVEY, [101.0], 0, [[1.0]], j=2),
            of_kind(Kind.IMU, [101.0] * 3, [0, 0, 2], [[nan] * 6, [0, 0, 5000, 0, 0, 0], [0] * 6]),
            of_kind(Kind.STATE, [101.0], 1, [[0.5, 0, 0, 0, 0, 0, 0]]),
            of_kind(Kind.JOIN, [99.0], 0, [[0.0]]),
            of_kind(Kind.LEAVE, [200.0], 0, [[0.0]]),
            MeasurementBlock.empty(1, 3),
        ]
    )
    left_out = export_log(tmp_path / "log", odd, GROUP, name="live")
    assert left_out == {"IMU": 3, "STATE": 1, "SURVEY": 1, "RANGE": 6}
    log = read_log(tmp_path / "log")
    assert log.skipped == {}
    assert log.block.n_events == block.n_events + 2  # a JOIN and a LEAVE


def test_a_power_that_is_no_number_is_no_power(block, tmp_path):
    block.values[0, 0, 2] = float("inf")
    export_log(tmp_path / "log", block, GROUP, name="live")
    assert not read_log(tmp_path / "log").block.has_power[0, 0]


def test_a_run_that_makes_no_log_leaves_nothing(block, tmp_path):
    imu = block.take(block.kind[0] == Kind.IMU)
    with pytest.raises(BridgeError, match="no range"):
        export_log(tmp_path / "log", imu, GROUP, name="live")
    no_mag = block.take(~np.isin(block.kind[0], (Kind.MAG, Kind.STATE)))
    with pytest.raises(BridgeError, match="magnetic"):
        export_log(tmp_path / "log", no_mag, GROUP, name="live")
    assert list(tmp_path.iterdir()) == []


def test_times_that_ros_cannot_say_are_refused(block, tmp_path):
    for offset in (-(10**12), 3 * 10**18):
        with pytest.raises(BridgeError, match="offset_ns"):
            export_mcap(tmp_path / "a.mcap", block, GROUP, offset_ns=offset)
    block.t[0, 0] = float("nan")
    with pytest.raises(BridgeError, match="finite"):
        export_mcap(tmp_path / "a.mcap", block, GROUP)
    assert list(tmp_path.iterdir()) == []


def test_no_export_takes_the_place_of_something(block, estimate, tmp_path):
    taken = tmp_path / "taken"
    taken.mkdir()
    (taken / "mine").write_text("mine")
    for export in (
        lambda: export_mcap(taken / "mine", block, GROUP),
        lambda: export_mcap(taken, block, GROUP),
        lambda: export_tum(taken, estimate),
        lambda: export_tum(taken / "mine", estimate),
        lambda: export_log(taken, block, GROUP, name="x"),
    ):
        with pytest.raises(BridgeError, match="exists already"):
            export()
    assert [p.name for p in tmp_path.rglob("*")] == ["taken", "mine"]
    assert (taken / "mine").read_text() == "mine"
    (tmp_path / "empty").mkdir()
    export_tum(tmp_path / "empty", estimate)


@pytest.mark.parametrize("whole", [whole_file, whole_folder])
def test_a_target_is_whole_or_not_there(whole, tmp_path):
    def write(then):
        with whole(tmp_path / "a") as place:
            (place / "part" if place.is_dir() else place).write_text("half")
            then()

    def fail(error):
        raise error

    with pytest.raises(BridgeError, match="a: cannot be written .No space"):
        write(lambda: fail(OSError(errno.ENOSPC, "No space left on device")))
    with pytest.raises(KeyboardInterrupt):
        write(lambda: fail(KeyboardInterrupt()))
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(BridgeError, match="exists already"):
        write(lambda: (tmp_path / "a").write_text("came first"))
    assert [p.name for p in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_text() == "came first"
