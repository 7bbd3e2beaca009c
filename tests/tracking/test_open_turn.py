"""Groups in space with unknown rotation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from test_joint_kernels import running

from tests.exact_motion import ExactGroup
from tracking import Status, Tracker
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.ekf import propagation
from tracking.filters.joint.ekf.columns import TILT_GAIN
from tracking.filters.joint.ekf.preintegration import preintegrate
from tracking.filters.joint.hypotheses import alignment_modes, alignment_sensitivity
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.joint.hypotheses.alignment_sensitivity import lever_arm_sensitivity
from tracking.filters.joint.hypotheses.geometric_degeneracy import degeneracy_ratio, least_axis
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import JointState, make_state
from tracking.filters.joint.updates import motion_constraints, surveyed_distance
from tracking.filters.joint.updates.range_update import predict_range
from tracking.maths import rotation_modes
from tracking.maths.starting_rotations import starting_rotations
from tracking.measurements import Kind
from tracking.models.lever_arm import antenna_offset
from tracking.records import as_records

MIRROR = np.diag([1.0, 1.0, -1.0])


def log_likelihood(information, score, R):  # noqa: N803
    d = (R - np.eye(3)).ravel()
    return score @ d - 0.5 * d @ information @ d


def anywhere(rng):
    """Return a rotation or a reflection."""
    R = Rotation.random(random_state=rng).as_matrix()
    return R @ MIRROR if rng.random() < 0.5 else R


def evidence(rng, n=12):
    """Return a likelihood with its maximum near an orthogonal matrix, from n vector pairs."""
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
    value = rotation_modes.gain(information, score, R, g)
    assert value == pytest.approx(log_likelihood(information, score, R), rel=1e-9, abs=1e-9)
    rotation_modes.curvature(information, R, g, w, H)

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
    turns, values = rotation_modes.find_modes(information, score, starting_rotations(3, 16), 0.3)
    assert np.all(np.diff(values) <= 0.0)
    for R, value in zip(turns, values, strict=True):
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
        assert log_likelihood(information, score, R) == pytest.approx(value, abs=1e-6)
    tried = max(log_likelihood(information, score, anywhere(rng)) for _ in range(3000))
    assert tried <= values[0] + 1e-6


def open_group(vehicle="human", static=()):
    c, s, work, layout = running(3, vehicle, static=static)
    n = s.x.shape[1]
    rng = np.random.default_rng(5)
    A = rng.standard_normal((n, n))
    s.P[0] = A @ A.T / n + 0.1 * np.eye(n)
    s.x[0, s.pairs["i_range_error"].min() :] = 0.0
    s.group["alignment"] = Alignment.LINEAR
    alignment_sensitivity.start_alignment(c, s, layout, 0)
    return c, s, work, layout


def drive(c, s, work, turn, steps=12):
    """Apply dead reckoning and constraints with rotated accelerations; return log-likelihood."""
    total, said = 0.0, []
    rng = np.random.default_rng(7)
    for k in range(steps):
        for i in range(3):
            if not s.nodes["static"][i]:
                s.last_attitude_accel[i, 4:] = turn @ rng.standard_normal(3)
        s.preintegrated[:] = 0.0
        for i in range(3):
            if not s.nodes["static"][i]:
                preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, i, 0.05 * (k + 1))
        propagation.predict(c, s, 0, 0.05, work)
        if s.group["alignment"][0] == Alignment.LINEAR:
            alignment_sensitivity.propagate_sensitivity(c, s, 0, work)
        for i in range(3):
            if not s.nodes["static"][i]:
                for a in range(3):
                    at = s.nodes["i_vel"][i] + a
                    nu = -s.x[0, at]
                    said.append(nu)
                    work.idx[0], work.val[0] = at, 1.0
                    work.direct[:] = 0.0
                    S = s.P[0, at, at] + 4.0  # noqa: N806
                    total -= 0.5 * nu * nu / S
                    motion_constraints.apply_constraint(c, s, 0, nu, 1, 4.0, work)
    assert max(np.abs(said)) > 0.5
    return total


@pytest.mark.parametrize("static", [(), (3,)])
def test_one_filter_gives_the_states_and_likelihoods_of_all_turns(static):
    """The reference is the filter itself with accelerations rotated beforehand.

    The result is exact where the model is linear: headings are known, range errors do not decay
    with distance, and velocities are measured.
    """
    c, s, work, _ = open_group(static=static)
    c["fast_length"] = c["slow_length"] = c["nlos_bias_length"] = 1e12
    for i in range(3):
        if not s.nodes["static"][i]:
            at = s.nodes["i_heading"][i]
            s.x[0, at], s.P[0, at], s.P[0, :, at] = 0.0, 0.0, 0.0
            s.P[0, at, at] = 1e-18
    s.nodes["heading_var"] = 1e-18
    s.alignment_information[0], s.alignment_score[0] = (
        0.0,
        0.0,
    )  # without the prior of fixed nodes
    begun = JointState._make(a.copy() for a in s)
    reached = drive(c, s, work, np.eye(3))
    rng = np.random.default_rng(11)
    for _ in range(4):
        turn = anywhere(rng)
        other = JointState._make(a.copy() for a in begun)
        # Records, like those of the filter.
        other = other._replace(nodes=begun.nodes.copy(), group=begun.group.copy())
        other.group["alignment"] = Alignment.FILTERED
        d = (turn - np.eye(3)).ravel()
        other.x[0] += d @ begun.sensitivity[0]  # bias estimates are rotated as well
        total = drive(c, other, work, turn)
        np.testing.assert_allclose(s.x[0] + d @ s.sensitivity[0], other.x[0], atol=1e-9)
        np.testing.assert_allclose(s.P[0], other.P[0], atol=1e-9)
        told = log_likelihood(s.alignment_information[0], s.alignment_score[0], turn)
        assert told == pytest.approx(total - reached, abs=1e-6)


@pytest.mark.parametrize("from_turn", [True, False])
def test_a_survey_counts_against_a_layout_by_what_no_turn_explains(from_turn):
    """A distance to a fixed node whose position depends on the rotation has no evidence yet."""
    c, s, work, _ = open_group(static=(2, 3))
    at = s.nodes["i_pos"]
    pair = int(np.nonzero((s.pairs["i"] == 1) & (s.pairs["j"] == 2))[0][0])
    s.P[0] = 1e-4 * np.eye(s.x.shape[1])
    s.x[0, at[1] : at[1] + 3], s.x[0, at[2] : at[2] + 3] = 0.0, [2.0, 0.0, 0.0]
    s.group["n_alive"] = 2
    s.sensitivity[0], s.alignment_cov[0] = 0.0, np.eye(9)
    s.sensitivity[0, :, at[2]] = 1.0 if from_turn else 0.0
    before = s.loglik[0]
    surveyed_distance.surveyed_distance_update(c, s, 0, pair, 3.0, True, work)
    assert s.loglik[0] == (before if from_turn else pytest.approx(before - 0.5 * c["nis_cap"]))


@pytest.mark.parametrize("vehicle", ["human", "hand", "hand, told", "car"])
def test_slopes_are_carried_as_errors_of_the_states_are(vehicle):
    """Accelerations are zero: a rotation would change others."""
    vehicle, *told = vehicle.split(", ")
    c, s, work, _ = open_group(vehicle)
    s.nodes["has_ahrs_feedback"], s.nodes["by_gyroscope"] = bool(told), True
    c["fast_length"] = c["slow_length"] = c["nlos_bias_length"] = 1e12
    s.last_attitude_accel[:, 4:] = 0.0
    for name in ("i_tilt_bias", "i_acc_bias", "i_gyro_bias"):
        for at in s.nodes[name][s.nodes[name] >= 0]:
            s.x[0, at : at + 3] = 0.0
    x0, h = s.x[0].copy(), 1e-6
    s.sensitivity[0] = np.random.default_rng(3).standard_normal(s.sensitivity[0].shape)
    for z in s.sensitivity[0].copy():
        reached = []
        for step in (h, -h, 0.0):  # the last one is the nominal step
            s.x[0], s.preintegrated[:] = x0 + step * z, 0.0
            for i in range(3):
                s.nodes["t_pre"][i] = 0.0
                preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, i, 0.05)
            propagation.predict(c, s, 0, 0.05, work)
            reached.append(s.x[0].copy())
        expected = (reached[0] - reached[1]) / (2.0 * h)
        s.x[0], before = x0, s.sensitivity[0].copy()
        s.sensitivity[0, 0] = z
        alignment_sensitivity.propagate_sensitivity(c, s, 0, work)
        np.testing.assert_allclose(s.sensitivity[0, 0], expected, atol=1e-6)
        s.sensitivity[0] = before


def test_what_an_orientation_is_turned_upright_by_turns_with_the_frame():
    """The bias is in the world frame: with the rotation M it is ``M u`` in the local frame."""
    c, s, work, _ = open_group("hand")
    s.last_attitude_accel[:, 4:], s.nodes["has_ahrs_feedback"] = 0.0, True
    x0, reached = s.x[0].copy(), []
    gain = np.random.default_rng(4).standard_normal((3, 2))
    for given_ in (0.0 * gain, gain):
        s.x[0], s.sensitivity[0], s.preintegrated[:] = x0, 0.0, 0.0
        for i in range(3):
            s.nodes["t_pre"][i] = 0.0
            preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, i, 0.05)
        s.preintegrated[:, TILT_GAIN : TILT_GAIN + 2] = given_
        propagation.predict(c, s, 0, 0.05, work)
        alignment_sensitivity.propagate_sensitivity(c, s, 0, work)
        reached.append((s.x[0].copy(), s.sensitivity[0].copy()))
    (x, slope), (x_told, slope_told) = reached
    for i, at in enumerate(s.nodes["i_tilt_bias"]):
        cos, sin = np.cos(x0[s.nodes["i_heading"][i]]), np.sin(x0[s.nodes["i_heading"][i]])
        u = np.array([*(np.array([[cos, -sin], [sin, cos]]) @ gain[i]), 0.0])
        keep = work.scale[at : at + 3]
        np.testing.assert_allclose((x_told - x)[at : at + 3], keep * u, atol=1e-9)
        by_turn = (slope_told - slope)[:, at : at + 3].reshape(3, 3, 3)
        np.testing.assert_allclose(by_turn, np.einsum("ra,q,r->rqa", np.eye(3), u, keep), atol=1e-9)


def test_what_stands_still_tells_nothing_of_a_turn():
    """Antennas away from their nodes keep their offsets, and readings at rest are biases."""
    c, s, work, layout = running(3, "hand", static=(3,))
    antenna_b = np.array([[0.1, -0.2, 0.05], [0.0, 0.0, 0.0], [-0.1, 0.0, 0.3]])
    layout = layout._replace(antenna_b=antenna_b)
    s.nodes["antenna"] = [0, 1, 2]
    moving = ~s.nodes["static"]
    for i in np.nonzero(moving)[0]:
        s.x[0, s.nodes["i_acc_bias"][i] + np.arange(3)] = 0.0
        s.x[0, [s.nodes["i_heading"][i], *(s.nodes["i_vel"][i] + np.arange(3))]] = 0.0
        s.x[0, s.nodes["i_tilt_bias"][i] + np.arange(3)] *= 0.01
        s.last_attitude_accel[i, 4:] = s.x[0, s.nodes["i_tilt_bias"][i] + np.arange(3)]
    s.group["alignment"] = Alignment.LINEAR
    alignment_sensitivity.start_alignment(c, s, layout, 0)
    for p in range(len(s.pairs)):
        i, j = s.pairs["i"][p], s.pairs["j"][p]
        levers = [antenna_offset(s.last_attitude_accel, layout, k, k) for k in (i, j)]
        _, m = predict_range(c, s, 0, p, *levers, work.idx, work.val)
        lever_arm_sensitivity(np.concatenate(levers), work)
        alignment_sensitivity.innovation_sensitivity(s, 0, m, work)
        np.testing.assert_allclose(work.gradient, 0.0, atol=1e-12)
    s.preintegrated[:] = 0.0
    for i in np.nonzero(moving)[0]:
        preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, i, 0.3)
    propagation.predict(c, s, 0, 0.3, work)
    alignment_sensitivity.propagate_sensitivity(c, s, 0, work)
    at_v = s.nodes["i_vel"][moving][:, None] + np.arange(3)
    # Except the tilt implied by the bias, which is of second order.
    assert (
        np.abs(s.sensitivity[0][:, at_v]).max()
        < 0.01 * 0.3 * np.abs(s.last_attitude_accel[moving, 4:]).max()
    )


@pytest.mark.parametrize("vehicle", ["human", "hand"])
def test_turning_the_frame_back_changes_nothing(vehicle):
    c, s, work, _ = open_group(vehicle)
    drive(c, s, work, np.eye(3))
    names = ("x", "P", "sensitivity", "alignment_score", "alignment_information", "loglik")
    before = {name: getattr(s, name).copy() for name in names}
    R = anywhere(np.random.default_rng(2))
    alignment_modes.rotate_frame(c, s, 0, R)
    assert np.abs(s.x - before["x"]).max() > 0.1
    alignment_modes.rotate_frame(c, s, 0, np.ascontiguousarray(R.T))
    for name in names:
        np.testing.assert_allclose(getattr(s, name), before[name], atol=1e-8, err_msg=name)


def test_fixed_nodes_of_a_room_are_rather_flat_than_tall():
    """The prior is dropped with the rotation, not with the layout."""
    c, s, _, layout = running(3, "human", static=(1, 2, 3))
    at = s.nodes["i_pos"]
    for k, place in enumerate(([0.0, 0.0, 0.0], [0.3, 0.0, 4.0], [0.3, 0.2, 9.0])):
        s.x[0, at[k] : at[k] + 3] = place
    s.group["alignment"] = Alignment.LINEAR
    alignment_sensitivity.start_alignment(c, s, layout, 0)
    turns, _ = rotation_modes.find_modes(
        s.alignment_information[0], s.alignment_score[0], layout.rotations, c["same_mode"]
    )
    alignment_modes.rotate_frame(c, s, 0, turns[0])
    heights = s.x[0, at + 2]
    assert np.ptp(heights) < 0.3


def test_an_unknown_turn_makes_no_layout_flat(make_group):
    group = make_group(n=5, dimensions=3)
    c = as_records(make_coefficients(group.constellation, JointParams()))[0]
    batch = make_state(group.constellation, JointParams(), 1, 1)
    s = JointState._make(as_records(a[0]) if a.dtype.names else a[0] for a in batch)
    s.nodes["present"] = True
    at = s.nodes["i_pos"]
    pos = group.pos(1.0).reshape(-1, 3)
    pos -= pos.mean(axis=0)
    for k, place in enumerate(pos):
        s.x[0, at[k] : at[k] + 3] = place
    s.P[0] = 1e-4 * np.eye(s.x.shape[1])
    well_known = degeneracy_ratio(c, s, 0, True)
    # Most of an error that is linear along the layout is a rotation, if errors are alike.
    assert degeneracy_ratio(c, s, 0, False) > well_known > 10.0
    for a in range(3):
        turn = np.zeros(s.x.shape[1])
        for k, place in enumerate(pos):
            turn[at[k] : at[k] + 3] = np.cross(np.eye(3)[a], place)
        s.P[0] += 0.3**2 * np.outer(turn, turn)
    assert degeneracy_ratio(c, s, 0, True) < 0.2 * well_known
    assert degeneracy_ratio(c, s, 0, False) > well_known


@settings(max_examples=20)
@given(st.integers(0, 2**31), st.sampled_from([2, 3]), st.integers(3, 7), st.booleans())
def test_degeneracy_is_the_extent_across_a_layout_over_what_a_regression_leaves_of_its_error(
    seed, dimensions, n, turns
):
    group = ExactGroup("human", range(n), hz=50.0, dimensions=dimensions, seconds=1.0)
    c = as_records(make_coefficients(group.constellation, JointParams()))[0]
    batch = make_state(group.constellation, JointParams(), 1, 1)
    s = JointState._make(as_records(a[0]) if a.dtype.names else a[0] for a in batch)
    rng = np.random.default_rng(seed)
    s.nodes["present"] = True
    s.nodes["present"][0] = n < 5  # an absent node
    there = np.flatnonzero(s.nodes["present"])
    at = s.nodes["i_pos"][there][:, None] + np.arange(dimensions)
    pos = rng.standard_normal((len(there), dimensions)) * rng.uniform(0.1, 5.0, dimensions)
    s.x[0, at] = pos
    A = rng.standard_normal(s.P[0].shape)
    s.P[0] = 1e-3 * A @ A.T
    found = degeneracy_ratio(c, s, 0, turns)
    if len(there) <= dimensions:
        assert found == np.inf
        return
    pos -= pos.mean(axis=0)
    _, extent, axes = np.linalg.svd(pos)
    columns = [np.ones(len(there))]
    if dimensions == 3 and not turns:
        columns += [pos @ axes[0], pos @ axes[1]]
    rest = np.eye(len(there)) - np.stack(columns, 1) @ np.linalg.pinv(np.stack(columns, 1))
    across = np.zeros((len(there), s.x.shape[1]))
    across[np.arange(len(there))[:, None], at] = axes[-1]
    assert found == pytest.approx(extent[-1] / np.sqrt(np.trace(rest @ across @ s.P[0] @ across.T)))
    np.testing.assert_allclose(np.abs(least_axis(c, s, 0) @ axes[-1]), 1.0)


def turned(group, R):  # noqa: N803
    """Return the measurements with accelerations in a rotated world."""
    block = group.block
    values = block.values.copy()
    state = block.kind == Kind.STATE
    values[state, 4:7] = values[state, 4:7] @ R.T
    return type(block)(
        **{f: values if f == "values" else getattr(block, f) for f in block.__slots__}
    )


@pytest.mark.parametrize("seed", range(6))
def test_a_group_in_space_finds_how_it_is_turned(make_group, seed):
    """This holds for any rotation of the world; a wrong reflection is never OK."""
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
    """The cloned states of one moment have no sensitivities."""
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
