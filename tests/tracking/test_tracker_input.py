"""What a tracker is given: refused where it cannot be meant, passed over where it cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from tracking import Constellation, NodeConfig, Tracker
from tracking.errors import ConfigError
from tracking.filters.joint.params import JointParams
from tracking.measurements import Kind, MeasurementBlock

GROUP = Constellation(nodes=tuple(NodeConfig(id=k, kind="static") for k in range(4)), dimensions=2)
T = np.arange(0.0, 3.0, 0.05)


def ranges():
    """All pairs of a square, one environment."""
    pos = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.5], [0.0, 2.0]])
    i, j = (np.tile(c, len(T)) for c in GROUP.pairs.T)
    distance = np.linalg.norm(pos[j] - pos[i], axis=1)[:, None]
    t = np.repeat(T, GROUP.n_pairs)
    return MeasurementBlock.of_kind(Kind.RANGE, t, i, distance, j=j)


def twice(block):
    """The same in two environments."""
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


@pytest.mark.parametrize("name", ["leave_after", "unaided_after"])
@pytest.mark.parametrize("value", [0, -1, 0.0, float("nan")])
def test_parameters_are_above_0_whole_or_not(name, value):
    with pytest.raises(ConfigError, match=name):
        JointParams(**{name: value})
