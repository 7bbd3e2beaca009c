"""What meta.toml says of noise and accuracy is used, and the learned noise can be written to it."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.track import params_for, track_log
from agents.simulation.simulate import simulate
from tracking.calibration.distances import range_table
from tracking.errors import LogError
from tracking.filters import FilterParams
from tracking.filters.joint.params import JointParams
from tracking.log import read_log, write_log, write_range_noise
from tracking.measurements import Kind
from tracking.mount import Mount
from tracking.tracker import TrackerParams


@pytest.fixture(scope="module")
def noisy():
    """A drive with 0.15 m of white noise on its ranges."""
    log = simulate(scenario="cars-los", seconds=30.0, seed=5)
    values, ranges = log.block.values.copy(), log.block.kind[0] == Kind.RANGE
    noise = np.random.default_rng(5).standard_normal(ranges.sum())
    values[0, ranges, 0] = np.maximum(values[0, ranges, 0] + 0.15 * noise, 0.05)
    return replace(log, block=replace(log.block, values=values))


def test_the_learned_noise_is_written_and_then_given(noisy, tmp_path):
    folder = write_log(tmp_path / "run", noisy)
    before = (folder / "meta.toml").read_text()
    learned = track_log(noisy, findings=[]).range_noise
    assert 0.10 < learned < 0.25
    write_range_noise(folder, learned)
    log = read_log(folder)
    assert log.range_noise == pytest.approx(learned, abs=1e-4)
    assert track_log(log, findings=[]).range_noise == pytest.approx(log.range_noise, abs=1e-12)
    after = (folder / "meta.toml").read_text()
    assert [row for row in after.splitlines() if row and "range_noise" not in row] == [
        row for row in before.splitlines() if row
    ]
    write_range_noise(folder, 0.2)
    assert (folder / "meta.toml").read_text().count("range_noise_m") == 1


def test_a_header_that_cannot_be_read_stays_as_it_was(noisy, tmp_path):
    folder = write_log(tmp_path / "run", noisy)
    meta = folder / "meta.toml"
    meta.write_text("format = 1\n[nodes")
    with pytest.raises(LogError, match="TOML"):
        write_range_noise(folder, 0.1)
    assert meta.read_text() == "format = 1\n[nodes"


def test_an_accuracy_of_the_header_is_kept_and_used(noisy, tmp_path):
    folder = write_log(tmp_path / "run", replace(noisy, accuracy=0.05))
    log = read_log(folder)
    assert log.accuracy == 0.05
    assert params_for(log, TrackerParams()).filter.joint.accuracy == 0.05
    asked = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=1.0)))
    assert params_for(log, asked).filter.joint.accuracy == 1.0
    strict, lenient = (track_log(x, findings=[]).score.ok_share for x in (log, noisy))
    assert strict < lenient


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("accuracy_m = 0.001", "accuracy_m: expected 0.01 to 10"),
        ('accuracy_m = "fine"', "accuracy_m: expected a number"),
        ("range_noise_m = true", "range_noise_m: expected a number"),
    ],
)
def test_numbers_that_make_no_sense_are_named(noisy, tmp_path, line, message):
    folder = write_log(tmp_path / "run", noisy)
    meta = folder / "meta.toml"
    meta.write_text(f"{line}\n{meta.read_text()}")
    with pytest.raises(LogError, match=message):
        read_log(folder)


def test_a_key_that_would_land_inside_a_text_is_refused(noisy, tmp_path):
    folder = write_log(tmp_path / "run", noisy)
    meta = folder / "meta.toml"
    text = meta.read_text().replace('source = "', 'source = """\n[not a table]\n', 1)
    line = text.index("[not a table]")
    end = text.index('"\n', line)
    meta.write_text(text[:end] + '"""\n' + text[end + 2 :])
    before = meta.read_text()
    with pytest.raises(LogError, match="by hand|TOML"):
        write_range_noise(folder, 0.1)
    assert meta.read_text() == before
    assert sorted(p.name for p in folder.iterdir() if p.name.startswith(".")) == []


def test_the_noise_of_a_large_group_is_that_of_a_range_alone():
    """Ten cars have no states for lasting errors, which count as white noise on top."""
    log = simulate(scenario="hall", seconds=5.0, seed=3, cars=10)
    given = replace(log, range_noise=0.07)
    assert track_log(given, findings=[]).range_noise == pytest.approx(0.07)


def test_true_ranges_of_a_planar_log_have_the_heights_of_mounts_once(noisy):
    heights = (0.0, 0.6, 0.2)
    nodes = tuple(
        replace(n, mount=Mount(height=h))
        for n, h in zip(noisy.constellation.nodes, heights, strict=True)
    )
    who = replace(noisy.constellation, nodes=nodes, antennas=())
    truth = replace(noisy.truth, pos_w=noisy.truth.pos_w + [0.0, 0.0, 0.3])
    level = range_table(noisy.block, replace(who, nodes=noisy.constellation.nodes), truth)
    slanted = range_table(noisy.block, who, truth)
    up = np.array(heights)[slanted.j] - np.array(heights)[slanted.i]
    assert slanted.known.mean() > 0.9
    rows = slanted.known
    np.testing.assert_allclose(slanted.true[rows], np.hypot(level.true, up)[rows], atol=1e-9)
