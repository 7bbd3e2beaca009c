"""Requirements on inertial samples of a log, and messages about unusable ones."""

from dataclasses import replace

import numpy as np
import pytest

from tracking import Constellation, NodeConfig
from tracking.errors import LogError
from tracking.findings import find_unused
from tracking.findings.stamps import find_bad_stamps
from tracking.log import Log, read_log, write_log
from tracking.log.inertial import with_rates
from tracking.measurements import Kind, MeasurementBlock

SECONDS = 4.0


def samples(kind, t, node, width):
    """Return measurements of one sensor."""
    values = np.zeros((len(t), width))
    values[:, 0] = np.linspace(20.0, 21.0, len(t))
    return MeasurementBlock.of_kind(kind, t, np.full(len(t), node), values)


def log_of(imu, mag=(), *, heading="magnetic", headings=(None, None)):
    """Return two nodes that range, with (node, times) of samples."""
    t = np.arange(0.0, SECONDS, 0.05)
    zeros, ones = np.zeros(len(t), dtype=np.int64), np.ones(len(t), dtype=np.int64)
    ranges = MeasurementBlock.of_kind(
        Kind.RANGE, t, zeros, np.full((len(t), 1), 2.0), j=ones, antennas=(zeros, ones)
    )
    parts = [samples(Kind.IMU, at, node, 6) for node, at in imu]
    parts += [samples(Kind.MAG, at, node, 3) for node, at in mag]
    nodes = tuple(NodeConfig(id=k + 1, initial_heading=h) for k, h in enumerate(headings))
    group = Constellation(nodes=nodes, dimensions=2, heading=heading)
    return Log(
        name="small",
        constellation=group,
        block=MeasurementBlock.concatenate([ranges, *parts]).sorted(),
    )


@pytest.mark.parametrize("hz", [50.0, 60.0, 100.0, 119.0, 300.0])
@pytest.mark.parametrize("lost", [0.0, 0.2])
def test_times_that_are_rounded_do_not_change_the_rate(hz, lost):
    rng = np.random.default_rng(int(hz))
    t = np.floor(1e3 * np.arange(0.0, 60.0, 1.0 / hz)) / 1e3
    log = log_of([(0, t[rng.random(len(t)) >= lost])], heading="initial")
    rates = with_rates(log.constellation, log.block)
    assert rates.nodes[0].imu_hz == pytest.approx(hz, rel=2e-3)


def test_samples_in_pairs_have_the_rate_of_the_sensor():
    log = log_of([(0, np.repeat(np.arange(0.0, SECONDS, 0.02), 2))], heading="initial")
    assert with_rates(log.constellation, log.block).nodes[0].imu_hz == pytest.approx(
        100.0, rel=0.02
    )


def test_samples_that_come_all_at_once_are_refused(tmp_path):
    t = np.repeat(np.arange(0.0, SECONDS, 0.05), 5)
    write_log(tmp_path / "log", log_of([(0, t)], heading="initial"))
    with pytest.raises(LogError, match=r"imu\.csv.*, t_s: 80 % of the samples of node 1"):
        read_log(tmp_path / "log")


@pytest.mark.parametrize("scale", [(1.0, 1.7e9), (1000.0, 0.0)])
def test_a_magnetometer_on_another_clock_is_refused(tmp_path, scale):
    t = np.arange(0.0, SECONDS, 0.01)
    mag = scale[0] * t[::2] + scale[1]
    write_log(tmp_path / "log", log_of([(0, t)], [(0, mag)]))
    with pytest.raises(LogError, match=r"mag\.csv, t_s: .*expected one clock"):
        read_log(tmp_path / "log")


@pytest.mark.parametrize(("jitter", "repeats", "count"), [(0.0, 1, 0), (0.004, 1, 1), (0.0, 2, 1)])
def test_times_that_repeat_or_jitter_are_said(jitter, repeats, count):
    t = np.repeat(np.arange(0.0, SECONDS, 0.01 * repeats), repeats)
    t += jitter * np.random.default_rng(1).standard_normal(len(t))
    log = log_of([(0, np.sort(t))], heading="initial")
    log = replace(log, constellation=with_rates(log.constellation, log.block))
    found = find_bad_stamps(log)
    assert [f.name for f in found] == ["bad-stamps"] * count
    assert all("expected when each was taken" in f.text for f in found)


def test_what_cannot_be_used_is_said():
    t = np.arange(0.0, SECONDS, 0.01)
    assert find_unused(log_of([(0, t), (1, t)], [(0, t), (1, t)])) == []
    [found] = find_unused(log_of([(0, t)], heading="initial", headings=(0.3, None)))
    assert (found.name, found.nodes) == ("no-imu", (2,))
    assert found.text.startswith("node 2: no IMU samples")
    [found] = find_unused(log_of([(0, t), (1, t)], [(0, t)]))
    assert (found.name, found.nodes) == ("no-magnetometer", (2,))
    assert found.text.startswith("node 2: no magnetometer")
    [found] = find_unused(log_of([(0, t), (1, t)], heading="initial"))
    assert (found.name, found.nodes) == ("no-heading", (1, 2))
    assert found.text.startswith("nodes 1, 2: no initial_heading_rad")


def test_a_log_is_written_where_one_stands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log = log_of([(0, np.arange(0.0, SECONDS, 0.01))], heading="initial")
    write_log(".", log)
    assert read_log(tmp_path).n_ranges == log.n_ranges


def test_ids_that_no_number_holds_are_refused(tmp_path):
    folder = write_log(tmp_path / "log", log_of([(0, np.arange(0.0, 1.0, 0.01))]))
    meta = folder / "meta.toml"
    meta.write_text(meta.read_text().replace("[nodes.1]", f"[nodes.{'1' * 5000}]"))
    with pytest.raises(LogError, match="expected an integer id"):
        read_log(folder)
