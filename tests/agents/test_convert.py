"""Bags and tables of others become logs."""

import csv
import gzip
import json

import numpy as np
import pytest
from click.testing import CliRunner

from agents.cli import cli
from agents.convert import PRESETS, convert
from agents.convert.sources import pattern
from agents.errors import UsageError
from tracking.log import read_log
from tracking.measurements import Kind

MAPPING = """
format = 1
name = "made"
dimensions = 2
heading = "magnetic"
kind = "{kind}"
time = "{time}"
[nodes.1]
vehicle = "car"
[nodes.2]
vehicle = "car"
[nodes.101]
kind = "static"
[nodes.102]
kind = "static"
[ids]
beacon = 101
[places]
101 = [0.0, 0.0, 0.0]
102 = [3.0, 4.0, 0.0]
"""
TABLES = """
[[imu]]
stream = "imu_{node}"
gyr = ["gx", "gy", "gz"]
acc = ["ax", "ay", "az"]
acc_scale = 9.81
[[mag]]
stream = "imu_{node}"
mag = ["mx", "my", "mz"]
scale = 1e6
[[ranges]]
stream = "uwb"
i = "from"
j = "to"
range = "mm"
scale = 0.001
valid = "good"
[[truth]]
stream = "poses"
pos = ["x", "y", "z"]
"""


@pytest.fixture
def folder(tmp_path):
    """Tables of two cars and a beacon, from an epoch on."""
    root, t0 = tmp_path / "tables", 1.7e9
    root.mkdir()

    def write(name, head, rows, packed=False):
        text = "\n".join([",".join(head), *(",".join(map(str, row)) for row in rows)]) + "\n"
        if packed:
            (root / f"{name}.csv.gz").write_bytes(gzip.compress(text.encode()))
        else:
            (root / f"{name}.csv").write_text(text)

    head = ["t", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz"]
    for node in (1, 2):
        rows = [[t0 + 0.01 * k, 0.1, 0.2, node, 0, 0, 1, 2e-5, 0, -4e-5] for k in range(200)]
        write(f"imu_{node}", head, rows, packed=node == 2)
    write(
        "uwb",
        ["t", "from", "to", "mm", "good"],
        [
            [t0 + 0.5, 1, 2, 1500, 1],
            [t0 + 0.6, 2, "beacon", 2500, 1],
            [t0 + 0.7, 1, 2, -3, 1],
            [t0 + 0.8, 1, 2, 1600, 0],
            [t0 + 0.9, 1, 77, 1600, 1],
        ],
    )
    write("poses", ["t", "node", "x", "y", "z"], [[t0 + 0.5, 1, 1.0, 2.0, 0.0]])
    (tmp_path / "map.toml").write_text(MAPPING.format(kind="tables", time="t") + TABLES)
    return tmp_path


def test_tables_become_a_log(folder):
    log = convert(folder / "tables", folder / "log", mapping=folder / "map.toml")
    back = read_log(folder / "log")
    for name in ("t", "kind", "i", "j", "values"):
        np.testing.assert_array_equal(getattr(back.block, name), getattr(log.block, name))
    kind, values = log.block.kind[0], log.block.values[0]
    assert log.block.t[0, 0] == 0.0
    assert values[kind == Kind.RANGE, 0].tolist() == [1.5, 2.5]
    assert values[kind == Kind.SURVEY, 0].tolist() == [5.0]
    np.testing.assert_allclose(values[kind == Kind.IMU][0, :6], [0.1, 0.2, 1.0, 0.0, 0.0, 9.81])
    np.testing.assert_allclose(values[kind == Kind.MAG][0, :3], [20.0, 0.0, -40.0])
    assert log.constellation.ids == (1, 2, 101, 102)
    of_car = log.truth.node == 0
    assert log.truth.pos_w[of_car].tolist() == [[1.0, 2.0, 0.0]]


def test_restamping_takes_repeats_and_jitter_away(folder):
    path = folder / "tables" / "imu_1.csv"
    head, *rows = list(csv.reader(path.read_text().splitlines()))
    rng = np.random.default_rng(0)
    for k, row in enumerate(rows):
        late = 0.01 if k % 2 else 0.0
        row[0] = f"{1.7e9 + 0.01 * k + late + 0.002 * rng.random():.6f}"
    path.write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n")
    log = convert(folder / "tables", mapping=folder / "map.toml", restamp=True)
    t = log.block.t[0, (log.block.kind[0] == Kind.IMU) & (log.block.i[0] == 0)]
    np.testing.assert_allclose(np.diff(t), 0.01, atol=2e-4)


def test_a_bag_becomes_a_log(folder):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    Header, Time = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    Range = store.types["sensor_msgs/msg/Range"]
    bag = folder / "bag"
    with rosbag2.Writer(bag, version=9) as writer:
        for i, j in ((1, 2), (2, 101)):
            topic = writer.add_connection(f"/uwb/{i}/to_{j}", Range.__msgtype__, typestore=store)
            for k in range(3):
                head = Header(stamp=Time(sec=100 + k, nanosec=500_000_000), frame_id="")
                message = Range(head, 0, 0.0, 0.0, 0.0, 1.5 + k, **_variance(Range))
                data = store.serialize_cdr(message, Range.__msgtype__)
                writer.write(topic, (200 + k) * 10**9, data)
    mapping = MAPPING.format(kind="bag", time="stamp") + (
        '[[ranges]]\nstream = "/uwb/{i}/to_{j}"\nrange = "range"\n'
    )
    (folder / "bag.toml").write_text(mapping)
    log = convert(bag, mapping=folder / "bag.toml")
    ranges = log.block.take(log.block.kind[0] == Kind.RANGE)
    assert ranges.t[0].tolist() == [0.0, 0.0, 1.0, 1.0, 2.0, 2.0]
    assert sorted(zip(ranges.i[0].tolist(), ranges.j[0].tolist(), strict=True))[::3] == [
        (0, 1), (1, 2),
    ]  # fmt: skip
    assert ranges.values[0, ::2, 0].tolist() == [1.5, 2.5, 3.5]


def _variance(kind):
    return {"variance": 0.0} if "variance" in kind.__dataclass_fields__ else {}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.replace('stream = "uwb"', 'stream = "radio"'), "stream 'radio': not in the"),
        (lambda s: s.replace('range = "mm"', 'range = "cm"'), "stream 'uwb': no field 'cm'"),
        (lambda s: s.replace('time = "t"', 'time = "when"'), "no column 'when'"),
        (lambda s: s.replace("beacon = 101", "beacon = 103"), r"ids\.beacon: expected one of"),
        (lambda s: s.replace("[0.0, 0.0, 0.0]", "[0.0]"), r"places\.101: expected a node"),
        (lambda s: s.replace('kind = "tables"', 'kind = "pickle"'), "kind: expected one of"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(folder, change, message):
    path = folder / "map.toml"
    path.write_text(change(path.read_text()))
    with pytest.raises(UsageError, match=message):
        convert(folder / "tables", folder / "log", mapping=path)
    assert not (folder / "log").exists()


def test_parts_of_a_name_are_nodes():
    match = pattern("/robot{node}/uwb_{i}/to{j}").match("/robot3/uwb_12/to4")
    assert match is not None
    assert match.groupdict() == {"node": "3", "i": "12", "j": "4"}
    assert pattern("/a").match("/ab") is None


def test_the_command_says_what_it_made(folder):
    arguments = ["convert", str(folder / "tables"), str(folder / "log"), "--json"]
    done = CliRunner().invoke(cli, [*arguments, "--mapping", str(folder / "map.toml")])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["ranges"] == 2
    for options, message in (([], "expected one of them"), (["--preset", "x"], "expected one of")):
        with pytest.raises(UsageError, match=message):
            CliRunner().invoke(cli, [*arguments, *options], catch_exceptions=False)


@pytest.mark.parametrize(
    ("preset", "source", "log"),
    [("sfuise", "sfuise/ISAS-Walk1.bag", "isas_walk1"), ("starloc", "starloc", "starloc_fast1")],
)
def test_presets_read_what_was_recorded(data, preset, source, log):
    """Another hand converted the same recordings: the same samples and ranges, rounded."""
    assert preset in PRESETS
    ours, theirs = convert(data / "raw" / source, preset=preset), read_log(data / "logs" / log)
    for kind, digits in ((Kind.IMU, 5e-6), (Kind.RANGE, 6e-3)):
        a, b = (each.block.take(each.block.kind[0] == kind) for each in (ours, theirs))
        assert a.n_events == b.n_events
        # Rows of almost one time are in another order.
        rows = [np.sort(each.values[0, :, 0]) for each in (a, b)]
        np.testing.assert_allclose(rows[0], rows[1], atol=digits)
        np.testing.assert_allclose(np.diff(a.t[0]), np.diff(b.t[0]), atol=2e-5)


def test_robots_without_imu_are_followed_but_for_rotation_and_mirror(data):
    from agents.track import track_log

    found = track_log(convert(data / "raw" / "tiers_ros2", preset="tiers"))
    assert found.score.rmse_mirror is not None
    assert found.score.rmse_mirror < 0.6
    assert {"no-imu", "range-offset"} <= {f.name for f in found.findings}
