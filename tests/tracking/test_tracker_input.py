"""Input of the tracker: errors for invalid blocks, and skipped invalid measurements."""

from dataclasses import replace

import numpy as np
import pytest

from tracking import Constellation, NodeConfig, Tracker
from tracking.ahrs.params import OrientationParams
from tracking.constellation import Antenna
from tracking.errors import ConfigError
from tracking.estimate import TeamEstimate
from tracking.filters.joint.params import JointParams
from tracking.filters.pair.params import PairEkfParams
from tracking.late_data.horizon import Horizon, HorizonParams
from tracking.measurements import Kind, MeasurementBlock
from tracking.vehicles import VehicleParams

GROUP = Constellation(nodes=tuple(NodeConfig(id=k, kind="static") for k in range(4)), dimensions=2)
T = np.arange(0.0, 3.0, 0.05)


def ranges():
    """Return ranges of all pairs of a square, one environment."""
    pos = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.5], [0.0, 2.0]])
    i, j = (np.tile(c, len(T)) for c in GROUP.pairs.T)
    distance = np.linalg.norm(pos[j] - pos[i], axis=1)[:, None]
    t = np.repeat(T, GROUP.n_pairs)
    return MeasurementBlock.of_kind(Kind.RANGE, t, i, distance, j=j)


def twice(block):
    """Return the block in two environments."""
    return MeasurementBlock.stack([block, block])


def test_what_cannot_be_meant_is_refused():
    two = twice(ranges())
    Tracker(GROUP, n_envs=2).run(two, np.array([5.0, 6.0]))
    with pytest.raises(ConfigError, match="1 environments, got 2"):
        Tracker(GROUP).run(two, np.array([5.0]))
    with pytest.raises(ConfigError, match="nodes 0 to 3"):
        Tracker(GROUP, n_envs=2).run(replace(two, j=two.j + 1), np.array([5.0]))
    for foreign in (two.antenna_i + 1, two.antenna_i - 1, two.antenna_i + 9):
        with pytest.raises(ConfigError, match="antennas of the nodes"):
            Tracker(GROUP, n_envs=2).run(replace(two, antenna_i=foreign), np.array([5.0]))
    with pytest.raises(ConfigError, match="order of time"):
        Tracker(GROUP, n_envs=2).run(replace(two, t=-two.t), np.array([5.0]))
    for wrong in ([6.0, 5.0], [np.nan, 5.0]):
        with pytest.raises(ConfigError, match="do not go back"):
            Tracker(GROUP, n_envs=2).run(two, np.array(wrong))


@pytest.mark.parametrize("filter", ["joint", "ekf-mds"])
def test_what_cannot_be_is_passed_over(filter):
    good = ranges()
    bad = good.take(slice(0, 3))
    values = bad.values.copy()
    values[0, :, 0] = [np.nan, np.inf, 2.0]
    j = bad.j.copy()
    j[0, 2] = bad.i[0, 2]  # a range of a node with itself
    bad = replace(bad, values=values, j=j, t=np.full((1, 3), 1.01))
    mixed = MeasurementBlock.concatenate([good, bad]).sorted()
    clean, found = (Tracker(GROUP, filter=filter).run(b, np.array([3.0])) for b in (good, mixed))
    np.testing.assert_array_equal(found.pos_ij_w, clean.pos_ij_w)
    np.testing.assert_array_equal(found.cov, clean.cov)


def test_a_node_is_nowhere_relative_to_itself():
    estimate = Tracker(GROUP).run(ranges(), np.array([3.0]))
    with pytest.raises(ConfigError, match="two different nodes"):
        estimate.between(1, 1)


@pytest.mark.parametrize("name", ["node_timeout", "imu_timeout"])
@pytest.mark.parametrize("value", [0, -1, 0.0, float("nan")])
def test_parameters_are_above_0_whole_or_not(name, value):
    with pytest.raises(ConfigError, match=name):
        JointParams(**{name: value})


def test_time_does_not_go_back_between_calls():
    block = ranges()
    tracker = Tracker(GROUP)
    tracker.run(block, np.array([3.0]))
    with pytest.raises(ConfigError, match="earlier blocks"):
        tracker.step(block.take(slice(0, 6)), 4.0)
    with pytest.raises(ConfigError, match="not before the last event"):
        tracker.step(MeasurementBlock.empty(), 1.0)
    saved = tracker.save()
    tracker.reset(0)
    tracker.step(block.take(slice(0, 6)), 4.0)
    tracker.restore(saved)
    with pytest.raises(ConfigError, match="earlier blocks"):
        tracker.step(block.take(slice(0, 6)), 4.0)


@pytest.mark.parametrize("distance", [0.0, -1.0, 1e6])
@pytest.mark.parametrize("filter", ["joint", "ekf-mds", "paper-ekf-mds"])
def test_distances_that_cannot_be_are_passed_over(filter, distance):
    good = ranges()
    bad = good.take(slice(0, 3))
    values = bad.values.copy()
    values[0, :, 0] = distance
    mixed = MeasurementBlock.concatenate([good, replace(bad, values=values)]).sorted()
    clean, found = (Tracker(GROUP, filter=filter).run(b, np.array([3.0])) for b in (good, mixed))
    np.testing.assert_array_equal(found.pos_ij_w, clean.pos_ij_w)


def test_a_range_with_a_power_that_is_no_number_is_one_without():
    good = ranges()
    values, has_power = good.values.copy(), np.ones_like(good.has_power)
    values[0, :, 1], values[0, :, 2] = -80.0, np.nan
    odd = replace(good, values=values, has_power=has_power)
    clean, found = (Tracker(GROUP).run(b, np.array([3.0])) for b in (good, odd))
    np.testing.assert_array_equal(found.pos_ij_w, clean.pos_ij_w)


@pytest.mark.parametrize(
    ("length", "used"), [(1.0, True), (1.05, True), (0.0, False), (3.0, False)]
)
def test_orientations_are_unit_quaternions_or_none(length, used):
    group = Constellation(nodes=(NodeConfig(id=0), NodeConfig(id=1)))
    values = np.zeros((1, 7))
    values[0, :4] = length * np.array([0.6, 0.0, 0.8, 0.0])
    state = MeasurementBlock.of_kind(Kind.STATE, np.array([0.1]), np.array([0]), values)
    estimate = Tracker(group).step(state, 0.2)
    assert estimate.has_orientation[0, 0] == used
    if used:
        np.testing.assert_allclose(estimate.q_wb[0, 0], [0.6, 0.0, 0.8, 0.0], atol=1e-12)


def test_foreign_antennas_of_surveys_are_refused():
    t, i, j = np.array([0.1]), np.array([0]), np.array([1])
    survey = MeasurementBlock.of_kind(
        Kind.SURVEY, t, i, np.array([[2.0]]), j=j, antennas=(np.array([3]), np.array([1]))
    )
    with pytest.raises(ConfigError, match="antennas of the nodes"):
        Tracker(GROUP).step(survey, 0.2)


def test_a_survey_does_not_say_with_which_antenna_a_node_ranges():
    nodes = NodeConfig(id=0), NodeConfig(id=1)
    antennas = tuple(Antenna(id=k, node=0, offset_b=(0.1 * k, 0.0, 0.0)) for k in (1, 2))
    group = Constellation(nodes=nodes, antennas=antennas, dimensions=2)
    metres = np.array([[2.0]])
    first, second, of_other = np.array([0]), np.array([1]), np.array([2])
    ranged = MeasurementBlock.of_kind(
        Kind.RANGE,
        np.array([0.1]),
        np.array([0]),
        metres,
        j=np.array([1]),
        antennas=(second, of_other),
    )
    survey = MeasurementBlock.of_kind(
        Kind.SURVEY,
        np.array([0.2]),
        np.array([0]),
        metres,
        j=np.array([1]),
        antennas=(first, of_other),
    )
    tracker = Tracker(group)
    for block, t in ((ranged, 0.15), (survey, 0.25)):
        tracker.step(block, t)
        np.testing.assert_array_equal(tracker.save()["filter"].nodes["antenna"][0], [1, 2])


def test_smoothing_refuses_what_running_refuses_and_survives_it():
    block = ranges()
    tracker, half = Tracker(GROUP), block.n_events // 2
    t = float(block.t[0, half - 1])
    tracker.step(block.take(slice(0, half)), t)
    later = block.take(slice(half, half + 12))
    before = tracker.save()
    with pytest.raises(ConfigError, match="nodes 0 to 3"):
        tracker.smooth(replace(later, j=later.j + 9), t)
    with pytest.raises(ConfigError, match="events after t"):
        tracker.smooth(later, t + 1.0)
    values = later.values.copy()
    values[0, 3, 0] = np.nan
    smooth = tracker.smooth(replace(later, values=values), t)
    assert np.isfinite(smooth.pos_ij_w).all()
    for old, new in zip(before["filter"], tracker.save()["filter"], strict=True):
        np.testing.assert_array_equal(old, new)


@pytest.mark.parametrize("filter", ["joint", "ekf-mds", "paper-ekf-mds"])
def test_to_join_again_changes_nothing(filter):
    block = ranges()
    join = MeasurementBlock.of_kind(
        Kind.JOIN, np.array([2.01]), np.array([1]), np.zeros((1, 1)), j=np.array([1])
    )
    with_join = MeasurementBlock.concatenate([block, join]).sorted()
    clean, found = (
        Tracker(GROUP, filter=filter).run(b, np.array([2.9])) for b in (block, with_join)
    )
    np.testing.assert_array_equal(found.pos_ij_w, clean.pos_ij_w)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda v: HorizonParams(delay=v), "delay"),
        (lambda v: OrientationParams(tau_acc=v), "tau_acc"),
        (lambda v: group_of(imu_hz=v), "imu_hz"),
        (lambda v: group_of(mag_hz=v), "mag_hz"),
        (lambda v: PairEkfParams(lost_after=v), "lost_after"),
        (lambda v: VehicleParams(slip=v), "slip"),
    ],
)
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_numbers_that_make_no_sense_are_named(make, named, value):
    with pytest.raises(ConfigError, match=named):
        make(value)


def group_of(**of_first):
    return Constellation(nodes=(NodeConfig(id=0, **of_first), NodeConfig(id=1)))


def test_an_antenna_is_at_a_finite_place():
    with pytest.raises(ConfigError, match="offset_b"):
        replace(GROUP, antennas=(Antenna(id=1, node=0, offset_b=(0.0, float("nan"), 0.0)),))


def test_arrays_that_kernels_write_are_contiguous():
    horizon, block = Horizon(HorizonParams(delay=0.0)), ranges()
    wide = MeasurementBlock.empty(2, 2 * block.n_events)
    out = wide.take(slice(0, None, 2))  # every other column
    with pytest.raises(ConfigError, match="contiguous"):
        horizon.step(block, 10.0, out=replace(out, **{f: getattr(out, f)[:1] for f in FIELDS}))


FIELDS = ("t", "kind", "i", "j", "antenna_i", "antenna_j", "values", "has_power", "valid")


def test_what_is_printed_is_short():
    block, group = ranges(), GROUP
    estimate = Tracker(group).run(block, np.linspace(0.1, 3.0, 500))
    assert len(repr(block)) < 400
    assert len(repr(estimate)) < 600


def test_what_is_no_constellation_is_named():
    for wrong in (3, [], [NodeConfig(id=1)]):
        with pytest.raises(ConfigError, match="constellation: expected a Constellation, got"):
            Tracker(wrong)


@pytest.mark.parametrize("pair", [(0, 5), (-1, 0), (0, 1.0), ("1", "2"), (True, 0)])
def test_nodes_of_an_estimate_that_are_no_indices_are_named(pair):
    who = Constellation(nodes=tuple(NodeConfig(id=k) for k in (7, 8, 9)))
    estimate = TeamEstimate.empty(who, np.zeros(1))
    for method in (estimate.between, estimate.between_b, estimate.relative_orientation):
        with pytest.raises(ConfigError, match="expected node indices 0 to 2, got"):
            method(*pair)


@pytest.mark.parametrize("wrong", [-1, "a", 1.5])
def test_ids_that_are_no_whole_numbers_are_named(wrong):
    with pytest.raises(ConfigError, match="nodes.id: expected 0 or more, got"):
        Constellation(nodes=(NodeConfig(id=wrong), NodeConfig(id=1)))
