"""Groups in space of which nothing tells yet how they are turned."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from test_joint_kernels import running

from tracking import Status, Tracker
from tracking.filters.joint import (
    _carrier_kernels,
    _frame_kernels,
    _motion_kernels,
    _open_kernels,
    _peak_kernels,
    _survey_kernels,
)
from tracking.filters.joint._antenna_kernels import antenna_offset, note_levers
from tracking.filters.joint._flatness_kernels import flatness
from tracking.filters.joint._range_kernels import range_model
from tracking.filters.joint._sample_kernels import sum_inertial
from tracking.filters.joint._upright_kernels import GAIN
from tracking.filters.joint.alignment import Alignment
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import JointState, make_state
from tracking.filters.records import as_records
from tracking.filters.rotations import starting_rotations
from tracking.measurements import Kind

MIRROR = np.diag([1.0, 1.0, -1.0])


def log_likelihood(information, score, R):  # noqa: N803
    d = (R - np.eye(3)).ravel()
    return score @ d - 0.5 * d @ information @ d


def anywhere(rng):
    """A rotation, or a mirror image."""
    R = Rotation.random(random_state=rng).as_matrix()
    return R @ MIRROR if rng.random() < 0.5 else R


def evidence(rng, n=12):
    """A likelihood that prefers some orthogonal matrix, by n vectors that it takes to others."""
    R, weights = anywhere(rng), rng.uniform(0.1, 30.0, n)
    vectors = rng.standard_normal((n, 3)) * [1.0, 1.0, 0.2]
    information, score = np.zeros((9, 9)), np.zeros(9)
    for v, w in zip(vectors, weights, strict=True):
        for r in range(3):
            g = np.zeros((3, 3))
            g[r] = v
            information += w * np.outer(g.ravel(), g.ravel())
            score += w * ((R - np.eye(3)) @ v)[r] * g.ravel()
    return information, score + 0.3 * rng.standard_normal(9), R


@settings(max_examples=25)
@given(seed=st.integers(0, 2**31))
def test_derivatives_of_the_likelihood_by_a_turn_are_its_differences(seed):
    rng = np.random.default_rng(seed)
    information, score, _ = evidence(rng)
    R, h = anywhere(rng), 1e-4
    g, w, H = np.zeros(9), np.zeros(3), np.zeros((3, 3))
    value = _peak_kernels.gain(information, score, R, g)
    assert value == pytest.approx(log_likelihood(information, score, R), rel=1e-9, abs=1e-9)
    _peak_kernels.curvature(information, R, g, w, H)

    def moved(v):
        return log_likelihood(information, score, Rotation.from_rotvec(v).as_matrix() @ R)

    axes = h * np.eye(3)
    scale = 1.0 + np.abs(H).max()
    for a in range(3):
        assert (moved(axes[a]) - moved(-axes[a])) / (2 * h) == pytest.approx(w[a], abs=1e-5 * scale)
        for b in range(3):
            second = moved(axes[a] + axes[b]) - moved(axes[a] - axes[b])
            second -= moved(axes[b] - axes[a]) - moved(-axes[a] - axes[b])
            assert -second / (4 * h * h) == pytest.approx(H[a, b], abs=1e-3 * scale)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**31))
def test_no_turn_is_likelier_than_the_first_peak(seed):
    rng = np.random.default_rng(seed)
    information, score, _ = evidence(rng)
    turns, values = _peak_kernels.find_peaks(information, score, starting_rotations(3, 16))
    assert np.all(np.diff(values) <= 0.0)
    for R, value in zip(turns, values, strict=True):
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
        assert log_likelihood(information, score, R) == pytest.approx(value, abs=1e-6)
    tried = max(log_likelihood(information, score, anywhere(rng)) for _ in range(3000))
    assert tried <= values[0] + 1e-6


def open_group(vehicle="human", static=()):
    c, s, scratch, layout = running(3, vehicle, static=static)
    n = s.x.shape[1]
    rng = np.random.default_rng(5)
    A = rng.standard_normal((n, n))
    s.P[0] = A @ A.T / n + 0.1 * np.eye(n)
    s.x[0, s.pairs["at_e"].min() :] = 0.0
    _open_kernels.open_frame(c, s, layout, 0)
    return c, s, scratch, layout


def drive(c, s, scratch, turn, steps=12):
    """Dead reckoning and constraints for a while, with accelerations turned; its log-likelihood."""
    total, said = 0.0, []
    rng = np.random.default_rng(7)
    for k in range(steps):
        for i in range(3):
            if not s.nodes["static"][i]:
                s.held[i, 4:] = turn @ rng.standard_normal(3)
        s.pre[:] = 0.0
        for i in range(3):
            if not s.nodes["static"][i]:
                sum_inertial(c, s.nodes, s.held, s.pre, i, 0.05 * (k + 1))
        _motion_kernels.predict(c, s, 0, 0.05, scratch)
        if s.group["alignment"][0] == Alignment.LINEAR:
            _open_kernels.carry_slope(c, s, 0, scratch)
        for i in range(3):
            if not s.nodes["static"][i]:
                for a in range(3):
                    at = s.nodes["at_v"][i] + a
                    nu = -s.x[0, at]
                    said.append(nu)
                    scratch.idx[0], scratch.val[0] = at, 1.0
                    scratch.direct[:] = 0.0
                    S = s.P[0, at, at] + 4.0  # noqa: N806
                    total -= 0.5 * nu * nu / S
                    _carrier_kernels.judge(c, s, 0, nu, 1, 4.0, scratch)
    assert max(np.abs(said)) > 0.5
    return total


@pytest.mark.parametrize("static", [(), (3,)])
def test_one_filter_gives_the_states_and_likelihoods_of_all_turns(static):
    """Its twin is the filter itself, given accelerations that were turned before.

    Exact where the model is linear: headings are held, range errors do not fade with the way, and
    what is measured is a velocity.
    """
    c, s, scratch, _ = open_group(static=static)
    c["fast_length"] = c["slow_length"] = c["excess_length"] = 1e12
    for i in range(3):
        if not s.nodes["static"][i]:
            at = s.nodes["at_h"][i]
            s.x[0, at], s.P[0, at], s.P[0, :, at] = 0.0, 0.0, 0.0
            s.P[0, at, at] = 1e-18
    s.nodes["heading_var"] = 1e-18
    s.information[0], s.score[0] = 0.0, 0.0  # without what is known of fixed nodes
    begun = JointState._make(a.copy() for a in s)
    reached = drive(c, s, scratch, np.eye(3))
    rng = np.random.default_rng(11)
    for _ in range(4):
        turn = anywhere(rng)
        other = JointState._make(a.copy() for a in begun)
        # As records, like those of the filter.
        other = other._replace(nodes=begun.nodes.copy(), group=begun.group.copy())
        other.group["alignment"] = Alignment.FILTERED
        d = (turn - np.eye(3)).ravel()
        other.x[0] += d @ begun.slope[0]  # what was found of biases is turned as well
        total = drive(c, other, scratch, turn)
        np.testing.assert_allclose(s.x[0] + d @ s.slope[0], other.x[0], atol=1e-9)
        np.testing.assert_allclose(s.P[0], other.P[0], atol=1e-9)
        told = log_likelihood(s.information[0], s.score[0], turn)
        assert told == pytest.approx(total - reached, abs=1e-6)


@pytest.mark.parametrize("from_turn", [True, False])
def test_a_survey_counts_against_a_layout_by_what_no_turn_explains(from_turn):
    """Of two fixed nodes that an unknown turn puts elsewhere, a distance says nothing yet."""
    c, s, scratch, _ = open_group(static=(2, 3))
    at = s.nodes["at_p"]
    pair = int(np.nonzero((s.pairs["i"] == 1) & (s.pairs["j"] == 2))[0][0])
    s.P[0] = 1e-4 * np.eye(s.x.shape[1])
    s.x[0, at[1] : at[1] + 3], s.x[0, at[2] : at[2] + 3] = 0.0, [2.0, 0.0, 0.0]
    s.group["n_alive"] = 2
    s.slope[0], s.spread[0] = 0.0, np.eye(9)
    s.slope[0, :, at[2]] = 1.0 if from_turn else 0.0
    before = s.loglik[0]
    _survey_kernels.fuse_survey(c, s, 0, pair, 3.0, True, scratch)
    assert s.loglik[0] == (before if from_turn else pytest.approx(before - 0.5 * c["max_nis"]))


@pytest.mark.parametrize("vehicle", ["human", "hand", "hand, told", "car"])
def test_slopes_are_carried_as_errors_of_the_states_are(vehicle):
    """With no acceleration, of which a turn would make another."""
    vehicle, *told = vehicle.split(", ")
    c, s, scratch, _ = open_group(vehicle)
    s.nodes["told"], s.nodes["by_gyroscope"] = bool(told), True
    c["fast_length"] = c["slow_length"] = c["excess_length"] = 1e12
    s.held[:, 4:] = 0.0
    for name in ("at_b", "at_o", "at_g"):
        for at in s.nodes[name][s.nodes[name] >= 0]:
            s.x[0, at : at + 3] = 0.0
    x0, h = s.x[0].copy(), 1e-6
    s.slope[0] = np.random.default_rng(3).standard_normal(s.slope[0].shape)
    for z in s.slope[0].copy():
        reached = []
        for step in (h, -h, 0.0):  # the last is the step that slopes are carried over
            s.x[0], s.pre[:] = x0 + step * z, 0.0
            for i in range(3):
                s.nodes["t_pre"][i] = 0.0
                sum_inertial(c, s.nodes, s.held, s.pre, i, 0.05)
            _motion_kernels.predict(c, s, 0, 0.05, scratch)
            reached.append(s.x[0].copy())
        expected = (reached[0] - reached[1]) / (2.0 * h)
        s.x[0], before = x0, s.slope[0].copy()
        s.slope[0, 0] = z
        _open_kernels.carry_slope(c, s, 0, scratch)
        np.testing.assert_allclose(s.slope[0, 0], expected, atol=1e-6)
        s.slope[0] = before


def test_what_an_orientation_is_turned_upright_by_turns_with_the_frame():
    """Its bias is one of the world: with the turn M it is ``M u`` in the frame."""
    c, s, scratch, _ = open_group("hand")
    s.held[:, 4:], s.nodes["told"] = 0.0, True
    x0, reached = s.x[0].copy(), []
    gain = np.random.default_rng(4).standard_normal((3, 2))
    for given_ in (0.0 * gain, gain):
        s.x[0], s.slope[0], s.pre[:] = x0, 0.0, 0.0
        for i in range(3):
            s.nodes["t_pre"][i] = 0.0
            sum_inertial(c, s.nodes, s.held, s.pre, i, 0.05)
        s.pre[:, GAIN : GAIN + 2] = given_
        _motion_kernels.predict(c, s, 0, 0.05, scratch)
        _open_kernels.carry_slope(c, s, 0, scratch)
        reached.append((s.x[0].copy(), s.slope[0].copy()))
    (x, slope), (x_told, slope_told) = reached
    for i, at in enumerate(s.nodes["at_b"]):
        cos, sin = np.cos(x0[s.nodes["at_h"][i]]), np.sin(x0[s.nodes["at_h"][i]])
        u = np.array([*(np.array([[cos, -sin], [sin, cos]]) @ gain[i]), 0.0])
        keep = scratch.scale[at : at + 3]
        np.testing.assert_allclose((x_told - x)[at : at + 3], keep * u, atol=1e-9)
        by_turn = (slope_told - slope)[:, at : at + 3].reshape(3, 3, 3)
        np.testing.assert_allclose(by_turn, np.einsum("ra,q,r->rqa", np.eye(3), u, keep), atol=1e-9)


def test_what_stands_still_tells_nothing_of_a_turn():
    """Antennas away from their nodes are where they were, and what is read at rest is a bias."""
    c, s, scratch, layout = running(3, "hand", static=(3,))
    antenna_b = np.array([[0.1, -0.2, 0.05], [0.0, 0.0, 0.0], [-0.1, 0.0, 0.3]])
    layout = layout._replace(antenna_b=antenna_b)
    s.nodes["antenna"] = [0, 1, 2]
    moving = ~s.nodes["static"]
    for i in np.nonzero(moving)[0]:
        s.x[0, s.nodes["at_o"][i] + np.arange(3)] = 0.0
        s.x[0, [s.nodes["at_h"][i], *(s.nodes["at_v"][i] + np.arange(3))]] = 0.0
        s.x[0, s.nodes["at_b"][i] + np.arange(3)] *= 0.01
        s.held[i, 4:] = s.x[0, s.nodes["at_b"][i] + np.arange(3)]
    _open_kernels.open_frame(c, s, layout, 0)
    for p in range(len(s.pairs)):
        i, j = s.pairs["i"][p], s.pairs["j"][p]
        levers = [antenna_offset(s.held, layout, k, k) for k in (i, j)]
        _, m = range_model(c, s, 0, p, *levers, scratch.idx, scratch.val)
        note_levers(np.concatenate(levers), scratch)
        _open_kernels.turn_gradient(s, 0, m, scratch)
        np.testing.assert_allclose(scratch.gradient, 0.0, atol=1e-12)
    s.pre[:] = 0.0
    for i in np.nonzero(moving)[0]:
        sum_inertial(c, s.nodes, s.held, s.pre, i, 0.3)
    _motion_kernels.predict(c, s, 0, 0.3, scratch)
    _open_kernels.carry_slope(c, s, 0, scratch)
    at_v = s.nodes["at_v"][moving][:, None] + np.arange(3)
    # But for the tilt that the bias is thought to come from, which is of second order.
    assert np.abs(s.slope[0][:, at_v]).max() < 0.01 * 0.3 * np.abs(s.held[moving, 4:]).max()


@pytest.mark.parametrize("vehicle", ["human", "hand"])
def test_turning_the_frame_back_changes_nothing(vehicle):
    c, s, scratch, _ = open_group(vehicle)
    drive(c, s, scratch, np.eye(3))
    names = ("x", "P", "slope", "score", "information", "loglik")
    before = {name: getattr(s, name).copy() for name in names}
    R = anywhere(np.random.default_rng(2))
    _frame_kernels.turn_frame(c, s, 0, R)
    assert np.abs(s.x - before["x"]).max() > 0.1
    _frame_kernels.turn_frame(c, s, 0, np.ascontiguousarray(R.T))
    for name in names:
        np.testing.assert_allclose(getattr(s, name), before[name], atol=1e-8, err_msg=name)


def test_fixed_nodes_of_a_room_are_rather_flat_than_tall():
    """And that is forgotten with the turn, not with the layout."""
    c, s, _, layout = running(3, "human", static=(1, 2, 3))
    at = s.nodes["at_p"]
    for k, place in enumerate(([0.0, 0.0, 0.0], [0.3, 0.0, 4.0], [0.3, 0.2, 9.0])):
        s.x[0, at[k] : at[k] + 3] = place
    _open_kernels.open_frame(c, s, layout, 0)
    turns, _ = _peak_kernels.find_peaks(s.information[0], s.score[0], layout.rotations)
    _frame_kernels.turn_frame(c, s, 0, turns[0])
    heights = s.x[0, at + 2]
    assert np.ptp(heights) < 0.3


def test_an_unknown_turn_makes_no_layout_flat(make_group):
    group = make_group(n=5, dimensions=3)
    c = as_records(make_coefficients(group.constellation, JointParams()))[0]
    batch = make_state(group.constellation, JointParams(), 1, 1)
    s = JointState._make(as_records(a[0]) if a.dtype.names else a[0] for a in batch)
    s.nodes["present"] = True
    at = s.nodes["at_p"]
    pos = group.pos(1.0).reshape(-1, 3)
    pos -= pos.mean(axis=0)
    for k, place in enumerate(pos):
        s.x[0, at[k] : at[k] + 3] = place
    s.P[0] = 1e-4 * np.eye(s.x.shape[1])
    well_known = flatness(c, s, 0, True)
    # Nearly what is linear along the layout of errors that are all alike goes with the turn.
    assert flatness(c, s, 0, False) > well_known > 10.0
    for a in range(3):
        turn = np.zeros(s.x.shape[1])
        for k, place in enumerate(pos):
            turn[at[k] : at[k] + 3] = np.cross(np.eye(3)[a], place)
        s.P[0] += 0.3**2 * np.outer(turn, turn)
    assert flatness(c, s, 0, True) < 0.2 * well_known
    assert flatness(c, s, 0, False) > well_known


def turned(group, R):  # noqa: N803
    """The measurements of a group whose accelerations were measured in a turned world."""
    block = group.block
    values = block.values.copy()
    state = block.kind == Kind.STATE
    values[state, 4:7] = values[state, 4:7] @ R.T
    return type(block)(
        **{f: values if f == "values" else getattr(block, f) for f in block.__slots__}
    )


@pytest.mark.parametrize("seed", range(6))
def test_a_group_in_space_finds_how_it_is_turned(make_group, seed):
    """Whatever the first layout has to do with the world; a wrong mirror image is never ok."""
    group = make_group(n=5, dimensions=3, seconds=25.0, hz=50.0)
    R = Rotation.random(random_state=seed).as_matrix()
    t = np.arange(0.5, 24.9, 0.1)
    estimate = Tracker(group.constellation).run(turned(group, R), t).take(0)
    error = np.linalg.norm(estimate.pos_ij_w - group.pairs(t) @ R.T, axis=-1)
    ok = estimate.status == Status.OK
    assert not (ok & (error > 0.5)).any()
    assert ok[-1].all()
    assert error[-1].max() < 0.1
    assert t[ok.all(axis=1)][0] < 15.0


def test_smoothing_over_the_first_move_of_a_group_takes_the_turn_as_it_is(make_group):
    """The states of a moment, put into the vector twice, have no slopes."""
    group = make_group(n=5, dimensions=3, seconds=6.0)
    block = group.block
    values = block.values.copy()
    still = (block.kind == Kind.STATE) & (block.t < 3.0)
    values[still, 4:7] = 0.0
    block = type(block)(
        **{f: values if f == "values" else getattr(block, f) for f in block.__slots__}
    )
    tracker = Tracker(group.constellation)
    cut, end = np.searchsorted(block.t[0], [2.95, 3.25])
    tracker.step(block.take(slice(0, int(cut))), 2.95)
    before = tracker.save()["filter"]
    later = block.take(slice(int(cut), int(end)))
    smoothed = tracker.smooth(later, 2.95)
    assert np.isfinite(smoothed.pos_ij_w).all()
    for name, old, new in zip(JointState._fields, before, tracker.save()["filter"], strict=True):
        np.testing.assert_array_equal(old, new, err_msg=name)


@pytest.mark.parametrize("n", [2, 3])
def test_groups_of_three_are_followed_one_turn_each(make_group, n):
    group = make_group(n=n, dimensions=3, seconds=4.0)
    tracker = Tracker(group.constellation)
    tracker.step(group.block, group.t[-1])
    state = tracker.save()["filter"]
    assert (state.group["alignment"] == Alignment.FILTERED).all()
    assert state.alive.sum() > 1
