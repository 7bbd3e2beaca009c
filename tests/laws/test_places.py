"""Properties of multilateration: the position of a node from distances to others."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking import Constellation, NodeConfig
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.params import JointParams, JointStartParams
from tracking.maths.multilateration import (
    best_position,
    best_positions,
    reflected_position,
    total_loss,
)
from tracking.records import as_records


@cache
def coefficients(d):
    nodes = (NodeConfig(id=0), NodeConfig(id=1))
    constellation = Constellation(nodes=nodes, dimensions=d)
    return as_records(make_coefficients(constellation, JointParams()))[0]


def layout(seed, d, n=5):
    """Return positions of n others that span the space and of a node, and the distances [m]."""
    rng = np.random.default_rng(seed)
    known, pos = np.zeros((n, 3)), np.zeros(3)
    while True:
        known[:, :d] = rng.uniform(-3.0, 3.0, (n, d))
        pos[:d] = rng.uniform(-3.0, 3.0, d)
        spread = np.linalg.svd(known[:, :d] - known[:, :d].mean(0), compute_uv=False)[-1]
        distance = np.linalg.norm(known - pos, axis=1)
        if spread > 2.0 and distance.min() > 0.3:
            return known, pos, distance


@given(seed=st.integers(0, 2**32 - 1), d=st.sampled_from([2, 3]))
@settings(max_examples=60)
def test_exact_distances_lead_to_the_place_from_anywhere(seed, d):
    known, pos, distance = layout(seed, d)
    found = np.zeros(3)
    found[:d] = np.random.default_rng(seed + 1).uniform(-3.0, 3.0, d)
    assert best_position(coefficients(d), known, distance, found) < 1e-6
    np.testing.assert_allclose(found, pos, atol=1e-4)


@given(seed=st.integers(0, 2**32 - 1), d=st.sampled_from([2, 3]), k=st.integers(0, 4))
@settings(max_examples=60)
def test_a_place_is_never_replaced_by_one_that_fits_worse(seed, d, k):
    """One distance has an NLOS error, and the search begins at the truth."""
    known, pos, distance = layout(seed, d)
    distance[k] += 0.5
    found = pos.copy()
    least = best_position(coefficients(d), known, distance, found)
    assert least <= total_loss(coefficients(2), known, distance, pos)
    assert least == total_loss(coefficients(2), known, distance, found)


@given(seed=st.integers(0, 2**32 - 1), d=st.sampled_from([2, 3]))
@settings(max_examples=60)
def test_the_mirror_image_of_the_mirror_image_is_the_place(seed, d):
    known, pos, _ = layout(seed, d)
    image = reflected_position(d, known, pos)
    np.testing.assert_allclose(reflected_position(d, known, image), pos, atol=1e-9)
    if d == 2:
        assert image[2] == pos[2]


@pytest.mark.parametrize("d", [2, 3])
def test_short_distances_say_more_than_long_ones(d):
    known, pos, distance = layout(0, d)
    long, short = distance.copy(), distance.copy()
    long[0] += 2.0 * JointStartParams().short_error
    short[0] -= 2.0 * JointStartParams().short_error
    assert total_loss(coefficients(2), known, short, pos) == pytest.approx(4.0)
    assert total_loss(coefficients(2), known, long, pos) < 1.0


def test_others_in_line_leave_both_sides():
    """The solution is on either side of the line and fits all distances."""
    known = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.5, 0.0, 0.0]])
    pos = np.array([0.3, 1.2, 0.0])
    distance = np.linalg.norm(known - pos, axis=1)
    found = np.array([0.5, -0.2, 0.0])
    assert best_position(coefficients(2), known, distance, found) < 1e-6
    np.testing.assert_allclose(np.abs(found), np.abs(pos), atol=1e-4)


@given(
    seed=st.integers(0, 2**32 - 1),
    d=st.sampled_from([2, 3]),
    more=st.integers(0, 2),
    wide=st.floats(0.5, 3.0),
)
@settings(max_examples=150)
def test_others_close_together_leave_two_sides_and_one_is_right(seed, d, more, wide):
    """The number of others is that of the dimensions or more; they may be close together."""
    rng = np.random.default_rng(seed)
    known, pos, sides = np.zeros((d + more, 3)), np.zeros(3), np.zeros((2, 3))
    extent = 0.0
    while extent < 0.12:
        known[:, :d] = rng.uniform(-0.5, 0.5, (d + more, d)) * wide
        axes = np.linalg.svd(known[:, :d] - known[:, :d].mean(0), compute_uv=False)
        extent = axes[d - 2] / np.sqrt(d + more)
    pos[:d] = rng.normal(size=d)
    pos *= rng.uniform(1.0, 5.0) / np.linalg.norm(pos)
    distance = np.linalg.norm(known - pos, axis=1)
    n_sides = best_positions(coefficients(d), known, distance, sides)
    off = np.linalg.norm(sides[:n_sides] - pos, axis=1)
    assert off.min() < 0.3
    fits = [total_loss(coefficients(2), known, distance, side) for side in sides[:n_sides]]
    assert fits[0] <= fits[-1] + 1e-6
    assert fits[0] < 0.05


def test_others_that_span_the_room_leave_one_side():
    known, pos, distance = layout(3, 2)
    sides = np.zeros((2, 3))
    assert best_positions(coefficients(2), known, distance, sides) == 1
    np.testing.assert_allclose(sides[0], pos, atol=1e-4)
