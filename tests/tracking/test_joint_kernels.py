"""Algebra of the joint filter: derivatives, gauge, long runs."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tracking import Constellation, NodeConfig
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.ekf import (
    gauge,
    observability,
    preintegration,
    propagation,
    scalar_update,
)
from tracking.filters.joint.ekf.workspace import make_workspace
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.joint.hypotheses.bank import flush_all_updates
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import JointState, make_layout, make_state
from tracking.filters.joint.updates.range_update import predict_range
from tracking.geometry import GRAVITY
from tracking.records import as_records


def running(dimensions, vehicle="car", seed=0, static=()):
    """Return one environment, three nodes, one hypothesis, with random states and increments."""
    nodes = tuple(
        NodeConfig(id=k, vehicle=vehicle, kind="static" if k in static else "moving")
        for k in (1, 2, 3)
    )
    constellation = Constellation(nodes=nodes, dimensions=dimensions)
    params = JointParams()
    c = as_records(make_coefficients(constellation, params))
    batch = make_state(constellation, params, 1, 1)
    s = JointState._make(as_records(a[0]) if a.dtype.names else a[0] for a in batch)
    rng = np.random.default_rng(seed)
    n = int(c[0]["n"])
    s.x[0] = rng.uniform(-2.0, 2.0, n)
    s.nodes["present"], s.alive[0] = True, True
    s.group["n_alive"], s.group["alignment"] = 1, Alignment.FILTERED
    for k in range(3):
        if not s.nodes["static"][k]:
            s.x[0, s.nodes["i_heading"][k]] *= 0.05
        s.last_attitude_accel[k, :4] = rng.standard_normal(4)
        s.last_attitude_accel[k, :4] /= np.linalg.norm(s.last_attitude_accel[k, :4])
        s.last_attitude_accel[k, 4:] = rng.standard_normal(3)
        yaw = rng.uniform(-3.0, 3.0)
        s.nodes["cos_yaw"][k], s.nodes["sin_yaw"][k] = np.cos(yaw), np.sin(yaw)
    s.nodes["has_state"], s.nodes["t_state"] = True, 0.0
    s.nlos[:] = 0.0
    return c[0], s, make_workspace(3, 3, n), make_layout(constellation, params)


def propagate(c, s, work, x, P, t=0.05):  # noqa: N803
    """Return states and covariance after dead reckoning from x, P to t."""
    s.x[0], s.P[0] = x, P
    s.preintegrated[:], s.nodes["t_pre"] = 0.0, 0.0
    for k in range(3):
        if not s.nodes["static"][k]:
            preintegration.preintegrate(
                c, s.nodes, s.last_attitude_accel, s.preintegrated, k, 0.5 * t
            )
            preintegration.preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, k, t)
    propagation.predict(c, s, 0, t, work)
    return s.x[0].copy(), s.P[0].copy()


@pytest.mark.parametrize("vehicle", ["car", "human", "hand", "hand, told"])
@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("static", [(), (3,)])
def test_prediction_is_that_of_its_own_derivatives(dimensions, vehicle, static):
    """The reference is P -> F P F^T + Q, F by finite differences and Q from P = 0."""
    vehicle, *told = vehicle.split(", ")
    c, s, work, _ = running(dimensions, vehicle, static=static)
    s.nodes["has_ahrs_feedback"] = (s.nodes["i_gyro_bias"] >= 0) & bool(told)
    s.nodes["by_gyroscope"] = True
    n = s.x.shape[1]
    # Range errors decay with the speed; their derivative by it is omitted on purpose.
    x0 = s.x[0].copy()
    first_error = s.pairs["i_range_error"][s.pairs["i_range_error"] >= 0].min()
    x0[first_error:] = 0.0
    A = np.random.default_rng(1).standard_normal((n, n))
    P0 = A @ A.T / n
    _, P1 = propagate(c, s, work, x0, P0)
    _, Q = propagate(c, s, work, x0, np.zeros((n, n)))
    F, h = np.zeros((n, n)), 1e-6
    for k in range(n):
        step = np.zeros(n)
        step[k] = h
        ahead, _ = propagate(c, s, work, x0 + step, P0)
        behind, _ = propagate(c, s, work, x0 - step, P0)
        F[:, k] = (ahead - behind) / (2.0 * h)
    np.testing.assert_allclose(P1, F @ P0 @ F.T + Q, atol=2e-7)


@pytest.mark.parametrize("vehicle", ["car", "hand, told"])
def test_prediction_takes_off_what_waits(vehicle):
    vehicle, *told = vehicle.split(", ")
    c, s, work, _ = running(3 if told else 2, vehicle)
    s.nodes["has_ahrs_feedback"] = (s.nodes["i_gyro_bias"] >= 0) & bool(told)
    n = s.x.shape[1]
    rng = np.random.default_rng(3)
    W = rng.standard_normal((1, 16, n))
    s = s._replace(pending_updates=W)
    A = rng.standard_normal((n, n))
    s.nodes["heading_tau"], s.nodes["bias_tau"] = 0.05, 0.02
    x0, P0 = s.x[0].copy(), A @ A.T + 100.0 * np.eye(n)
    _, settled = propagate(c, s, work, x0, P0 - W[0, :5].T @ W[0, :5])
    assert s.n_pending[0] == 0
    s.n_pending[0] = 5
    _, found = propagate(c, s, work, x0, P0)
    assert s.n_pending[0] == 0
    np.testing.assert_allclose(found, settled, atol=1e-9)


def sum_since(c, s, since):
    """Preintegrate samples of all nodes over `since` [s]."""
    for k in range(3):
        preintegration.preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, k, since)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("since", "atol"), [(0.0, 1e-7), (0.02, 2e-3)])
def test_range_has_its_own_derivatives(dimensions, seed, since, atol):
    """Derivatives by biases and heading errors of the increments since the states are omitted."""
    c, s, work, _ = running(dimensions, seed=seed)
    sum_since(c, s, since)
    lever_i, lever_j = np.array([0.3, -0.2, 0.1]), np.array([-0.1, 0.4, 0.2])
    _, m = predict_range(c, s, 0, 1, lever_i, lever_j, work.idx, work.val)
    written = np.zeros(s.x.shape[1])
    written[work.idx[:m]] = work.val[:m]
    for k in range(len(written)):
        values = []
        for h in (1e-6, -1e-6):
            s.x[0, k] += h
            idx, val = work.idx.copy(), work.val.copy()
            values.append(predict_range(c, s, 0, 1, lever_i, lever_j, idx, val)[0])
            s.x[0, k] -= h
        assert written[k] == pytest.approx((values[0] - values[1]) / 2e-6, abs=atol)


@pytest.mark.parametrize("vehicle", ["car", "human", "hand"])
@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_range_is_the_same_before_and_after_carrying(dimensions, vehicle):
    c, s, work, layout = running(dimensions, vehicle)
    s.x[0, s.pairs["i_range_error"].min() :] = 0.0
    lever = np.zeros(3)
    sum_since(c, s, 0.02)
    late, _ = predict_range(c, s, 0, 1, lever, lever, work.idx, work.val)
    at_t0 = s.x[0].copy()
    propagation.predict(c, s, 0, 0.02, work)
    s.preintegrated[:] = 0.0
    at_once, _ = predict_range(c, s, 0, 1, lever, lever, work.idx, work.val)
    assert late == pytest.approx(at_once, abs=1e-12)
    s.x[0] = at_t0
    before, _ = predict_range(c, s, 0, 1, lever, lever, work.idx, work.val)
    assert abs(before - late) > 1e-3


@pytest.mark.parametrize("dimensions", [2, 3])
def test_moving_the_centre_changes_nothing_relative(dimensions):
    c, s, work, _ = running(dimensions)
    n, d = s.x.shape[1], dimensions
    A = np.random.default_rng(2).standard_normal((n, n))
    s.P[0] = A @ A.T / n + 0.01 * np.eye(n)
    at = s.nodes["i_pos"]
    difference = np.zeros((2 * d, n))
    for k in range(d):
        difference[k, at[1] + k], difference[k, at[0] + k] = 1.0, -1.0
        difference[d + k, at[2] + k], difference[d + k, at[0] + k] = 1.0, -1.0
    x0, P0 = difference @ s.x[0], difference @ s.P[0] @ difference.T
    gauge.centre(c, s, 0, work.w)
    np.testing.assert_allclose(difference @ s.x[0], x0, atol=1e-12)
    np.testing.assert_allclose(difference @ s.P[0] @ difference.T, P0, atol=1e-12)
    centre = np.mean([s.x[0, a : a + d] for a in at], axis=0)
    np.testing.assert_allclose(centre, 0.0, atol=1e-12)
    assert np.linalg.eigvalsh(s.P[0])[0] > 0.0


def holding(x, P, room):  # noqa: N803
    """Return one hypothesis of given states, with room for `room` pending updates."""
    n = len(x)
    none = dict.fromkeys(JointState._fields)
    return JointState(**none)._replace(
        x=x[None].copy(),
        P=P[None].copy(),
        pending_updates=np.zeros((1, room, n)),
        n_pending=np.zeros(1, dtype=np.int64),
        accumulated_correction=np.zeros((1, n)),
        alive=np.ones(1, dtype=bool),
    )


@settings(max_examples=30, suppress_health_check=list(HealthCheck))
@given(
    seed=st.integers(0, 2**31),
    n=st.integers(2, 60),
    m=st.integers(1, 6),
    corrections=st.integers(1, 12),
    room=st.sampled_from([0, 4, 8, 16]),
)
def test_corrections_are_the_textbook_ones(seed, n, m, corrections, room):
    """Values of the covariance include pending updates."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    P, x = A @ A.T + 0.1 * np.eye(n), rng.standard_normal(n)
    work = make_workspace(3, 3, n)._replace(share=np.zeros(16))
    s, moved, nu, R = holding(x, P, room), np.zeros(n), 0.7, 0.3
    for _ in range(corrections):
        idx, H = rng.permutation(n)[: min(m, n)], np.zeros(n)
        H[idx] = rng.standard_normal(len(idx))
        work.idx[: len(idx)], work.val[: len(idx)] = idx, H[idx]
        K = P @ H / (H @ P @ H + R)
        variance = scalar_update.compute_pht(s, 0, len(idx), work)
        assert variance == pytest.approx(H @ P @ H, abs=1e-8)
        np.testing.assert_allclose(work.w, P @ H, atol=1e-7)
        scalar_update.kalman_update(s, 0, work.w, nu, variance + R)
        x, moved = x + K * nu, moved + K * nu
        left = np.eye(n) - np.outer(K, H)
        P = left @ P @ left.T + R * np.outer(K, K)  # Joseph
        a, b = rng.integers(n, size=2)
        assert scalar_update.covariance(s, 0, a, b) == pytest.approx(P[a, b], abs=1e-8)
    np.testing.assert_allclose(s.x[0], x, atol=1e-8)
    np.testing.assert_allclose(s.accumulated_correction[0], moved, atol=1e-8)
    flush_all_updates(s)
    assert s.n_pending[0] == 0
    np.testing.assert_allclose(s.P[0], P, atol=1e-7)
    np.testing.assert_array_equal(s.P[0], s.P[0].T)


def test_a_body_that_leans_for_good_is_followed_as_if_it_did_not():
    """Its bias is gravity seen through the tilt; 0.02 rad make 0.2 m/s2."""
    c, s, work, _ = running(3, "hand")
    n, t, lean = s.x.shape[1], 0.2, np.array([0.02, -0.015, 0.0])
    accel, gravity = np.array([3.0, -2.0, 1.5]), np.array([0.0, 0.0, GRAVITY])
    x, p, v, b = np.zeros(n), s.nodes["i_pos"][0], s.nodes["i_vel"][0], s.nodes["i_tilt_bias"][0]
    s.last_attitude_accel[:, 4:] = 0.0
    s.last_attitude_accel[0, 4:] = Rotation.from_rotvec(lean).apply(accel + gravity) - gravity
    off, _ = propagate(c, s, work, x, np.eye(n), t)
    x[b : b + 3] = np.cross(lean, gravity)
    true, _ = propagate(c, s, work, x, np.eye(n), t)
    way, speed = 0.5 * t * t * accel, t * accel
    assert np.abs(off[v : v + 3] - speed).max() > 0.03
    # The remainder is of second order in the tilt.
    np.testing.assert_allclose(true[v : v + 3], speed, atol=1e-3)
    np.testing.assert_allclose(true[p : p + 3], way, atol=1e-4)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_the_covariance_of_a_rotation_follows_the_estimate(dimensions):
    """A group with only its rotation unknown remains one after a correction."""
    c, s, work, _ = running(dimensions, "human")
    n, h = s.x.shape[1], 1e-3
    axes = range(3) if dimensions == 3 else [0]

    def blind(x):
        directions = np.zeros((n, len(axes)))
        for q in axes:
            u, v = (3 - q) % 3, (4 - q) % 3
            for at, mean in ((s.nodes["i_pos"], True), (s.nodes["i_vel"], False)):
                values = x[at[:, None] + np.arange(dimensions)]
                values = values - values.mean(axis=0) * mean
                directions[at + u, q], directions[at + v, q] = -values[:, v], values[:, u]
        return directions

    before = s.x[0].copy()
    N0 = blind(before)
    s.P[0] = N0 @ N0.T
    s.accumulated_correction[0] = h * np.random.default_rng(3).standard_normal(n)
    s.x[0] += s.accumulated_correction[0]
    N1 = blind(s.x[0])
    observability.shift_nullspace(c, s, 0, 1.0, work)
    moved, left = np.abs(N1 @ N1.T - N0 @ N0.T).max(), np.abs(s.P[0] - N1 @ N1.T).max()
    assert left < 0.02 * moved
    np.testing.assert_allclose(s.P[0], s.P[0].T, atol=1e-12)
    assert not s.accumulated_correction.any()


@pytest.mark.parametrize("dimensions", [2, 3])
def test_it_is_followed_by_the_product_of_matrices(dimensions):
    """The reference is ``T P T^T`` with ``T = 1 + share G A^T``; one node is fixed."""
    c, s, work, _ = running(dimensions, "human", static=(2,))
    n, rng, share = s.x.shape[1], np.random.default_rng(8), 0.4
    root = rng.standard_normal((n, n))
    s.P[0], s.accumulated_correction[0] = root @ root.T, 0.0
    at_p = s.nodes["i_pos"][:, None] + np.arange(dimensions)
    at_v = s.nodes["i_vel"][~s.nodes["static"]][:, None] + np.arange(dimensions)
    s.accumulated_correction[0, at_p], s.accumulated_correction[0, at_v] = (
        1e-4,
        1e-4 * rng.standard_normal(at_v.shape),
    )
    s.accumulated_correction[0, at_p] += 1e-4 * rng.standard_normal(at_p.shape)
    x0, P0, moved = (
        s.x[0] - s.accumulated_correction[0],
        s.P[0].copy(),
        s.accumulated_correction[0].copy(),
    )  # noqa: N806
    axes = np.eye(3) if dimensions == 3 else np.eye(3)[2:]

    def turned(values):
        full = np.zeros((len(values), 3))
        full[:, :dimensions] = values
        return np.stack([np.cross(axis, full)[:, :dimensions] for axis in axes])

    N, G = np.zeros((len(axes), n)), np.zeros((len(axes), n))
    N[:, at_p] = turned(x0[at_p] - x0[at_p].mean(axis=0))
    G[:, at_p] = turned(moved[at_p] - moved[at_p].mean(axis=0))
    G[:, at_v] = turned(moved[at_v])
    M = N @ N.T
    M += (1e-3 * np.trace(M) + 1e-9) * np.eye(len(axes))
    T = np.eye(n) + share * G.T @ np.linalg.solve(M, N)
    observability.shift_nullspace(c, s, 0, share, work)
    np.testing.assert_allclose(s.P[0], T @ P0 @ T.T, atol=1e-6 * np.abs(T @ P0 @ T.T - P0).max())
    np.testing.assert_array_equal(s.P[0], s.P[0].T)


def test_a_group_that_is_turned_back_and_forth_keeps_its_shape():
    """Every correction is tangential, which alone would stretch the group by 80 % in the end."""
    c, s, work, _ = running(3, "human")
    rng, d = np.random.default_rng(4), 3
    at_p, at_v = (s.nodes[k][:, None] + np.arange(d) for k in ("i_pos", "i_vel"))

    def lengths():
        x, v = s.x[0, at_p], s.x[0, at_v]
        between = np.linalg.norm(x[:, None] - x, axis=-1)
        return np.concatenate([between.ravel(), np.linalg.norm(v, axis=1)])

    before, centre = lengths(), s.x[0, at_p].mean(axis=0)
    for _ in range(30):
        w = rng.uniform(-0.2, 0.2, 3)
        for at, about in ((at_p, s.x[0, at_p].mean(axis=0)), (at_v, np.zeros(d))):
            s.accumulated_correction[0, at] = np.cross(w, s.x[0, at] - about)
        s.x[0] += s.accumulated_correction[0]
        observability.shift_nullspace(c, s, 0, 1.0, work)
    np.testing.assert_allclose(lengths(), before, rtol=5e-3)
    np.testing.assert_allclose(s.x[0, at_p].mean(axis=0), centre, atol=1e-12)
