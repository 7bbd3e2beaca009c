"""Kernels of the joint filter against plain twins in numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import config, njit

from tracking import Constellation, NodeConfig
from tracking.arrays import aligned
from tracking.filters._level_kernels import angle_between, direction
from tracking.filters.joint import _product_kernels
from tracking.filters.joint._agreement_kernels import SAME_TURN, are_same, turn_between
from tracking.filters.joint._copy_kernels import turn_hypothesis
from tracking.filters.joint._product_kernels import take_off, take_off_plainly
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.records import as_records
from tracking.filters.joint.state import JointState, make_state
from tracking.geometry import quat_from_yaw

angles = st.floats(-3.1, 3.1)


def bank(dimensions, kinds=("moving", "moving", "moving"), n_hyps=2, seed=0):
    """One environment with hypotheses of random states and covariances."""
    nodes = tuple(NodeConfig(id=k, kind=kind) for k, kind in enumerate(kinds))
    constellation = Constellation(nodes=nodes, dimensions=dimensions)
    c = as_records(make_coefficients(constellation, JointParams()))[0]
    batch = make_state(constellation, JointParams(), 1, n_hyps)
    s = JointState._make(as_records(a[0]) if a.dtype.names else a[0] for a in batch)
    rng = np.random.default_rng(seed)
    s.nodes["present"], s.alive[:] = True, True
    s.x[:] = rng.uniform(-2.0, 2.0, s.x.shape)
    A = rng.standard_normal(s.P.shape)
    s.P[:] = A @ np.swapaxes(A, -1, -2)
    return c, s


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("kinds", [("moving",) * 3, ("moving", "static", "moving")])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_turned_hypothesis_is_turned_as_a_whole(dimensions, kinds, mirrored):
    c, s = bank(dimensions, kinds, seed=1)
    d = dimensions
    M, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((d, d)))
    M[0] *= np.sign(np.linalg.det(M)) * (-1.0 if mirrored else 1.0)
    x, P = s.x[1].copy(), s.P[1].copy()
    T = np.eye(len(x))
    vectors = [(s.nodes["at_p"], np.ones(3, dtype=bool)), (s.nodes["at_v"], ~s.nodes["static"])]
    for at, there in vectors:
        rows = [slice(a, a + d) for a in at[there]]
        mean = np.mean([x[row] for row in rows], axis=0)
        if not there.all():
            mean = np.zeros(d)  # velocities beside static nodes
        for row in rows:
            x[row] = mean + M @ (x[row] - mean)
            T[row, row] = M
    turn_hypothesis(c, s, 1, np.ascontiguousarray(M))
    np.testing.assert_allclose(s.x[1], x, atol=1e-12)
    np.testing.assert_allclose(s.P[1], T @ P @ T.T, atol=1e-11)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("kinds", [("moving",) * 3, ("moving", "static", "moving")])
def test_hypotheses_are_the_same_where_they_agree_about_the_centre(dimensions, kinds):
    c, s = bank(dimensions, kinds, seed=3)
    moving = ~s.nodes["static"]
    s.x[1] = s.x[0]
    for k in range(dimensions):  # all of the group elsewhere, and faster if it is free
        s.x[1, s.nodes["at_p"] + k] += 5.0
        s.x[1, s.nodes["at_v"][moving] + k] += 3.0 * moving.all()
    assert are_same(c, s, 0, 1, 0.0)
    limit = c["merge_distance"]
    at = s.nodes["at_v"][0]
    # One of n moves: it is off by (n - 1) / n of that from the mean, or by all beside static ones.
    share = 2.0 / 3.0 if moving.all() else 1.0
    s.x[1, at] += 0.95 * limit / share
    assert are_same(c, s, 0, 1, 0.0)
    s.x[1, at] += 0.1 * limit / share
    assert not are_same(c, s, 0, 1, 0.0)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("kinds", [("moving",) * 3, ("moving", "static", "moving")])
@pytest.mark.parametrize("turn", [-0.9 * SAME_TURN, 0.9 * SAME_TURN, 1.1 * SAME_TURN])
def test_a_hypothesis_that_is_another_one_turned_a_little_is_the_same(dimensions, kinds, turn):
    c, s = bank(dimensions, kinds, seed=3)
    s.x[1] = s.x[0]
    M = np.eye(dimensions)
    M[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    turn_hypothesis(c, s, 1, M)
    assert not are_same(c, s, 0, 1, 0.0)
    found = turn_between(c, s, 0, 1)
    assert are_same(c, s, 0, 1, found) == (abs(turn) < SAME_TURN)
    assert found == (pytest.approx(-turn) if abs(turn) < SAME_TURN else 0.0)
    M[1] *= -1.0  # and its mirror image is not
    turn_hypothesis(c, s, 1, M)
    assert not are_same(c, s, 0, 1, turn_between(c, s, 0, 1))


@pytest.mark.parametrize("n", [3, 8, 20, 24, 40, 72, 96, 352])
@pytest.mark.parametrize("m", [0, 1, 3, 15, 16])
def test_what_is_taken_off_is_the_product(n, m):
    rng = np.random.default_rng(n + m)
    A = rng.standard_normal((n, n))
    P, W = np.stack([A @ A.T, A @ A.T]), rng.standard_normal((2, 16, n))
    twin, before, rows = P.copy(), P[0].copy(), W.copy()
    take_off(P, 1, W, 0, m)
    take_off_plainly(twin, 1, W, 0, m)
    np.testing.assert_allclose(P[1], twin[1], atol=1e-10)
    np.testing.assert_array_equal(P[1], P[1].T)  # to the last bit
    np.testing.assert_array_equal(P[0], before)
    np.testing.assert_array_equal(W, rows)


@pytest.mark.skipif(config.DISABLE_JIT, reason="the plain loops are all there is")
@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_registers_of_any_width_give_the_same(monkeypatch, lanes):
    monkeypatch.setattr(_product_kernels, "LANES", lanes)
    anew = njit(take_off.py_func)  # kept nowhere
    rng = np.random.default_rng(lanes)
    for n in (8, 40):
        A = rng.standard_normal((n, n))
        P, W = (A @ A.T)[None], rng.standard_normal((1, 8, n))
        twin = P.copy()
        anew(P, 0, W, 0, 7)
        take_off_plainly(twin, 0, W, 0, 7)
        np.testing.assert_allclose(P, twin, atol=1e-10)
        np.testing.assert_array_equal(P[0], P[0].T)


def test_arrays_begin_with_a_cache_line():
    for shape in ((3,), (2, 5), (1, 7, 16)):
        array = aligned(*shape)
        assert array.shape == shape
        assert array.ctypes.data % 64 == 0
        assert not array.any()


@given(angles)
def test_the_direction_of_a_quaternion_is_its_yaw(yaw):
    q = quat_from_yaw(np.array(yaw))
    assert direction(*q) == pytest.approx((np.cos(yaw), np.sin(yaw)), abs=1e-12)


@given(angles, st.one_of(angles, st.floats(-0.06, 0.06)))
def test_the_angle_between_directions(a, turn):
    b = a + turn
    found = angle_between(np.cos(a), np.sin(a), np.cos(b), np.sin(b))
    assert found == pytest.approx(turn, abs=1e-11)
