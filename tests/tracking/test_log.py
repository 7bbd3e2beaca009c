"""Log folder: a written log reads back, and faults are named."""

import csv
import gzip
import io
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.errors import LogError
from tracking.log import Log, Truth, read_log, write_log
from tracking.log.inertial import with_rates
from tracking.measurements import Kind, MeasurementBlock

META = """format = 1
name = "small"
dimensions = 2
heading = "initial"
[nodes.1]
kind = "moving"
[nodes.2]
kind = "moving"
[nodes.3]
kind = "static"
"""


@pytest.fixture
def folder(tmp_path):
    """Write a small valid log as plain files."""
    (tmp_path / "meta.toml").write_text(META)
    rows = ["t_s,node_i,node_j,range_m"]
    rows += [f"{0.1 * k:.1f},{1 + k % 2},3,{2.0 + 0.01 * k:.2f}" for k in range(30)]
    (tmp_path / "ranges.csv").write_text("\n".join(rows) + "\n")
    imu = ["t_s,node,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z"]
    imu += [f"{0.01 * k:.2f},1,0,0,0.1,0,0,9.81" for k in range(50)]
    (tmp_path / "imu.csv").write_text("\n".join(imu) + "\n")
    truth = ["t_s,node,x,y,z,qw,qx,qy,qz", "0.0,1,0,0,0,1,0,0,0", "0.1,2,1,0,0,,,,"]
    (tmp_path / "truth.csv").write_text("\n".join(truth) + "\n")
    return tmp_path


def edit(path, row, column, value):
    """Replace one field; rows are counted from 1 for the header."""
    rows = list(csv.reader(io.StringIO(path.read_text())))
    rows[row - 1][rows[0].index(column)] = value
    path.write_text("\n".join(",".join(r) for r in rows) + "\n")


def test_reads_a_good_log(folder):
    log = read_log(folder)
    assert (log.name, log.n_ranges, log.skipped) == ("small", 30, {})
    assert log.block.count(Kind.IMU) == 50
    assert log.constellation.nodes[0].imu_hz == 100.0
    assert log.truth.has_orientation.tolist() == [True, False]
    assert (np.diff(log.block.t[0]) >= 0).all()


def test_a_magnetometer_with_its_own_rate(folder):
    rows = ["t_s,node,mag_x,mag_y,mag_z", *(f"{0.05 * k:.2f},1,20,0,-40" for k in range(20))]
    (folder / "mag.csv").write_text("\n".join(rows) + "\n")
    log = read_log(folder)
    assert log.block.count(Kind.MAG) == 20
    assert (log.constellation.nodes[0].imu_hz, log.constellation.nodes[0].mag_hz) == (100.0, 20.0)


FAULTS = [
    ("ranges.csv", 5, "range_m", "abc", ["ranges.csv row 5", "range_m", "'abc'"]),
    ("ranges.csv", 5, "node_j", "9", ["ranges.csv row 5", "node_j", "no node 9"]),
    ("ranges.csv", 5, "node_j", "x", ["ranges.csv row 5", "node_j", "'x'"]),
    ("ranges.csv", 5, "t_s", "0.0", ["ranges.csv row 5", "t_s", "time goes back"]),
    ("ranges.csv", 5, "t_s", "nan", ["ranges.csv row 5", "t_s"]),
    ("imu.csv", 7, "acc_z", "big", ["imu.csv row 7", "acc_z", "'big'"]),
    ("imu.csv", 7, "node", "3", ["imu.csv row 7", "static"]),
    ("truth.csv", 3, "x", "?", ["truth.csv row 3", "x", "'?'"]),
]


@pytest.mark.parametrize(("file", "row", "column", "value", "words"), FAULTS)
def test_faults_are_named(folder, file, row, column, value, words):
    edit(folder / file, row, column, value)
    with pytest.raises(LogError) as error:
        read_log(folder)
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize("value", ["nan", "-1.0", "0", "1e9", "", "inf"])
def test_single_bad_ranges_are_counted_and_skipped(folder, value):
    edit(folder / "ranges.csv", 5, "range_m", value)
    log = read_log(folder)
    assert (log.n_ranges, log.skipped) == (29, {"ranges.csv": 1})


@pytest.mark.parametrize("value", ["nan", "-1.0", "4440"])
def test_a_file_of_bad_ranges_is_an_error(folder, value):
    for row in range(2, 32):
        edit(folder / "ranges.csv", row, "range_m", value)
    with pytest.raises(LogError, match=r"ranges.csv row 2, range_m: expected metres.*30 of 30"):
        read_log(folder)


def test_other_structural_faults_are_named(folder):
    ranges = folder / "ranges.csv"
    good = ranges.read_text()
    head, *rows = good.splitlines()
    surveyed = "\n".join([head + ",source", *(row + ",survey" for row in rows)])
    for text, word in (
        (surveyed, "only surveyed"),
        (good + '9.0,1,3,"2.0', "not a CSV"),
        (good + "1.7e9,1,3,2.0\n", "row 32, t_s: jumps"),
        (good + "9.0,1,3\n", "row 32: expected 4 fields"),
        (good.replace("range_m", "node_i"), "duplicate column"),
    ):
        ranges.write_text(text)
        with pytest.raises(LogError, match=word):
            read_log(folder)
    ranges.unlink()
    (folder / "ranges.csv.gz").write_bytes(b"\x1f\x8b\x08\x00 no gzip at all")
    with pytest.raises(LogError, match=r"ranges.csv.gz: cannot be read"):
        read_log(folder)


@pytest.mark.parametrize("value", ["nan", "inf", "1.5", "7", "left"])
def test_antennas_that_do_not_exist_are_named(folder, value):
    ranges = folder / "ranges.csv"
    head, *rows = ranges.read_text().splitlines()
    rows = [row + "," for row in rows]
    rows[3] += value
    ranges.write_text("\n".join([head + ",antenna_i", *rows]) + "\n")
    with pytest.raises(LogError, match=r"ranges.csv row 5, antenna_i"):
        read_log(folder)


def test_another_clock_is_an_error(folder):
    imu = folder / "imu.csv"
    head, *rows = imu.read_text().splitlines()
    late = [f"{float(r.split(',')[0]) + 1.7e9:.2f},{r.split(',', 1)[1]}" for r in rows]
    imu.write_text("\n".join([head, *late]) + "\n")
    with pytest.raises(LogError, match="expected one clock"):
        read_log(folder)
    imu.write_text(head + "\n")
    with pytest.raises(LogError, match=r"imu.csv: no rows"):
        read_log(folder)


def test_a_table_that_is_there_twice_is_an_error(folder):
    packed = gzip.compress((folder / "ranges.csv").read_bytes())
    (folder / "ranges.csv.gz").write_bytes(packed)
    with pytest.raises(LogError, match=r"both ranges.csv and ranges.csv.gz, expected one of them"):
        read_log(folder)


def test_an_empty_row_is_named(folder):
    rows = (folder / "ranges.csv").read_text().splitlines()
    (folder / "ranges.csv").write_text("\n".join([*rows[:3], "", *rows[3:]]))
    with pytest.raises(LogError, match=r"ranges.csv row 4: empty, expected \d+ fields"):
        read_log(folder)


def test_byte_order_mark_and_crlf_are_fine(folder):
    ranges = folder / "ranges.csv"
    ranges.write_bytes(b"\xef\xbb\xbf" + ranges.read_text().replace("\n", "\r\n").encode())
    assert read_log(folder).n_ranges == 30


def test_missing_parts_are_named(folder, tmp_path):
    with pytest.raises(LogError, match="no such folder"):
        read_log(tmp_path / "nothing")
    text = (folder / "ranges.csv").read_text()
    (folder / "ranges.csv").write_text(text.replace("range_m", "distance"))
    with pytest.raises(LogError, match=r"ranges.csv: column 'range_m' is missing"):
        read_log(folder)
    (folder / "ranges.csv").write_text("t_s,node_i,node_j,range_m\n")
    with pytest.raises(LogError, match=r"ranges.csv: no rows"):
        read_log(folder)
    (folder / "ranges.csv").write_text("")
    with pytest.raises(LogError, match=r"ranges.csv: empty"):
        read_log(folder)
    (folder / "ranges.csv").unlink()
    with pytest.raises(LogError, match=r"no ranges.csv"):
        read_log(folder)
    (folder / "meta.toml").unlink()
    with pytest.raises(LogError, match=r"no meta.toml"):
        read_log(folder)


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("format = 1", "format = 7", "format: expected 1"),
        ("dimensions = 2", "dimensions = 4", "dimensions"),
        ('heading = "initial"', 'heading = "sun"', "heading"),
        ('kind = "static"', 'kind = "flying"', "nodes.3.kind"),
        ("[nodes.3]", "[nodes.x]", "nodes.x"),
        ("format = 1", "format = ", "not TOML"),
        ("format = 1", "format = true", "format: expected 1"),
        ("dimensions = 2", "dimensions = 2.0", "dimensions"),
        ('name = "small"', "name = 5", "name: expected text"),
        ('heading = "initial"', 'heading = "magnetic"', "needs magnetometer readings"),
        ("[nodes.3]", "[antennas.1]\nnode=1\noffset_m=[1e9,0,0]\n[nodes.3]", "offset_m"),
        ("[nodes.2]", "initial_heading_rad = inf\n[nodes.2]", "initial_heading_rad"),
        ("[nodes.2]", f"initial_heading_rad = 1{400 * '0'}\n[nodes.2]", "initial_heading_rad"),
        ("[nodes.2]", f"initial_heading_rad = 1{5000 * '0'}\n[nodes.2]", "not TOML"),
    ],
)
def test_faults_of_meta_are_named(folder, old, new, word):
    (folder / "meta.toml").write_text(META.replace(old, new))
    with pytest.raises(LogError, match=word.replace(".", r"\.")):
        read_log(folder)


finite = st.floats(-1e3, 1e3)


@settings(max_examples=30)
@given(
    st.lists(st.floats(0.0, 1e4), min_size=2, max_size=15),
    st.floats(0.01, 299.0),
    finite,
    st.booleans(),
    st.booleans(),
)
@example([0.0, 1.0, 3.0], 1.0, 0.0, False, False)
def test_round_trip_is_exact(tmp_path_factory, times, distance, number, power, mag):
    t = np.sort(np.array(times))
    n = len(t)
    zeros, ones = np.zeros(n, dtype=np.int64), np.ones(n, dtype=np.int64)
    values = np.column_stack([distance + 0 * t, -80.0 + 0 * t, -85.0 + 0 * t])
    parts = [
        MeasurementBlock.of_kind(
            Kind.RANGE,
            t,
            zeros,
            values if power else values[:, :1],
            j=ones,
            antennas=(zeros, ones),
            has_power=np.full(n, power),
        ),
        MeasurementBlock.of_kind(Kind.IMU, t, zeros, np.full((n, 6), number / 1e3)),
    ]
    if mag:
        parts.append(MeasurementBlock.of_kind(Kind.MAG, t, zeros, np.full((n, 3), number)))
    log = Log(
        name='odd "name" \x7f\t',
        constellation=Constellation(
            nodes=(NodeConfig(id=4, initial_heading=number), NodeConfig(id=7)),
            dimensions=2,
            heading="initial",
            antennas=(Antenna(id=1, node=4, offset_b=(number / 20, 0.1, 1 / 3)),),
        ),
        block=MeasurementBlock.concatenate(parts).sorted(),
        nlos=np.arange(n) % 2 == 0,
        truth=Truth(
            t,
            zeros,
            np.full((n, 3), number),
            np.tile([1.0, 0, 0, 0], (n, 1)),
            np.ones(n, dtype=bool),
            np.arange(n) % 3 > 0,
        ),
    )
    again = read_log(write_log(tmp_path_factory.mktemp("logs") / "run", log))
    for f in fields(MeasurementBlock):
        np.testing.assert_array_equal(getattr(again.block, f.name), getattr(log.block, f.name))
    for f in fields(Truth):
        np.testing.assert_array_equal(getattr(again.truth, f.name), getattr(log.truth, f.name))
    np.testing.assert_array_equal(again.nlos, log.nlos)
    assert again.name == log.name
    assert again.constellation.antennas == log.constellation.antennas
    assert again.constellation.nodes[0].initial_heading == number


def test_an_existing_folder_is_not_touched(folder):
    before = sorted(folder.iterdir())
    with pytest.raises(LogError, match="exists already"):
        write_log(folder, read_log(folder))
    assert sorted(folder.iterdir()) == before


def test_only_a_log_folder_is_overwritten(folder, tmp_path_factory):
    log, other = read_log(folder), tmp_path_factory.mktemp("other")
    target = write_log(other / "run", log)
    (target / "mag.csv").write_text("t_s,node,mag_x,mag_y,mag_z\n")
    with pytest.raises(LogError, match="new or empty folder$"):
        write_log(target, log)
    write_log(target, log, overwrite=True)
    assert not (target / "mag.csv").exists()
    assert read_log(target).n_ranges == log.n_ranges
    (target / "raw.bag").write_text("precious")
    before = sorted(p.name for p in target.iterdir())
    with pytest.raises(LogError, match="nothing but a log"):
        write_log(target, log, overwrite=True)
    assert sorted(p.name for p in target.iterdir()) == before
    assert [p.name for p in other.iterdir()] == ["run"]


@pytest.mark.parametrize("period", [1.5, 1000.0, 1e-6])
def test_samples_too_rare_or_too_frequent_are_refused(period):
    block = MeasurementBlock.of_kind(
        Kind.IMU, period * np.arange(40), np.zeros(40, dtype=np.int64), np.zeros((40, 6))
    )
    nodes = (NodeConfig(id=4, initial_heading=0.0), NodeConfig(id=7, initial_heading=0.0))
    group = Constellation(nodes=nodes, dimensions=2, heading="initial")
    with pytest.raises(LogError, match="samples a second of node 4, expected 1 to 10000"):
        with_rates(group, block)
