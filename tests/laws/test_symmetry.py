"""Symmetries of the filters, at all times of a run and up to rounding errors.

A different order of summation changes positions by less than `ROUNDING`. Until accelerations
determine the rotation of a group, one of many hypotheses is reported: properties of rotated worlds
are tested for pairs that are OK.
"""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from agents.simulation.simulate import simulate
from tests.exact_motion import ExactGroup
from tracking import Status, TeamEstimate, Tracker, TrackerParams
from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.filters import FILTERS, FilterParams, filter_builder
from tracking.filters.paper import PaperParams
from tracking.measurements import Kind, MeasurementBlock

ROUNDING = 1e-6
"""[m] Limit of differences by rounding."""
SECONDS, HZ = 10.0, 64.0
T = np.arange(2, int(SECONDS * 8)) / 8.0
"""[s] Times of estimates: multiples of 2**-20 s, as of measurements; exact in any clock."""


def exact(vehicle, n, dimensions=2, noise=0.0, at_rest=False):
    """Return constellation, measurements and first positions of a group in smooth motion."""
    order = tuple(range(n))
    group = ExactGroup(
        vehicle, order, hz=HZ, at_rest=at_rest, dimensions=dimensions, seconds=SECONDS
    )
    rng, values = np.random.default_rng(n), group.block.values.copy()
    for kind, columns, std in ((Kind.RANGE, [0], noise), (Kind.STATE, [4, 5], 2.0 * noise)):
        rows = np.nonzero(group.block.kind[0] == kind)[0]
        values[0, rows[:, None], columns] += std * rng.standard_normal((len(rows), len(columns)))
    first = np.zeros((n, 3))
    first[1:] = group.pairs(np.array([0.1]))[0, : n - 1]
    return group.constellation, replace(group.block, values=values), first


def simulated(scenario):
    log = simulate(scenario=scenario, seconds=SECONDS, seed=3)
    first = np.zeros((log.constellation.n_nodes, 3))
    truth, _ = log.truth.pairs(log.constellation, np.array([0.5]))
    first[1:] = truth[0, : len(first) - 1]
    t = np.round(log.block.t * 2.0**20) / 2.0**20
    return log.constellation, replace(log.block, t=t).sorted(), first


GROUPS = {
    "three cars": lambda: exact("car", 3),
    "four people": lambda: exact("human", 4),
    "three people, noise": lambda: exact("human", 3, noise=0.05),
    "four people from rest": lambda: exact("human", 4, at_rest=True),
    "four drones in space": lambda: exact("drone", 4, dimensions=3),
    "four drones in space, noise": lambda: exact("drone", 4, dimensions=3, noise=0.05),
    "simulated cars": lambda: simulated("cars-nlos"),
    "simulated person": lambda: simulated("human"),
}
on_all_groups = pytest.mark.parametrize("group", GROUPS)
on_all_filters = pytest.mark.parametrize("name", FILTERS)


@cache
def case(group):
    return GROUPS[group]()


def make_tracker(name, constellation, first, n_envs=1):
    """Return a tracker; the filter of the paper gets a first layout and speed "rate".

    With the norm of the velocity as speed, rounding errors grow 1000-fold in two seconds.
    """
    layout = tuple(tuple(map(float, p)) for p in first)
    paper = PaperParams(
        first_layout=layout, accel_std=0.5, range_std=0.1, speed="rate", speed_std=1e3
    )
    params = TrackerParams(filter=FilterParams(paper=paper))
    return Tracker(constellation, params, filter=name, n_envs=n_envs)


def estimate(name, constellation, block, first, clock=0.0):
    return make_tracker(name, constellation, first).run(block, T + clock).take(0)


@cache
def as_it_is(name, group):
    return estimate(name, *case(group))


def assert_identical(a, b):
    for f in fields(TeamEstimate)[1:]:
        if f.name != "t":
            np.testing.assert_array_equal(getattr(a, f.name), getattr(b, f.name), err_msg=f.name)


def renumber(constellation, block, first, new):
    """Renumber node k as new[k]; simultaneous events keep their order."""
    old = np.argsort(new)
    nodes = tuple(constellation.nodes[k] for k in old)
    other = replace(constellation, nodes=nodes)
    antennas = [other.all_antennas.index(a) for a in constellation.all_antennas] if (
        constellation.antennas
    ) else new  # fmt: skip
    of_two = block.i != block.j
    ends = {
        f"antenna_{k}": np.where(of_two, np.asarray(antennas)[a], a)
        for k, a in (("i", block.antenna_i), ("j", block.antenna_j))
    }
    return other, replace(block, i=new[block.i], j=new[block.j], **ends), first[old]


def in_old_numbers(found, constellation, new):
    """Return positions and status of a renumbered group by the original pairs."""
    i, j = new[constellation.pairs].T
    p, sign = found.constellation.pair_index[i, j], np.where(i < j, 1.0, -1.0)
    return sign[:, None] * found.pos_ij_w[:, p], found.status[:, p]


def states(name, constellation, block):
    """Return the block with orientations instead of inertial samples, the input of filters."""
    follows_bias = filter_builder(name)(constellation, FilterParams(), 1).follows_bias
    return Orientation(constellation, OrientationParams(), follows_bias=follows_bias).step(block)


def turn(block, angle):
    """Return the block with orientations and accelerations rotated about z, and the rotation."""
    c, s = (0.0, 1.0) if angle == np.pi / 2 else (np.cos(angle), np.sin(angle))
    half_c, half_s = np.cos(0.5 * angle), np.sin(0.5 * angle)
    v, values = block.values, block.values.copy()
    for a, b in ((0, 3), (1, 2)):
        values[..., a] = half_c * v[..., a] - half_s * v[..., b]
        values[..., b] = half_c * v[..., b] + half_s * v[..., a]
    for a in (4, 9):  # acceleration, accumulated tilt correction
        values[..., a], values[..., a + 1] = (
            c * v[..., a] - s * v[..., a + 1],
            s * v[..., a] + c * v[..., a + 1],
        )
    rows = (block.kind == Kind.STATE)[..., None]
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return replace(block, values=np.where(rows, values, v)), R


def mirror(constellation, block):
    """Return constellation and block reflected in y, in the world and in every body frame."""
    values, rows = block.values.copy(), block.kind == Kind.STATE
    for k in (1, 3, 5, 9, 11, 13):  # x, z of rotations and y of vectors
        values[rows, k] = -values[rows, k]
    antennas = tuple(
        replace(a, offset_b=(a.offset_b[0], -a.offset_b[1], a.offset_b[2]))
        for a in constellation.antennas
    )
    return replace(constellation, antennas=antennas), replace(block, values=values)


def assert_near(pos, status, other, atol, always):
    """Assert equal positions at all times, or only where both are OK unless `always`."""
    off = np.linalg.norm(pos - other.pos_ij_w, axis=-1)
    counts = always | ((status == Status.OK) & (other.status == Status.OK))
    assert np.where(counts, off, 0.0).max() <= atol
    if atol <= 10.0 * ROUNDING:
        np.testing.assert_array_equal(status, other.status)


# --- numbering ---------------------------------------------------------------------------------
NUMBERING = {
    # Wheel constraints are applied in sequence, each to the result of the previous one.
    ("ekf-mds", "three cars"): (0.4, False),
    ("ekf-mds", "simulated cars"): (0.05, False),
    # Unstable: the noise of ranges is small compared with that of their rates.
    ("paper-ekf-mds", "four drones in space"): (1e-5, True),
}
"""Filter and group to tolerance [m], and True if it applies before pairs are OK."""


@on_all_groups
@on_all_filters
def test_numbering_nodes_otherwise_changes_nothing(name, group):
    constellation, block, first = case(group)
    n = constellation.n_nodes
    atol, always = NUMBERING.get((name, group), (ROUNDING, True))
    for new in (n - 1 - np.arange(n), np.roll(np.arange(n), 1)):
        found = estimate(name, *renumber(constellation, block, first, new))
        pos, status = in_old_numbers(found, constellation, new)
        assert_near(pos, status, as_it_is(name, group), atol, always)


# --- turned and mirrored worlds -----------------------------------------------------------------
def in_another_world(name, group, world):
    """Return positions and status in a rotated or reflected world, mapped to the first world."""
    constellation, block, first = case(group)
    block = states(name, constellation, block)
    if world == "mirrored":
        M = np.diag([1.0, -1.0, 1.0])
        constellation, block = mirror(constellation, block)
    else:
        block, M = turn(block, {"quarter turn": np.pi / 2, "a radian": 1.0}[world])
    found = estimate(name, constellation, block, first @ M.T)
    return found.pos_ij_w @ M, found.status


@on_all_groups
@pytest.mark.parametrize("world", ["quarter turn", "mirrored"])
@pytest.mark.parametrize("name", ["ekf", "ekf-mds"])
def test_worlds_that_turn_the_bank_onto_itself_turn_what_is_ok(name, group, world):
    pos, status = in_another_world(name, group, world)
    assert_near(pos, status, as_it_is(name, group), ROUNDING, False)


@on_all_groups
@pytest.mark.parametrize("world", ["quarter turn", "a radian", "mirrored"])
@pytest.mark.parametrize("name", ["paper-ekf", "paper-ekf-mds"])
def test_any_world_turns_the_papers_filter_with_its_first_layout(name, group, world):
    if world == "mirrored" and case(group)[0].dimensions == 3:
        pytest.skip("three nodes in space are their own mirror image: the fourth is on any side")
    pos, status = in_another_world(name, group, world)
    assert_near(pos, status, as_it_is(name, group), 10.0 * ROUNDING, True)


@on_all_groups
@pytest.mark.parametrize("world", ["quarter turn", "a radian", "mirrored"])
@pytest.mark.parametrize(("name", "most"), [("joint", 1.0), ("ekf-mds", 2.0)])
def test_any_world_moves_what_is_ok_by_less_than_its_expected_error(name, most, group, world):
    """At all times. The first rotation that is followed is another one, as near to the right one
    as its covariance says."""
    pos, status = in_another_world(name, group, world)
    expected = as_it_is(name, group)
    off = np.linalg.norm(pos - expected.pos_ij_w, axis=-1)
    ok = (status == Status.OK) & (expected.status == Status.OK)
    error = np.sqrt(np.trace(expected.cov[..., :3, :3], axis1=-2, axis2=-1))
    assert ok.any()
    assert np.all(off[ok] <= most * error[ok])


@pytest.mark.parametrize("group", ["three cars", "four people", "three people, noise"])
@pytest.mark.parametrize("world", ["quarter turn", "mirrored"])
def test_worlds_that_turn_the_bank_onto_itself_turn_all_that_joint_has_ok(group, world):
    """Of groups that begin in motion: at rest one rotation is followed, whichever it is."""
    pos, status = in_another_world("joint", group, world)
    assert_near(pos, status, as_it_is("joint", group), 10.0 * ROUNDING, False)


# --- clocks, blocks, environments ---------------------------------------------------------------
@on_all_groups
@on_all_filters
@pytest.mark.parametrize("clock", [1e5, 2.0**17])
def test_a_clock_that_began_elsewhere_changes_not_one_bit(name, group, clock):
    """The sums of times and clock are exact in floating point."""
    constellation, block, first = case(group)
    found = estimate(name, constellation, replace(block, t=block.t + clock), first, clock)
    assert_identical(found, as_it_is(name, group))


@on_all_groups
@on_all_filters
def test_a_clock_that_rounds_times_changes_rounding_only(name, group):
    constellation, block, first = case(group)
    clock = 1e5 / 3.0
    found = estimate(name, constellation, replace(block, t=block.t + clock), first, clock)
    assert_near(found.pos_ij_w, found.status, as_it_is(name, group), ROUNDING, True)


@on_all_groups
@on_all_filters
def test_splits_at_any_event_change_not_one_bit(name, group):
    """Cuts may be between simultaneous events."""
    constellation, block, first = case(group)
    rng, tracker = np.random.default_rng(3), make_tracker(name, constellation, first)
    cuts = np.sort(rng.integers(0, block.n_events, 30))
    parts, event, before = [], 0, -np.inf
    for cut in (*cuts, block.n_events):
        end = block.t[0, cut] if cut < block.n_events else np.inf
        due = T[(before <= T) & (end > T)]
        parts.append(tracker.run(block.take(slice(event, cut)), due).take(0))
        event, before = cut, end
    joined = TeamEstimate(
        constellation,
        *(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(TeamEstimate)[1:]),
    )
    assert_identical(joined, as_it_is(name, group))


@on_all_groups
@on_all_filters
def test_an_environment_of_a_batch_is_alone_to_the_last_bit(name, group):
    constellation, block, first = case(group)
    rng = np.random.default_rng(5)
    other = block.take(rng.random(block.n_events) < 0.8)
    tracker = make_tracker(name, constellation, first, n_envs=3)
    batch = tracker.run(MeasurementBlock.stack([other, block, other]), T)
    assert_identical(batch.take(1), as_it_is(name, group))
