"""The joint filter's core against its specification in plain numpy, over whole runs."""

import numpy as np
import pytest

from tests.exact_motion import ExactGroup
from tests.tracking.joint_reference import JointReference
from tracking.filters.joint import JointEkf
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.joint.params import JointParams, NoiseLearningParams
from tracking.measurements import Kind
from tracking.models.nlos import power_evidence

START, END = 9.0, 10.5
SAME = 1e-5
"""[s] Largest rounding difference between times of ranges from one message."""


def noisy(vehicle, at_rest, powers):
    """Return a group with noisy ranges, some of them NLOS for a while."""
    group, rng = (
        ExactGroup(vehicle, range(3), hz=50.0, at_rest=at_rest, seconds=12.0),
        np.random.default_rng(5),
    )
    block = group.block
    ranges = block.kind[0] == Kind.RANGE
    n = int(ranges.sum())
    first = block.i[0, ranges] + block.j[0, ranges] == 1
    hidden = first & (block.t[0, ranges] % 2.0 < 0.7)
    block.values[0, ranges, 0] += 0.05 * rng.standard_normal(n) + 0.4 * hidden
    if powers:
        block.has_power[0, ranges] = True
        block.values[0, ranges, 1] = -80.0
        gap = np.where(hidden, 8.0, 3.0) + rng.standard_normal(n)
        block.values[0, ranges, 2] = -80.0 - gap
    return group, block


def advance(reference, t):
    """Predict to t if it is due, and apply the constraints."""
    c, g = reference.c, reference.group
    due = t - g["t_constraints"] + SAME >= c["constraint_period"]
    since = t - g["t"]
    if since > SAME and (due or since + SAME >= c["propagation_period"]):
        reference.predict(t)
    if due:
        reference.constrain(t)
    if t - g["t_gauge"] + SAME >= 1.0:
        reference.centre(t)


def check(reference, t):
    """Update the uncertainty of the planar group's rotation from time to time."""
    if t - reference.group["t_check"] + SAME >= reference.c["check_period"]:
        A = reference.read_rotation(reference.x[reference.i_pos])
        reference.group["heading_gauge_var"] = A @ reference.P @ A
        reference.group["t_check"] = t


def follow(reference, block, first, last):
    """Feed the events of a time interval to the reference."""
    c = reference.c
    for k in np.flatnonzero((block.t[0] > first) & (block.t[0] <= last)):
        t, i, j, values = block.t[0, k], block.i[0, k], block.j[0, k], block.values[0, k]
        if block.kind[0, k] == Kind.STATE:
            reference.attitude(i, t, values[:4], values[4:7])
            continue
        evidence, rates = 0.0, (c["los_to_nlos_rate"], c["nlos_to_los_rate"])
        share = c["nlos_large_share"]
        if block.has_power[0, k]:
            evidence = power_evidence(c.view(np.recarray), values[1] - values[2])
            rates = c["los_to_nlos_rate_with_power"], c["nlos_to_los_rate_with_power"]
        advance(reference, t)
        for node in (i, j):
            reference.integrate(node, t)
        check(reference, t)
        reference.range(reference.pair_index[i, j], t, values[0], evidence, rates, share)


@pytest.mark.parametrize("powers", [False, True], ids=["ranges", "powers"])
@pytest.mark.parametrize(
    ("vehicle", "at_rest"), [("car", False), ("robot", False), ("human", True)]
)
def test_runs_match_the_reference(vehicle, at_rest, powers):
    group, block = noisy(vehicle, at_rest, powers)
    params = JointParams(noise_learning=NoiseLearningParams(learns=False))
    tracker = JointEkf(group.constellation, params)
    tracker.run(block.take(block.t[0] <= START), np.array([[START]]))
    state = tracker.save()
    assert state.group["alignment"][0, 0] == Alignment.FILTERED
    one = type(state)._make(array[0] for array in state)
    coefficients = make_coefficients(group.constellation, params)[0]
    reference = JointReference(coefficients, one, group.constellation.pair_index)
    follow(reference, block, START, END)
    tracker.run(block.take((block.t[0] > START) & (block.t[0] <= END)), np.array([[END]]))
    found = tracker.save()
    h = int(found.group["best"][0, 0])
    pending = found.pending_updates[0, h, : found.n_pending[0, h]]
    np.testing.assert_allclose(found.x[0, h], reference.x, atol=1e-7)
    np.testing.assert_allclose(found.P[0, h] - pending.T @ pending, reference.P, atol=1e-7)
    np.testing.assert_allclose(found.nlos[0, h], reference.nlos, atol=1e-7)
