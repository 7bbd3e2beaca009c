"""Rotation of a group in the plane: only motion measures it, not ranges or joins."""

import numpy as np
import pytest

from tracking import Constellation, NodeConfig
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.ekf.gauge import (
    add_rotation_uncertainty,
)
from tracking.filters.joint.ekf.observability import enforce_observability
from tracking.filters.joint.ekf.scalar_update import flush_updates
from tracking.filters.joint.ekf.workspace import make_workspace
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.joint.hypotheses.initialisation import add_node
from tracking.filters.joint.hypotheses.static_initialisation import reset_heading_uncertainty
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.smoothing import with_clones
from tracking.filters.joint.state import JointState, make_layout, make_state
from tracking.filters.joint.supervision.supervise import update_heading_variance
from tracking.filters.joint.updates.surveyed_distance import surveyed_distance_update
from tracking.records import as_records

N = 4


def four(static=(), seed=0, *, dimensions=2):
    """Return one environment of four nodes; only positions are known well."""
    nodes = tuple(
        NodeConfig(id=k, vehicle="car", kind="static" if k in static else "moving")
        for k in range(N)
    )
    constellation, params = Constellation(nodes=nodes, dimensions=dimensions), JointParams()
    c = as_records(make_coefficients(constellation, params))[0]
    batch = make_state(constellation, params, 1, 1)
    s = JointState._make(as_records(a[0]) if a.dtype.names else a[0] for a in batch)
    s.nodes["present"], s.alive[0] = True, True
    s.group["n_alive"], s.group["alignment"] = 1, Alignment.FILTERED
    s.x[0] = np.random.default_rng(seed).uniform(-4.0, 4.0, s.x.shape[1])
    s.P[0] = 1e-4 * np.eye(len(s.x[0]))
    return c, s, make_layout(constellation, params)


def room_for(s):
    """Return the workspace of such a group."""
    return make_workspace(N, len(s.pairs), len(s.x[0]))


def turned(s, but=(), *, velocities=True):
    """Return the derivative of the states by a rotation of the group."""
    D, moving = np.zeros(len(s.x[0])), ~s.nodes["static"]  # noqa: N806
    everybody = np.ones(N, dtype=bool)
    for name, of, free in (("i_pos", everybody, True), ("i_vel", moving, moving.all())):
        if name == "i_vel" and not velocities:
            continue
        at = s.nodes[name][of & ~np.isin(np.arange(N), but)]
        value = s.x[0][at[:, None] + np.arange(2)]
        value = value - value.mean(axis=0) * free
        D[at], D[at + 1] = -value[:, 1], value[:, 0]
    return D


@pytest.mark.parametrize("static", [(), (2,)])
def test_no_range_sees_what_is_spread(static):
    c, s, _ = four(static)
    before = s.P[0].copy()
    add_rotation_uncertainty(c, s, 0, c["rotation_var"])
    D = turned(s)  # noqa: N806
    np.testing.assert_allclose(s.P[0] - before, c["rotation_var"] * np.outer(D, D), atol=1e-12)
    at = s.nodes["i_pos"]
    for i in range(N):
        for j in range(i + 1, N):
            H = np.zeros(len(D))  # noqa: N806
            H[at[j] : at[j] + 2] = s.x[0, at[j] : at[j] + 2] - s.x[0, at[i] : at[i] + 2]
            H[at[i] : at[i] + 2] = -H[at[j] : at[j] + 2]
            assert abs(H @ D) < 1e-12
    update_heading_variance(c, s)
    A = turned(s, velocities=False)  # noqa: N806
    expected = c["rotation_var"] + 1e-4 / (A @ A)
    assert s.group["heading_gauge_var"][0] == pytest.approx(expected)


def test_in_space_it_is_spread_about_every_axis():
    c, s, _ = four(dimensions=3)
    before = s.P[0].copy()
    add_rotation_uncertainty(c, s, 0, 0.1)
    at = s.nodes["i_pos"][:, None] + np.arange(3)
    X = s.x[0][at] - s.x[0][at].mean(axis=0)  # noqa: N806
    D = np.cross(np.eye(3)[:, None], X[None]).reshape(3, -1)  # noqa: N806
    spread = (s.P[0] - before)[np.ix_(at.ravel(), at.ravel())]
    np.testing.assert_allclose(spread, 0.1 * D.T @ D, atol=1e-12)


def test_a_group_that_knows_as_little_anyway_does_not_wake_with_less():
    c, s, _ = four()
    for _ in range(2):
        reset_heading_uncertainty(c, s, 0, room_for(s))
        update_heading_variance(c, s)
        assert s.group["heading_gauge_var"][0] == pytest.approx(c["rotation_var"], rel=1e-9)


def test_the_moment_that_is_smoothed_wakes_with_the_group():
    """Its rotation is that of the other states, so later information applies to it as well."""
    c, s, _ = four()
    batch = JointState._make(array[None] for array in s)
    clones, wider = with_clones(batch, np.array([c]))
    twice, c = JointState._make(array[0] for array in clones), wider[0]
    own, more = int(c["n_own"]), int(c["n_motion"])
    x = twice.x[0]
    source = [x[:own].tolist().index(value) for value in x[own : own + more]]
    before = twice.P[0].copy()
    add_rotation_uncertainty(c, twice, 0, 0.1)
    D = np.zeros(c["n"])  # noqa: N806
    D[:own] = turned(s)
    D[own : own + more] = D[source]
    np.testing.assert_allclose(twice.P[0] - before, 0.1 * np.outer(D, D), atol=1e-12)


def test_two_nodes_have_no_shape_that_could_turn_with_their_moves():
    """Their corrections would otherwise add up, and count when a third node joins."""
    c, s, _ = four()
    s.nodes["present"][2:] = False
    s.accumulated_correction[0] = 1.0
    before = s.P[0].copy()
    enforce_observability(c, s, 0, room_for(s))
    assert not s.accumulated_correction.any()
    assert np.array_equal(s.P[0], before)


def test_surveys_do_not_tell_how_a_group_is_turned():
    """Distances move the nodes back and forth, as the first ones after a start do."""
    c, s, _ = four()
    s.x[0, 4 * N :] = 0.0  # no range errs
    add_rotation_uncertainty(c, s, 0, c["rotation_var"])
    for node in range(N):
        at = s.nodes["i_pos"][node]
        s.P[0][at, at], s.P[0][at + 1, at + 1] = (
            s.P[0][at, at] + 0.06,
            s.P[0][at + 1, at + 1] + 0.06,
        )
    update_heading_variance(c, s)
    before = s.group["heading_gauge_var"][0]
    work = room_for(s)
    rng = np.random.default_rng(0)
    for p in np.tile(np.arange(len(s.pairs)), 10):
        i, j = (s.nodes["i_pos"][s.pairs[name][p]] for name in "ij")
        way = np.linalg.norm(s.x[0, j : j + 2] - s.x[0, i : i + 2])
        surveyed_distance_update(c, s, 0, p, way + rng.normal(0.0, 0.1), True, work)
    flush_updates(s, 0)
    update_heading_variance(c, s)
    assert s.group["heading_gauge_var"][0] > 0.5 * before


def test_who_joins_turns_with_the_others():
    """The rotation of the others is no more certain after the join, that of all as uncertain."""
    c, s, layout = four()
    new, pos = 3, np.array([5.0, -3.0, 0.0])
    s.nodes["present"][new] = False
    add_rotation_uncertainty(c, s, 0, c["rotation_var"])
    update_heading_variance(c, s)
    before = s.group["heading_gauge_var"][0]
    add_node(c, s, layout, 0, new, pos, c["position_var"], 0.0)
    s.nodes["present"][new] = True
    update_heading_variance(c, s)
    assert s.group["heading_gauge_var"][0] == pytest.approx(before, rel=0.05)
    # An exact range to the new node corrects its own error, but not the rotation.
    at = s.nodes["i_pos"]
    for other in range(3):
        H = np.zeros(len(s.x[0]))  # noqa: N806
        way = s.x[0, at[new] : at[new] + 2] - s.x[0, at[other] : at[other] + 2]
        H[at[new] : at[new] + 2] = way / np.linalg.norm(way)
        H[at[other] : at[other] + 2] = -H[at[new] : at[new] + 2]
        w = s.P[0] @ H
        s.P[0] -= np.outer(w, w) / (H @ w + 1e-6)
    update_heading_variance(c, s)
    assert s.group["heading_gauge_var"][0] == pytest.approx(before, rel=0.1)
    assert np.linalg.eigvalsh(s.P[0]).min() > 0.0


def test_a_join_is_as_uncertain_as_centre_and_turn_of_the_others_and_its_own_place():
    c, s, layout = four(seed=2)
    new, pos = 3, np.array([1.0, 2.0, 0.0])
    s.nodes["present"][new] = False
    A = np.random.default_rng(1).standard_normal(s.P[0].shape)  # noqa: N806
    s.P[0] = A @ A.T
    at, P = s.nodes["i_pos"], s.P[0].copy()  # noqa: N806
    N_others = turned(s, but=[new], velocities=False)  # noqa: N806
    read = N_others / (N_others @ N_others)
    others = np.array([s.x[0, a : a + 2] for a in at[:3]])
    arm = pos[:2] - others.mean(axis=0)
    J = np.outer([-arm[1], arm[0]], read)  # noqa: N806
    for k in range(2):
        J[k, at[:3] + k] += 1.0 / 3.0
    add_node(c, s, layout, 0, new, pos, c["position_var"], 0.0)
    mine = at[new] + np.arange(2)
    own = J @ P @ J.T + c["position_var"] * np.eye(2)
    np.testing.assert_allclose(s.P[0][np.ix_(mine, mine)], own, rtol=1e-6)
    theirs = np.concatenate([at[:3], at[:3] + 1])
    np.testing.assert_allclose(s.P[0][np.ix_(mine, theirs)], (J @ P)[:, theirs], rtol=1e-6)
