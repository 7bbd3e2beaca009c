"""Position of a tracker on a car: given, expected, and estimated."""

from dataclasses import replace

import numpy as np
import pytest

from tests.exact_motion import ExactGroup
from tests.second_world.record import record
from tests.second_world.world import draw
from tracking.constellation import Constellation, NodeConfig
from tracking.errors import ConfigError, LogError
from tracking.filters.joint import JointEkf
from tracking.filters.joint.params import JointParams
from tracking.filters.params import FilterParams
from tracking.log import read_log, write_log
from tracking.measurements import Kind
from tracking.mount import Mount
from tracking.tracker import Tracker, TrackerParams
from tracking.vehicles import VEHICLES

CAR = VEHICLES["car"]


def group(**mounts):
    nodes = (NodeConfig(id=1, vehicle="car", **mounts), NodeConfig(id=2, vehicle="robot"))
    return Constellation(nodes=nodes, dimensions=2)


def test_what_is_given_has_no_variance_and_no_state():
    known = Mount(ahead=0.2, slip=0.0)
    assert known.prior(CAR) == (0.2, 0.0, 0.0, 0.0)
    n = [
        JointEkf(group(mount=m), JointParams()).save().nodes["i_mount"][0] for m in (known, Mount())
    ]
    assert n[0].tolist() == [-1, -1]
    assert n[1][0] >= 0
    assert n[1][1] == -1


def test_a_tracker_is_expected_between_the_axles():
    ahead, std, slip, slip_std = Mount(wheelbase=0.4).prior(CAR)
    assert (ahead, std) == (0.2, 0.2)
    assert (slip, slip_std) == (CAR.slip, CAR.slip_std)


@pytest.mark.parametrize("name", ["ahead", "aside", "wheelbase", "slip"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -20.0, 20.0])
def test_what_cannot_be_is_refused_by_name(name, value):
    with pytest.raises(ConfigError, match=rf"nodes\.1\.mount\.{name}: expected"):
        group(mount=Mount(**{name: value}))


@pytest.fixture(scope="module")
def run():
    return record(draw(14, seconds=40.0, long_share=0.0))


def test_a_log_keeps_it(run, tmp_path):
    mounts = Mount(ahead=-0.1, aside=0.02), Mount(wheelbase=0.3, slip=0.01), Mount()
    nodes = tuple(replace(n, mount=m) for n, m in zip(run.constellation.nodes, mounts, strict=True))
    log = replace(run, constellation=replace(run.constellation, nodes=nodes))
    write_log(tmp_path / "log", log)
    assert [n.mount for n in read_log(tmp_path / "log").constellation.nodes] == list(mounts)
    meta = tmp_path / "log" / "meta.toml"
    meta.write_text(meta.read_text().replace("ahead_m", "ahead"))
    with pytest.raises(LogError, match=r"nodes\.1\.mount: expected ahead_m, .*found ahead"):
        read_log(tmp_path / "log")


def test_curves_tell_how_far_ahead_of_its_axle_it_is(run):
    """The error is within three standard deviations, which have decreased."""
    world, filters = draw(14, seconds=40.0, long_share=0.0), []

    def built(constellation, params, n_envs=1):
        filters.append(JointEkf(constellation, JointParams(), n_envs))
        return filters[-1]

    Tracker(run.constellation, filter=built).run(run.block, np.array([39.0]))
    state = filters[0].save()
    h = int(state.group["best"][0, 0])
    for node, vehicle in zip(state.nodes[0], world.vehicles, strict=True):
        at = node["i_mount"]
        std = np.sqrt(state.P[0, h, at, at])
        assert std < 0.6 * CAR.ahead_std
        assert abs(state.x[0, h, at] - vehicle.ahead) < 3.0 * std


@pytest.mark.parametrize(("n", "states"), [(12, True), (13, False)])
def test_groups_of_more_than_twelve_have_no_states_of_mounts(n, states):
    nodes = tuple(NodeConfig(id=k, vehicle="car") for k in range(n))
    found = JointEkf(Constellation(nodes=nodes, dimensions=2), JointParams()).save()
    assert (found.nodes["i_mount"] >= 0).all() == states


def test_an_unknown_mount_without_states_is_noise(run):
    """A known mount gives the same estimate with less variance."""
    ahead, _, slip, _ = Mount().prior(CAR)
    params = TrackerParams(filter=FilterParams(joint=JointParams(max_mounts=2)))
    variance = []
    for mount in (Mount(), Mount(ahead=ahead, slip=slip)):
        nodes = tuple(replace(n, mount=mount) for n in run.constellation.nodes)
        who = replace(run.constellation, nodes=nodes)
        estimate = Tracker(who, params).run(run.block, np.array([39.0])).take(0)
        variance.append(np.trace(estimate.cov[0], axis1=-2, axis2=-1).mean())
    assert variance[0] > 1.05 * variance[1]


HEIGHTS = (0.1, 0.9, 0.4)


@pytest.mark.parametrize("filter", ["joint", "ekf-mds"])
def test_given_heights_make_ranges_distances_in_the_plane(filter):
    """Ranges over different heights: known, errors are those of one height; unknown, they grow."""
    drive = ExactGroup("car", range(3), seconds=12.0)
    t = np.arange(6.0, 11.8, 0.1)
    block, ranges = drive.block, drive.block.kind[0] == Kind.RANGE
    height, values = np.array(HEIGHTS), block.values.copy()
    up = height[block.j[0, ranges]] - height[block.i[0, ranges]]
    values[0, ranges, 0] = np.hypot(values[0, ranges, 0], up)
    slanted, who = replace(block, values=values), drive.constellation
    nodes = tuple(
        replace(n, mount=Mount(height=h)) for n, h in zip(who.nodes, HEIGHTS, strict=True)
    )

    def shape_error(constellation, measured):
        pos = Tracker(constellation, filter=filter).run(measured, t).take(0).pos_ij_w
        off = np.linalg.norm(pos, axis=-1) - np.linalg.norm(drive.pairs(t), axis=-1)
        return np.sqrt(np.mean(off**2))

    level = shape_error(who, block)
    assert shape_error(replace(who, nodes=nodes), slanted) < level + 0.01
    assert shape_error(who, slanted) > 2.0 * level


def test_in_space_a_height_changes_nothing():
    nodes = tuple(
        NodeConfig(id=k, vehicle="drone", mount=Mount(height=h)) for k, h in enumerate(HEIGHTS)
    )
    offset = Constellation(nodes=nodes, dimensions=3).antenna_offset_b
    np.testing.assert_array_equal(offset, 0.0)
