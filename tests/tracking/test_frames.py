"""Hypotheses of the modes of a group's rotation in space."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from test_joint_kernels import running
from test_open_turn import MIRROR, anywhere, log_likelihood

from tracking.filters.joint.ekf import scalar_update
from tracking.filters.joint.hypotheses import alignment_modes, alignment_sensitivity, bank
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.joint.state import JointState
from tracking.filters.joint.updates import motion_constraints, range_update
from tracking.maths import rotation_modes


def told(rng, R, weight):
    """Return information and score of a likelihood of rotations with its maximum at R."""
    information, score = np.zeros((9, 9)), np.zeros(9)
    for v in rng.standard_normal((8, 3)):
        for r in range(3):
            g = np.zeros((3, 3))
            g[r] = v
            information += weight * np.outer(g.ravel(), g.ravel())
            score += weight * ((R - np.eye(3)) @ v)[r] * g.ravel()
    return information, score


def open_bank(n_hyps=3):
    """Return a group of three with unknown rotation, in a bank with room."""
    c, s, work, layout = running(3, "human")
    names = (
        "x P pending_updates n_pending accumulated_correction nlos bias_retention loglik alive "
        "sensitivity alignment_score alignment_information alignment_cov"
    )
    s = s._replace(**{k: np.repeat(getattr(s, k), n_hyps, axis=0) for k in names.split()})
    s.alive[1:] = False
    n = s.x.shape[1]
    A = np.random.default_rng(5).standard_normal((n, n))
    s.P[0] = A @ A.T / n + 0.1 * np.eye(n)
    s.group["alignment"] = Alignment.LINEAR
    alignment_sensitivity.start_alignment(c, s, layout, 0)
    s.group["alignment"] = Alignment.MODES
    return c, s, work, layout


def places(s, h):
    return s.x[h, s.nodes["i_pos"][:, None] + np.arange(3)]


def test_derivatives_of_a_small_turn():
    J, step = alignment_sensitivity.small_rotation_derivatives(), 1e-6
    for a in range(3):
        turn = Rotation.from_rotvec(step * np.eye(3)[a]).as_matrix() - np.eye(3)
        np.testing.assert_allclose(J[a], turn.ravel() / step, atol=1e-5)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**31))
def test_a_frame_goes_to_the_peak_near_it(seed):
    rng = np.random.default_rng(seed)
    c, s, _, _ = open_bank()
    R = Rotation.from_rotvec(rng.uniform(-0.3, 0.3, 3)).as_matrix()
    s.alignment_information[0], s.alignment_score[0] = told(rng, R, 100.0)
    before = places(s, 0)
    for _ in range(20):
        known = alignment_modes.move_to_mode(c, s, 0)
    assert known
    # The rotation to the mode is the identity afterwards, within the resolution of steps.
    np.testing.assert_allclose(places(s, 0), before @ R, atol=6.0 * c["mode_step"])
    peak, H = np.eye(3), np.zeros((3, 3))
    rotation_modes.climb_to_mode(s.alignment_information[0], s.alignment_score[0], peak, H)
    assert Rotation.from_matrix(peak).magnitude() < 2.0 * c["mode_step"]


def test_a_frame_does_not_turn_about_an_axis_of_which_nothing_is_known():
    c, s, _, _ = open_bank()
    # Only a tilted vertical was measured, so the rotation about the vertical is unknown.
    lean = Rotation.from_rotvec([0.2, 0.0, 0.0]).as_matrix()
    information, score, up = np.zeros((9, 9)), np.zeros(9), [0.0, 0.0, 1.0]
    for r in range(3):
        g = np.outer(np.eye(3)[r], up).ravel()
        information += 500.0 * np.outer(g, g)
        score += 500.0 * ((lean - np.eye(3)) @ up)[r] * g
    s.alignment_information[0], s.alignment_score[0] = information, score
    before = places(s, 0)
    for _ in range(5):
        assert not alignment_modes.move_to_mode(c, s, 0)
    turn, _ = Rotation.align_vectors(before - before.mean(0), places(s, 0) - places(s, 0).mean(0))
    np.testing.assert_allclose(turn.as_rotvec(), [0.2, 0.0, 0.0], atol=c["mode_step"])


def test_every_turn_that_may_be_has_a_frame():
    c, s, _, _ = open_bank()
    rng = np.random.default_rng(2)
    turns = np.array([anywhere(rng), MIRROR @ anywhere(rng), anywhere(rng), anywhere(rng)])
    values = np.array([30.0, 28.0, 20.0, 15.0])
    s.alignment_information[0], s.alignment_score[0] = told(rng, turns[0], 10.0)
    s.loglik[0] = 1.0
    begun = JointState._make(a.copy() for a in s)
    alignment_modes.spawn_modes(c, s, 0, turns, values)
    assert s.alive.all()
    assert s.group["n_alive"][0] == 3
    for h in range(3):  # the bank has no room for a fourth
        assert s.loglik[h] == pytest.approx(1.0 + values[h])
        np.testing.assert_allclose(places(s, h), places(begun, 0) @ turns[h], atol=1e-9)
        # The log-likelihood of M' in the new frame is that of R M' in the old one.
        other = anywhere(rng)
        old = log_likelihood(begun.alignment_information[0], begun.alignment_score[0], other)
        old -= log_likelihood(begun.alignment_information[0], begun.alignment_score[0], turns[h])
        new = log_likelihood(s.alignment_information[h], s.alignment_score[h], turns[h].T @ other)
        assert new == pytest.approx(old, abs=1e-8)


@pytest.mark.parametrize("parted", [True, False])
def test_frames_that_have_come_together_are_one(parted):
    """Their distance is less than that of two modes."""
    c, s, _, _ = open_bank()
    s.group["t"], s.group["best"] = 100.0, 0
    s.group["alignment"] = Alignment.MODES if parted else Alignment.LINEAR
    s.alignment_information[0], s.alignment_score[0] = told(
        np.random.default_rng(3), np.eye(3), 10.0
    )
    turns = np.array([np.eye(3), Rotation.from_rotvec([0.0, 0.0, 0.25]).as_matrix()])
    alignment_modes.spawn_modes(c, s, 0, turns, np.zeros(2))
    s.group["alignment"] = Alignment.MODES if parted else Alignment.FILTERED
    bank.prune_bank(c, s)
    assert s.alive.sum() == (1 if parted else 2)


@pytest.mark.parametrize("parted", [True, False])
def test_a_frame_is_not_likelier_for_being_surer(parted):
    """All modes are equally certain if linear; wrong ones look more certain by nonlinearity."""
    c, s, work, _ = open_bank()
    s.group["alignment"] = Alignment.MODES if parted else Alignment.LINEAR
    s.group["n_alive"] = 2
    p, gained = 0, []
    for scale in (1.0, 0.01):
        s.P[1], s.x[1], s.sensitivity[1], s.nlos[1] = (
            scale * s.P[0],
            s.x[0],
            s.sensitivity[0],
            s.nlos[0],
        )
        s.alignment_cov[1], s.loglik[1], s.pending_updates[1], s.n_pending[1] = 0.0, 0.0, 0.0, 0
        levers = np.zeros(6)
        distance, _ = range_update.predict_range(
            c, s, 1, p, levers[:3], levers[3:], work.idx, work.val
        )
        work.direct[:] = 0.0
        sight = (0.0, c["los_to_nlos_rate"], c["nlos_to_los_rate"])
        range_update.range_update(c, s, 1, p, 0.02, distance, levers, sight, work)
        of_range = s.loglik[1]
        work.idx[0], work.val[0] = s.nodes["i_vel"][0], 1.0
        motion_constraints.apply_constraint(c, s, 1, 0.0, 1, 0.1, work)
        gained.append((of_range, s.loglik[1] - of_range))
    surer = np.subtract(gained[1], gained[0])
    # The remainder is the effect of the NLOS probability.
    np.testing.assert_allclose(surer, 0.0, atol=0.1)


def test_the_nis_is_over_the_variance_that_the_correction_used():
    """The reference is the reduction of the range variance, from v to v - v^2 / S."""
    c, s, work, _ = open_bank()
    s.group["n_alive"], s.group["alignment"] = 1, Alignment.FILTERED
    h, p, levers = 0, 0, np.zeros(6)
    sight = (0.0, c["los_to_nlos_rate"], c["nlos_to_los_rate"])

    def predicted():
        distance, m = range_update.predict_range(
            c, s, h, p, levers[:3], levers[3:], work.idx, work.val
        )
        return distance, scalar_update.compute_pht(s, h, m, work)

    before, v = predicted()
    nu, _, nis, sane, _ = range_update.range_update(
        c, s, h, p, 0.02, before + 0.05, levers, sight, work
    )
    _, after = predicted()
    assert sane > 0.99
    assert nis == pytest.approx(nu * nu * (v - after) / (v * v), rel=0.02)
