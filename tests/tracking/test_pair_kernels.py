"""Group refinement, NLOS and wheel constraints of pair filters: properties and references."""

from dataclasses import replace

import numpy as np
import pytest

from tracking.constellation import Constellation, NodeConfig
from tracking.filters.pair import mds_feedback, motion_constraints, nlos_model, range_update
from tracking.filters.pair.params import PairEkfParams
from tracking.filters.pair.state import FilterState, make_coefficients, make_layout, make_state
from tracking.maths.mds import refine_positions, weighted_mds
from tracking.mount import Mount
from tracking.records import as_records
from tracking.tracker import Tracker

Y = {2: [0, 1, 3, 4], 3: [0, 1, 2, 3, 4, 5]}


MOUNT = Mount(ahead=0.15, slip=0.018)


def team(n=3, d=2, vehicle="car", params=None):
    """Return coefficients, tables and state of one running hypothesis with covariance 0.1."""
    params = params or PairEkfParams()
    nodes = tuple(NodeConfig(id=k, vehicle=vehicle, mount=MOUNT) for k in range(n))
    constellation = Constellation(nodes=nodes, dimensions=d)
    c = as_records(make_coefficients(constellation, params, use_mds=True))[0]
    s = make_state(constellation, params, 1, 1)
    for name in ("present", "has_state"):
        s.nodes[name] = True
    s.alive[:] = True
    for k in [*Y[d], 6]:
        s.P[..., k, k] = 0.1
    s.mean_cov[..., 0, 0] = s.mean_cov[..., 1, 1] = 4.0
    s.group["n_alive"] = 1
    env = FilterState(*(as_records(a)[0] for a in s))
    return c, make_layout(constellation, params), env, constellation.pairs


def compiled_mds(x, P, pairs, d):
    """Run the kernels of a refinement over all nodes; return new states, (pair, 7)."""
    n, m = int(pairs.max()) + 1, 2 * d
    states, cov = x[:, None].copy(), P[:, None].copy()
    rows = (n - 1) * m
    W, A, y = np.zeros((len(pairs), 6, 6)), np.zeros((rows, rows)), np.zeros(rows)
    for p, (a, b) in enumerate(pairs):
        mds_feedback.weigh(cov, p, 0, d, np.zeros((6, 6)), W)
        mds_feedback.add_pair(states, p, 0, d, W, a, b, A, y)
    mds_feedback.factor(A, rows)
    mds_feedback.solve(A, y, rows)
    for p, (a, b) in enumerate(pairs):
        mds_feedback.move_pair(states, cov, p, 0, d, W, a, b, y, np.zeros(6))
    return states[:, 0]


def random_team(rng, n, d, noise):
    """Return consistent states, noisy states, and covariances of the pairs of n nodes."""
    pairs = np.stack(np.triu_indices(n, k=1), axis=1)
    node = np.zeros((n, 7))
    node[:, Y[d]] = rng.uniform(-2.0, 2.0, (n, 2 * d))
    exact = node[pairs[:, 1]] - node[pairs[:, 0]]
    used = [*Y[d], 6]
    P = np.zeros((len(pairs), 7, 7))
    root = rng.standard_normal((len(pairs), len(used), len(used)))
    P[:, np.array(used)[:, None], used] = root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(len(used))
    noisy = exact.copy()
    noisy[:, used] += noise * rng.standard_normal((len(pairs), len(used)))
    return pairs, exact, noisy, P


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("n", [3, 4, 6])
def test_weighted_mds_is_its_plain_twin(n, d):
    rng = np.random.default_rng(10 * n + d)
    for _ in range(5):
        pairs, _, noisy, P = random_team(rng, n, d, 0.3)
        cols = np.array(Y[d])
        moved = compiled_mds(noisy, P, pairs, d)
        P_yy = P[:, cols[:, None], cols]
        y = weighted_mds(noisy[:, cols], P_yy, pairs)
        expected = y[pairs[:, 1]] - y[pairs[:, 0]]
        np.testing.assert_allclose(moved[:, cols], expected, atol=1e-4)
        gain = np.linalg.solve(P_yy, P[:, cols, 6][..., None])[..., 0]
        e = noisy[:, 6] + np.sum(gain * (expected - noisy[:, cols]), axis=-1)
        np.testing.assert_allclose(moved[:, 6], e, atol=1e-4)


@pytest.mark.parametrize("d", [2, 3])
def test_weighted_mds_leaves_what_is_consistent(d):
    pairs, exact, _, P = random_team(np.random.default_rng(3), 5, d, 0.0)
    np.testing.assert_allclose(compiled_mds(exact, P, pairs, d), exact, atol=1e-9)


def test_weighted_mds_moves_a_line_into_no_mirror_image():
    """The layout is almost a line, which classical MDS cannot align; the result is regular."""
    pairs, exact, _, P = random_team(np.random.default_rng(4), 4, 2, 0.0)
    exact[:, 1] *= 1e-9
    np.testing.assert_allclose(compiled_mds(exact, P, pairs, 2), exact, atol=1e-9)


def test_certain_lengths_make_it_classical_mds_with_procrustes():
    """To first order: the three distances in the plane are kept, and the rotation is common."""
    rng = np.random.default_rng(5)
    pairs = np.array([[0, 1], [0, 2], [1, 2]])
    for _ in range(10):
        p = np.array([[0.0, 0.0], [2.0, 0.3], [0.7, 1.8]])
        x = p[pairs[:, 1]] - p[pairs[:, 0]] + 0.01 * rng.standard_normal((3, 2))
        u = x / np.linalg.norm(x, axis=-1, keepdims=True)
        cov = np.eye(2) - (1.0 - 1e-6) * u[:, :, None] * u[:, None, :]
        y = weighted_mds(x, cov, pairs)
        full = np.zeros((3, 3, 3))
        full[pairs[:, 0], pairs[:, 1], :2], full[pairs[:, 1], pairs[:, 0], :2] = x, -x
        classical = refine_positions(full, 2)[:, :2]
        np.testing.assert_allclose(y - y.mean(axis=0), classical, atol=1e-3)


def test_range_error_fades_to_what_it_is_without_news():
    c, _, s, _ = team()
    s.x[0, 0], s.P[0, 0, 0, 6], s.P[0, 0, 6, 0] = [2, 1, 0, 1, 0, 0, 0.3], 0.05, 0.05
    for _ in range(200):
        nlos_model.decay_range_error(c, s, 0, 0, 0.2)
    assert s.x[0, 0, 6] == pytest.approx(0.0, abs=1e-6)
    assert s.P[0, 0, 0, 6] == pytest.approx(0.0, abs=1e-6)
    assert s.P[0, 0, 6, 6] == pytest.approx(c["slow_var"])


def apply_constraint(excess, evidence, repeats=6):
    """Return NLOS probability and state after ranges that are too long."""
    c, layout, s, _ = team()
    s.x[0, 0, 0], s.pairs["n_ranges"][0] = 2.0, 1
    s.pairs["mean_distance"][0] = 2.0 + excess
    s.P[0, 0] *= 0.01
    s.P[0, 0, 6, 6] = c["slow_var"]
    for k in range(repeats):
        t = 0.04 * (k + 1)
        range_update.range_update(
            c, s, layout, 0, t, 2.0 + excess, evidence, 0, 1, np.zeros((2, 7))
        )
    assert np.linalg.eigvalsh(s.P[0, 0][np.ix_([0, 1, 3, 4, 6], [0, 1, 3, 4, 6])]).min() > 0.0
    return s.nlos[0, 0], s.x[0, 0]


def test_a_long_range_with_a_weak_first_path_is_no_line_of_sight():
    nlos, x = apply_constraint(0.3, 1.0)
    assert nlos > 0.9
    assert x[6] > 0.15
    assert abs(x[0] - 2.0) < 0.1


def test_a_right_range_with_a_strong_first_path_is_in_sight():
    nlos, x = apply_constraint(0.0, -1.0)
    assert nlos < 0.01
    assert x[0] == pytest.approx(2.0, abs=0.01)


def roll(s, speeds, yaws, axle=MOUNT.ahead, slip=MOUNT.slip, rates=(0.3, -0.2, 0.5)):
    """Move cars within their wheel constraints; return velocities, (3, 2)."""
    s.nodes["yaw"], s.nodes["yaw_rate"] = yaws, rates
    f = np.stack([np.cos(yaws), np.sin(yaws)], axis=-1)
    left = np.stack([-f[:, 1], f[:, 0]], axis=-1)
    forward = np.asarray(speeds)[:, None]
    return forward * f + (axle - slip * forward**2) * np.asarray(rates)[:, None] * left


def test_wheels_leave_what_rolls():
    c, layout, s, pairs = team()
    v = roll(s, [1.0, 0.5, 1.5], np.array([0.3, 2.0, -1.0]))
    s.x[:, 0, 3:5] = v[pairs[:, 1]] - v[pairs[:, 0]]
    s.mean_v[0] = v.mean(axis=0)
    before = s.x.copy()
    motion_constraints.apply_motion_constraints(c, s, layout, 0.05, np.zeros((2, 7)))
    np.testing.assert_allclose(s.x, before, atol=1e-12)
    np.testing.assert_allclose(s.mean_v[0], v.mean(axis=0), atol=1e-12)


def test_wheels_find_the_mean_velocity_and_what_slides():
    c, layout, s, pairs = team(params=PairEkfParams())
    v = roll(s, [1.0, 0.5, 1.5], np.array([0.3, 2.0, -1.0]))
    s.x[:, 0, 3:5] = v[pairs[:, 1]] - v[pairs[:, 0]]
    s.P[..., 3, 3] = s.P[..., 4, 4] = 1e-4
    for _ in range(200):
        motion_constraints.apply_motion_constraints(c, s, layout, 0.0, np.zeros((2, 7)))
    np.testing.assert_allclose(s.mean_v[0], v.mean(axis=0), atol=0.01)
    s.P[..., 3, 3] = s.P[..., 4, 4] = 0.04
    s.x[:, 0, 3:5] += [[0.2, 0.1], [-0.1, 0.2], [-0.3, 0.1]]
    for _ in range(200):
        motion_constraints.apply_motion_constraints(c, s, layout, 0.0, np.zeros((2, 7)))
    yaw, m = s.nodes["yaw"], s.mean_v[0]
    for i in range(3):
        r = motion_constraints.velocity_in_group(s, layout, 0, i, 3)
        left = -np.sin(yaw[i]) * (m[0] + r[0]) + np.cos(yaw[i]) * (m[1] + r[1])
        assert left == pytest.approx(0.15 * s.nodes["yaw_rate"][i], abs=0.02)
    for p in range(3):
        assert np.linalg.eigvalsh(s.P[p, 0][np.ix_(Y[2], Y[2])]).min() > 0.0


def test_wheels_are_those_of_cars():
    c, layout, s, _ = team(vehicle="human")
    s.x[:, 0, 3:5] = 1.0
    before = s.x.copy()
    motion_constraints.apply_motion_constraints(c, s, layout, 0.05, np.zeros((2, 7)))
    np.testing.assert_array_equal(s.x, before)


def test_shifting_the_clock_leaves_the_mean_velocity_of_cars(group):
    nodes = tuple(replace(node, vehicle="car") for node in group.constellation.nodes)
    cars = replace(group.constellation, nodes=nodes)
    begun = group.block.take(group.block.t[0] < 0.5)
    means = []
    for clock in (0.0, 512.0):
        tracker = Tracker(cars, filter="ekf-mds")
        tracker.step(replace(begun, t=begun.t + clock), 0.5 + clock)
        means.append(tracker.save()["filter"].mean_v)
    assert np.any(means[0] != 0.0)
    np.testing.assert_allclose(means[0], means[1], atol=1e-9)


def test_large_groups_are_refined_less_often():
    params = PairEkfParams()
    nodes = tuple(NodeConfig(id=k) for k in range(6))
    small = Constellation(nodes=nodes, dimensions=3)
    large = replace(small, nodes=tuple(NodeConfig(id=k) for k in range(40)))
    assert make_coefficients(small, params, use_mds=True)["mds_period"] == params.mds.period
    assert make_coefficients(large, params, use_mds=True)["mds_period"] > params.mds.period


@pytest.mark.parametrize("n", [3, 6, 10])
def test_wheels_leave_a_covariance_beside_a_node_that_just_joined(n):
    """Its pairs do not know its velocity; those of other nodes nearly determine theirs."""
    c, layout, s, pairs = team(n=n)
    is_new = (pairs == n - 1).any(axis=-1)
    cols = [*Y[2], 6]
    s.P[:] = 0.0
    for k in cols:
        s.P[:, 0, k, k] = np.where(is_new, 1.0, 1e-3)
    s.mean_cov[0] = 1e-3 * np.eye(2)
    s.nodes["yaw"] = np.linspace(0.0, 3.0, n)
    for _ in range(20):
        before = s.P[:, 0].copy()
        motion_constraints.apply_motion_constraints(c, s, layout, 0.0, np.zeros((2, 7)))
        after = s.P[:, 0]
        np.testing.assert_array_equal(after, np.swapaxes(after, 1, 2))
        assert np.linalg.eigvalsh(after[:, cols][:, :, cols]).min() > 0.0
        assert np.linalg.eigvalsh(before - after).min() > -1e-12


def test_a_share_is_a_half_where_all_pairs_are_alike():
    for m in (3, 6, 10):
        own = 0.5 / m * (m - 1) * 0.2
        assert motion_constraints.own_share(0.2, own) == 0.5


def test_a_share_correlates_no_more_than_fully():
    for pair in (1e-6, 0.1, 1.0, 50.0):
        for own in (1e-9, 1e-3, 0.1, 10.0):
            share = motion_constraints.own_share(pair, own)
            assert 0.0 < share <= 0.5
            assert (share * pair) ** 2 <= pair * own * (1.0 + 1e-12)
