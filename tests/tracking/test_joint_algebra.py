"""Kernels of the joint filter against reference implementations in numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.spatial.transform import Rotation

from tracking import Constellation, NodeConfig
from tracking.arrays import aligned
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.joint.hypotheses.copying import rotate_hypothesis
from tracking.filters.joint.hypotheses.merging import are_same, rotation_between
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import JointState, make_state
from tracking.filters.joint.supervision.params import AlignmentParams
from tracking.filters.level_vehicle import angle_between, direction
from tracking.geometry import quat_from_yaw
from tracking.maths import covariance_loops as loops
from tracking.maths import vectors
from tracking.maths.covariance import (
    ROOM,
    STATES,
    USES_SIMD,
    add_to_columns,
    add_to_rows,
    apply_downdate,
    mirror,
    subtract_square,
    sum_rows,
)
from tracking.maths.covariance_simd import SHAPES
from tracking.records import as_records

angles = st.floats(-3.1, 3.1)
SAME_TURN = AlignmentParams().same_rotation


def bank(dimensions, kinds=("moving", "moving", "moving"), n_hyps=2, seed=0):
    """Return one environment with hypotheses of random states and covariances."""
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
    vectors = [(s.nodes["i_pos"], np.ones(3, dtype=bool)), (s.nodes["i_vel"], ~s.nodes["static"])]
    for at, there in vectors:
        rows = [slice(a, a + d) for a in at[there]]
        mean = np.mean([x[row] for row in rows], axis=0)
        if not there.all():
            mean = np.zeros(d)  # velocities next to static nodes
        for row in rows:
            x[row] = mean + M @ (x[row] - mean)
            T[row, row] = M
    rotate_hypothesis(c, s, 1, np.ascontiguousarray(M))
    np.testing.assert_allclose(s.x[1], x, atol=1e-12)
    np.testing.assert_allclose(s.P[1], T @ P @ T.T, atol=1e-11)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("kinds", [("moving",) * 3, ("moving", "static", "moving")])
def test_hypotheses_are_the_same_where_they_agree_about_the_centre(dimensions, kinds):
    c, s = bank(dimensions, kinds, seed=3)
    moving, none = ~s.nodes["static"], np.eye(dimensions)
    s.x[1] = s.x[0]
    for k in range(dimensions):  # move the whole group, and speed it up if it is free
        s.x[1, s.nodes["i_pos"] + k] += 5.0
        s.x[1, s.nodes["i_vel"][moving] + k] += 3.0 * moving.all()
    assert are_same(c, s, 0, 1, none)
    limit = c["merge_distance"]
    at = s.nodes["i_vel"][0]
    # One of n is faster: off the mean by (n - 1) / n of it, or by all of it next to static nodes.
    share = 2.0 / 3.0 if moving.all() else 1.0
    s.x[1, at] += 0.95 * limit / share
    assert are_same(c, s, 0, 1, none)
    s.x[1, at] += 0.1 * limit / share
    assert not are_same(c, s, 0, 1, none)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("kinds", [("moving",) * 3, ("moving", "static", "moving")])
@pytest.mark.parametrize("turn", [-0.9 * SAME_TURN, 0.9 * SAME_TURN, 1.1 * SAME_TURN])
def test_a_hypothesis_that_is_another_one_turned_a_little_is_the_same(dimensions, kinds, turn):
    c, s = bank(dimensions, kinds, seed=3)
    s.x[1] = s.x[0]
    M = np.eye(dimensions)
    M[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    rotate_hypothesis(c, s, 1, M)
    none, found = np.eye(dimensions), np.eye(dimensions)
    assert not are_same(c, s, 0, 1, none)
    rotation_between(c, s, 0, 1, found)
    assert are_same(c, s, 0, 1, found) == (abs(turn) < SAME_TURN)
    np.testing.assert_allclose(found, M.T if abs(turn) < SAME_TURN else none, atol=1e-12)
    M[1] *= -1.0  # but its reflection is not
    rotate_hypothesis(c, s, 1, M)
    found[:] = none
    rotation_between(c, s, 0, 1, found)
    assert not are_same(c, s, 0, 1, found)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**31))
def test_while_every_turn_is_open_layouts_are_the_same_whose_shapes_are(seed):
    rng = np.random.default_rng(seed)
    c, s = bank(3, ("moving", "static", "moving", "moving", "static"), seed=3)
    s.x[1] = s.x[0]
    M = Rotation.random(random_state=rng).as_matrix() * rng.choice([-1.0, 1.0])
    rotate_hypothesis(c, s, 1, M)
    found = np.eye(3)
    rotation_between(c, s, 0, 1, found)
    assert are_same(c, s, 0, 1, found) == (np.trace(M) > 1.0 + 2.0 * np.cos(SAME_TURN))
    s.group["alignment"] = Alignment.LINEAR
    rotation_between(c, s, 0, 1, found)
    assert are_same(c, s, 0, 1, found)
    np.testing.assert_allclose(found, M.T, atol=1e-9)
    s.x[1, s.nodes["i_pos"][2]] += 2.0
    rotation_between(c, s, 0, 1, found)
    assert not are_same(c, s, 0, 1, found)


@pytest.mark.parametrize("n", [3, 8, 20, 24, 40, 72, 96, 352])
@pytest.mark.parametrize("m", [0, 1, 3, 15, 16])
@pytest.mark.parametrize("fades", [False, True])
def test_what_is_taken_off_is_the_product(n, m, fades):
    rng = np.random.default_rng(n + m)
    scale = rng.uniform(0.1, 1.0, n) if fades else None
    A = rng.standard_normal((n, n))
    P, W = np.stack([A @ A.T, A @ A.T]), rng.standard_normal((2, 16, n))
    twin, before, rows = P.copy(), P[0].copy(), W.copy()
    apply_downdate(P, 1, W, 0, m, scale)
    loops.apply_downdate(twin, 1, W, 0, m, scale)
    np.testing.assert_allclose(P[1], twin[1], atol=1e-10)
    np.testing.assert_array_equal(P[1], P[1].T)  # exactly
    np.testing.assert_array_equal(P[0], before)
    np.testing.assert_array_equal(W, rows)


@pytest.mark.parametrize("n", [3, 8, 20, 40, 48])
def test_a_square_is_subtracted_exactly_as_in_loops(n):
    rng = np.random.default_rng(n)
    P, w = rng.standard_normal((2, n, n)), rng.standard_normal(n)
    before, twin = P.copy(), P.copy()
    subtract_square(P, 1, w)
    loops.subtract_square(twin, 1, w)
    np.testing.assert_array_equal(P, twin)
    np.testing.assert_allclose(P[1], before[1] - np.outer(w, w), atol=1e-14)


def rows_to_sum(n, m, q, seed):
    """Return arguments of `sum_rows`: random matrices, rows and weights, and an output."""
    rng = np.random.default_rng(seed)
    idx = rng.integers(0, n, size=16)
    val, share = rng.standard_normal(16), rng.standard_normal(16)
    P, W = rng.standard_normal((2, n, n)), rng.standard_normal((2, 16, n))
    return P, 1, idx, val, m, W, share, q, np.full(n, np.nan)


@pytest.mark.parametrize("n", [3, 8, 16, 20, 40, 48, 49, 72, 96, 352])
@pytest.mark.parametrize(("m", "q"), [(1, 0), (4, 3), (8, 16), (16, 1)])
def test_rows_are_summed(n, m, q):
    arguments, twin = rows_to_sum(n, m, q, n), np.zeros(n)
    before = [np.copy(a) for a in arguments]
    sum_rows(*arguments)
    loops.sum_rows(*arguments[:-1], twin)
    np.testing.assert_allclose(arguments[-1], twin, atol=1e-12 * m * (1 + q))
    for a, b in zip(arguments[:-1], before[:-1], strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(("n", "rows"), [(3, 2), (8, 8), (20, 9), (40, 24), (96, 36), (352, 200)])
def test_one_half_is_the_mirror_image_of_the_other(n, rows):
    P = np.random.default_rng(n).standard_normal((2, n, n))
    twin = P.copy()
    mirror(P, 1, rows)
    for r in range(rows):
        twin[1, r:, r] = twin[1, r, r:]
    np.testing.assert_array_equal(P, twin)


def step_to_add(p, shape, n, seed):
    """Return arguments of `add_to_rows`: a random covariance, and a step of the second node."""
    rng = np.random.default_rng(seed)
    d, m = shape
    A = rng.standard_normal((2, n, n))
    F = np.zeros((2, STATES + 1, ROOM))
    F[1, :m, : 2 * d] = rng.standard_normal((m, 2 * d))
    F[1, STATES, :d] = 0.1
    if d == 3:  # a vertical bias adds to the height only; without offset nothing else does
        F[1, 2, [0, 1, 3, 4]] = 0.0
        if m < STATES:
            F[1][np.ix_([0, 1, 3], [2, 5])] = 0.0
    return A @ np.swapaxes(A, 1, 2), 1, p, n - m, m, F, 1


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("n", "p"), [(19, 4), (24, 0), (40, 12), (96, 30)])
def test_a_step_is_a_product_with_its_derivatives(n, p, shape):
    arguments = step_to_add(p, shape, n, seed=n)
    P, h, _, b, m, F, i = arguments
    d, before = shape[0], P.copy()
    T = np.eye(n)
    T[p : p + d, p + d : p + 2 * d] = 0.1 * np.eye(d)
    T[p : p + 2 * d, b : b + m] = F[i, :m, : 2 * d].T
    whole = T @ before[h] @ T.T
    add_to_rows(*arguments)
    np.testing.assert_allclose(P[h], T @ before[h], atol=1e-12 * n)
    add_to_columns(*arguments)
    end = p + 2 * d
    np.testing.assert_allclose(P[h, :end], whole[:end], atol=1e-12 * n)
    np.testing.assert_array_equal(P[0], before[0])


@pytest.mark.skipif(not USES_SIMD, reason="plain loops only")
@pytest.mark.parametrize("add", [add_to_rows, add_to_columns])
@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_a_step_in_registers_of_any_width_is_the_same(monkeypatch, lanes, add):
    monkeypatch.setattr(vectors, "LANES", lanes)
    fresh = njit(add.py_func)  # not cached
    plainly = loops.add_to_rows if add is add_to_rows else loops.add_to_columns
    for shape in SHAPES:
        ours, twin = step_to_add(6, shape, 40, 1), step_to_add(6, shape, 40, 1)
        fresh(*ours)
        plainly(*twin)
        np.testing.assert_allclose(ours[0], twin[0], atol=1e-12)


@pytest.mark.skipif(not USES_SIMD, reason="plain loops only")
@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_registers_of_any_width_give_the_same(monkeypatch, lanes):
    monkeypatch.setattr(vectors, "LANES", lanes)
    fresh = njit(apply_downdate.py_func)  # not cached
    rng = np.random.default_rng(lanes)
    for n in (8, 40):
        A = rng.standard_normal((n, n))
        P, W = (A @ A.T)[None], rng.standard_normal((1, 8, n))
        twin = P.copy()
        fresh(P, 0, W, 0, 7, None)
        loops.apply_downdate(twin, 0, W, 0, 7, None)
        np.testing.assert_allclose(P, twin, atol=1e-10)
        np.testing.assert_array_equal(P[0], P[0].T)
    fresh = njit(mirror.py_func)
    for rows in (16, 27):
        P = rng.standard_normal((1, 40, 40))
        twin = P.copy()
        fresh(P, 0, rows)
        loops.mirror(twin, 0, rows)
        np.testing.assert_array_equal(P, twin)
    w = rng.standard_normal(40)
    njit(subtract_square.py_func)(P, 0, w)
    loops.subtract_square(twin, 0, w)
    np.testing.assert_array_equal(P, twin)
    fresh = njit(sum_rows.py_func)
    for n in (24, 56):
        arguments, summed = rows_to_sum(n, 8, 5, n), np.zeros(n)
        fresh(*arguments)
        loops.sum_rows(*arguments[:-1], summed)
        np.testing.assert_allclose(arguments[-1], summed, atol=1e-12)


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
