"""Invariants of `tracking.filters.base.Filter`, for every registered filter."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tracking import Status, TeamEstimate, Tracker, TrackerParams
from tracking.filters import FILTERS, FilterParams
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import JointState
from tracking.filters.pair.params import PairEkfParams
from tracking.filters.paper import PaperParams
from tracking.filters.paper.state import PaperState
from tracking.measurements import Kind, MeasurementBlock

pytestmark = pytest.mark.parametrize("name", FILTERS)


def assert_identical(a: TeamEstimate, b: TeamEstimate) -> None:
    for f in fields(TeamEstimate)[1:]:
        np.testing.assert_array_equal(getattr(a, f.name), getattr(b, f.name), err_msg=f.name)


def needs_no_layout(name):
    """Skip the paper's algorithm, which needs its initial rotation and reflection as input."""
    if name.startswith("paper"):
        pytest.skip("the paper names no rotation and reflection of the first layout")


def steady(layout):
    """Return parameters of the paper's filter with a first layout and without its speed model.

    With the norm of the velocity, rounding errors grow 1000-fold in two seconds; with small range
    noise of centimetres nearly as much.
    """
    first = tuple(tuple(map(float, p)) for p in layout)
    return PaperParams(
        first_layout=first, accel_std=0.5, range_std=0.1, speed="rate", speed_std=1e3
    )


def put_on_truth(state, group, turn=None, clock=0.0):
    """Set positions and velocities of every hypothesis of a filter's state to the truth.

    `turn` is an optional rotation matrix, `clock` the time origin of the state [s].
    """
    h = 1e-4
    turn = np.eye(3) if turn is None else turn
    if isinstance(state, JointState):
        t = state.group["t"][0] - clock
        vel = (group.pos(t + h)[0] - group.pos(t - h)[0]) / (2 * h)
        for k, node in enumerate(state.nodes[0]):
            d = node["i_vel"] - node["i_pos"]
            state.x[0, :, node["i_pos"] : node["i_pos"] + d] = (turn @ group.pos(t)[0, k])[:d]
            state.x[0, :, node["i_vel"] : node["i_vel"] + d] = (turn @ vel[k])[:d]
            state.x[0, :, node["i_tilt_bias"] : node["i_heading"] + 1] = 0.0
        state.x[0, :, state.nodes[0, -1]["i_heading"] + 1 :] = 0.0
        return
    for p, t in enumerate(state.pairs["t"][0] - clock):
        vel = (group.pairs(t + h)[p] - group.pairs(t - h)[p]) / (2 * h)
        x = state.x[0, p]
        x[..., :3], x[..., 3:6] = turn @ group.pairs(t)[p], turn @ vel
        if not isinstance(state, PaperState):
            x[..., 6] = 0.0


def half_on_truth(name, group, block, turn=None, params=None, clock=0.0):
    """Return the final estimate of a filter that is set to the truth at half time."""
    tracker = Tracker(group.constellation, params, filter=name)
    half = block.n_events // 2
    tracker.step(block.take(slice(0, half)), block.t[0, half - 1])
    saved = tracker.save()
    put_on_truth(saved["filter"], group, turn, clock)
    tracker.restore(saved)
    return tracker.step(block.take(slice(half, None)), group.t[-1] + clock)


def times(group, n=60):
    return np.linspace(0.5, group.t[-1] + 0.05, n)


def test_noiseless_data_keep_zero_error(name, make_group):
    """A filter that is set to the truth keeps it, since its models match the world.

    The speed measurement is disabled: a low-passed derivative lags even without noise.
    """
    group = make_group(n=4, seconds=30.0, hz=250.0)
    pair, paper = PairEkfParams(), PaperParams(speed="rate", speed_std=1e3)
    params = TrackerParams(filter=FilterParams(pair=pair, paper=paper))
    estimate = half_on_truth(name, group, group.block, params=params)
    error = np.linalg.norm(estimate.pos_ij_w[0] - group.pairs(group.t[-1]), axis=-1)
    assert error.max() < 0.02


def test_between_measurements_the_estimate_goes_on_as_fast_as_it_says(name, group):
    """Without measurements, positions change by the reported velocity times the time."""
    last = group.block.t[0, -1]
    t = last + np.arange(0.01, 0.08, 0.01)
    estimate = Tracker(group.constellation, filter=name).run(group.block, t)
    step = np.diff(estimate.pos_ij_w[0], axis=0)
    speed = 0.5 * (estimate.vel_ij_w[0, 1:] + estimate.vel_ij_w[0, :-1])
    assert np.linalg.norm(speed, axis=-1).max() > 0.5
    np.testing.assert_allclose(step, 0.01 * speed, atol=2e-4)


def test_cold_start_finds_rotation_and_mirror_image(name, make_group):
    needs_no_layout(name)
    group = make_group(n=4, seconds=40.0, hz=100.0)
    estimate = Tracker(group.constellation, filter=name).step(group.block, group.t[-1])
    assert (estimate.status == Status.OK).all()
    error = np.linalg.norm(estimate.pos_ij_w[0] - group.pairs(group.t[-1]), axis=-1)
    assert np.median(error) < 0.1


def test_splits_change_nothing(name, group):
    t_out = times(group)
    whole = Tracker(group.constellation, filter=name).run(group.block, t_out)
    rng = np.random.default_rng(3)
    tracker = Tracker(group.constellation, filter=name)
    edges = np.sort(rng.uniform(0.0, t_out[-1], 25))
    edges[-1] = t_out[-1]
    parts, event, out = [], 0, 0
    for edge in edges:
        e = int(np.searchsorted(group.block.t[0], edge, side="right"))
        o = int(np.searchsorted(t_out, edge, side="right"))
        parts.append(tracker.run(group.block.take(slice(event, e)), t_out[out:o]))
        event, out = e, o
    joined = TeamEstimate(
        group.constellation,
        *(
            np.concatenate([getattr(p, f.name) for p in parts], axis=1)
            for f in fields(TeamEstimate)[1:]
        ),
    )
    assert_identical(joined, whole)


def test_environments_of_a_batch_are_alone(name, make_group):
    groups = [make_group(n=3, seconds=8.0, hz=hz) for hz in (50.0, 37.0)]
    t_out = np.linspace(0.5, 7.5, 20)
    batch = Tracker(groups[0].constellation, filter=name, n_envs=2).run(
        MeasurementBlock.stack([g.block for g in groups]), t_out
    )
    for k, g in enumerate(groups):
        alone = Tracker(g.constellation, filter=name).run(g.block, t_out)
        for f in fields(TeamEstimate)[1:]:
            np.testing.assert_array_equal(getattr(batch, f.name)[k], getattr(alone, f.name)[0])


def test_restored_in_mid_run_is_uninterrupted(name, group):
    half = group.block.n_events // 2
    first, second = group.block.take(slice(0, half)), group.block.take(slice(half, None))
    tracker = Tracker(group.constellation, filter=name)
    tracker.step(first, first.t[0, -1])
    saved = tracker.save()
    expected = tracker.step(second, group.t[-1])
    other = Tracker(group.constellation, filter=name)
    other.restore(saved)
    assert_identical(other.step(second, group.t[-1]), expected)


def test_reset_is_new(name, group):
    tracker = Tracker(group.constellation, filter=name)
    expected = tracker.step(group.block, group.t[-1])
    tracker.reset(0)
    assert_identical(tracker.step(group.block, group.t[-1]), expected)


def test_no_events_change_nothing(name, group):
    tracker = Tracker(group.constellation, filter=name)
    first = tracker.step(group.block, group.t[-1])
    tracker.run(MeasurementBlock.empty(), np.linspace(group.t[-1], group.t[-1] + 3.0, 5))
    assert_identical(tracker.step(MeasurementBlock.empty(), group.t[-1]), first)


def test_numbering_nodes_the_other_way_mirrors(name, make_group):
    group = make_group(n=3, seconds=20.0, hz=100.0)
    n = 3
    flip = n - 1 - np.arange(n)
    b = group.block
    turned = replace(
        b, i=flip[b.i], j=flip[b.j], antenna_i=flip[b.antenna_i], antenna_j=flip[b.antenna_j]
    ).sorted()
    constellation = replace(group.constellation, nodes=group.constellation.nodes[::-1])
    first = group.pos(0.05)
    params = [TrackerParams(filter=FilterParams(paper=steady(x))) for x in (first, first[::-1])]
    one = Tracker(group.constellation, params[0], filter=name).step(b, group.t[-1])
    other = Tracker(constellation, params[1], filter=name).step(turned, group.t[-1])
    for i in range(n):
        for j in range(n):
            if i != j:
                a, c = one.between(i, j)[0], other.between(flip[i], flip[j])[0]
                np.testing.assert_allclose(a, c, atol=0.05)


def test_covariance_stays_symmetric_and_positive(name, group):
    estimate = Tracker(group.constellation, filter=name).run(group.block, times(group, 200))
    keep = [0, 1, 3, 4]  # the plane
    running = np.isin(estimate.status, (Status.OK, Status.AMBIGUOUS))
    P = estimate.cov[running][:, keep][:, :, keep]
    np.testing.assert_array_equal(P, np.swapaxes(P, -1, -2))
    assert (np.linalg.eigvalsh(P) > 0.0).all()


@settings(max_examples=25, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 0.9), wild=st.floats(0.0, 0.5))
def test_survives_any_ranges(name, group, seed, share, wild):
    """Lost, repeated and wrong measurements leave estimates finite and positive definite."""
    rng = np.random.default_rng(seed)
    block = group.block.take(np.nonzero(rng.random(group.block.n_events) > share)[0])
    values = block.values.copy()
    odd = (rng.random(block.n_events) < wild) & (block.kind[0] >= 4)
    values[0, odd, 0] = rng.uniform(0.0, 300.0, odd.sum())
    block = replace(block, values=values)
    block = block.take(np.sort(rng.integers(0, max(block.n_events, 1), block.n_events)))
    estimate = Tracker(group.constellation, filter=name).run(block, times(group, 30))
    assert np.isfinite(estimate.pos_ij_w).all()
    assert np.isfinite(estimate.cov).all()
    running = estimate.status >= Status.AMBIGUOUS
    P = estimate.cov[running][:, [0, 1, 3, 4]][:, :, [0, 1, 3, 4]]
    assert (np.linalg.eigvalsh(P) > 0.0).all()


def test_a_node_that_is_silent_leaves_and_returns(name, make_group):
    group = make_group(n=4, seconds=30.0)
    b = group.block
    silent = (b.t[0] > 10.0) & (b.t[0] < 18.0) & ((b.i[0] == 3) | (b.j[0] == 3))
    params = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=1.0)))
    tracker = Tracker(group.constellation, params, filter=name)
    pair = group.constellation.pair_index[0, 3]
    estimate = tracker.run(b.take(~silent), np.array([9.9, 12.0, 17.5, 29.0]))
    status = estimate.status[0, :, pair]
    assert status[0] == Status.OK
    assert status[1] == Status.LOST
    assert status[2] in (Status.ABSENT, Status.STARTING)
    assert status[3] in (Status.OK, Status.AMBIGUOUS)
    others = group.constellation.pair_index[0, 1]
    assert (estimate.status[0, :3, others] == Status.OK).all()


def test_a_surveyed_node_that_falls_silent_comes_back(name, make_group):
    """A surveyed distance is kept when the node's filter states are removed."""
    group = make_group(n=4, seconds=24.0)
    nodes = list(group.constellation.nodes)
    for k in (2, 3):
        nodes[k] = replace(nodes[k], kind="static")
    constellation = replace(group.constellation, nodes=tuple(nodes))
    b = group.block
    fixed = group.pos(np.array([0.0]))[0, 2:]
    pos = group.pos(b.t[0])
    pos[:, 2:] = fixed
    rows = np.arange(b.n_events)
    values = b.values.copy()
    ranged = b.kind[0] == Kind.RANGE
    length = np.linalg.norm(pos[rows, b.j[0]] - pos[rows, b.i[0]], axis=-1)
    values[0, ranged, 0] = length[ranged]
    both = ranged & (b.i[0] == 2) & (b.j[0] == 3)
    inertial_of_fixed = (b.kind[0] == Kind.STATE) & (b.i[0] >= 2)
    silent = ranged & (b.j[0] == 3) & (b.t[0] > 6.0) & (b.t[0] < 14.0)
    kept = replace(b, values=values).take(~both & ~inertial_of_fixed & ~silent)
    two, three = np.array([2]), np.array([3])
    distance = np.array([[np.linalg.norm(fixed[1] - fixed[0])]])
    survey = MeasurementBlock.of_kind(
        Kind.SURVEY, np.array([0.001]), two, distance, j=three, antennas=(two, three)
    )
    block = MeasurementBlock.concatenate([survey, kept]).sorted()
    estimate = Tracker(constellation, filter=name).run(block, np.array([5.0, 13.0, 23.0])).take(0)
    pair = constellation.pair_index[2, 3]
    assert estimate.status[1, pair] in (Status.ABSENT, Status.STARTING)
    assert estimate.status[2, pair] in (Status.OK, Status.AMBIGUOUS)
    if name == "joint":
        # As accurate as the survey, at the start and after the return.
        length = np.linalg.norm(estimate.pos_ij_w[[0, 2], pair], axis=-1)
        np.testing.assert_allclose(length, distance[0, 0], atol=0.01)


def test_turning_the_world_turns_the_estimate(name, group):
    """All accelerations and orientations are rotated by 90 degrees, ranges are unchanged.

    The filter is set to the truth at half time: a wrong hypothesis converges from an unstable
    equilibrium, which amplifies rounding errors by 10^6. `joint` propagates one rotation for all
    in the first half second; its effect on the covariance decays slowly. In `ekf` only
    accelerations determine a pair across its line of sight, so rounding errors grow there.
    """
    atol = {"joint": 1e-4, "ekf": 1e-5}.get(name, 1e-6)
    b = group.block
    values = b.values.copy()
    state = b.kind[0] == Kind.STATE
    x, y = b.values[0, state, 4].copy(), b.values[0, state, 5].copy()
    values[0, state, 4], values[0, state, 5] = -y, x
    values[0, state, 0] = values[0, state, 3] = np.sqrt(0.5)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    layouts = [group.pos(0.1) @ R.T for R in (np.eye(3), turn)]
    params = [TrackerParams(filter=FilterParams(paper=steady(layout))) for layout in layouts]
    one = half_on_truth(name, group, b, params=params[0])
    other = half_on_truth(name, group, replace(b, values=values), turn, params[1])
    np.testing.assert_allclose(other.pos_ij_w, one.pos_ij_w @ turn.T, atol=atol)
    np.testing.assert_allclose(other.vel_ij_w, one.vel_ij_w @ turn.T, atol=atol)
    for i, j in group.constellation.pairs:
        for a, c in zip(one.between_b(i, j), other.between_b(i, j), strict=True):
            np.testing.assert_allclose(a, c, atol=atol)
    np.testing.assert_allclose(
        one.relative_orientation(0, 1), other.relative_orientation(0, 1), atol=1e-9
    )


def test_shifting_the_clock_changes_nothing(name, group):
    """Cold start; filters without MDS and the paper's are set to the truth at half time, since
    their starts amplify rounding errors: in `ekf`, 1e-13 m in the first ranges becomes 1 mm."""
    shifted, end = replace(group.block, t=group.block.t + 512.0), group.t[-1]
    if name not in ("joint", "ekf-mds"):
        one = half_on_truth(name, group, group.block)
        other = half_on_truth(name, group, shifted, clock=512.0)
    else:
        one = Tracker(group.constellation, filter=name).step(group.block, end)
        other = Tracker(group.constellation, filter=name).step(shifted, end + 512.0)
    np.testing.assert_allclose(one.pos_ij_w, other.pos_ij_w, atol=1e-4)
