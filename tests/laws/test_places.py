"""Laws of finding the place of a node from its distances to others."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.filters.joint._place_kernels import (
    SHORT,
    best_place,
    mirror_image,
    sum_of_misfits,
)


def layout(seed, d, n=5):
    """Places of n others that span the space, and a node among them, (other, 3) and (3) [m]."""
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
@settings(max_examples=60, deadline=None)
def test_exact_distances_lead_to_the_place_from_anywhere(seed, d):
    known, pos, distance = layout(seed, d)
    found = np.zeros(3)
    found[:d] = np.random.default_rng(seed + 1).uniform(-3.0, 3.0, d)
    assert best_place(d, known, distance, found) < 1e-6
    np.testing.assert_allclose(found, pos, atol=1e-4)


@given(seed=st.integers(0, 2**32 - 1), d=st.sampled_from([2, 3]), k=st.integers(0, 4))
@settings(max_examples=60, deadline=None)
def test_a_place_is_never_replaced_by_one_that_fits_worse(seed, d, k):
    """One distance is what an obstacle made of it, and the search begins at the truth."""
    known, pos, distance = layout(seed, d)
    distance[k] += 0.5
    found = pos.copy()
    least = best_place(d, known, distance, found)
    assert least <= sum_of_misfits(known, distance, pos)
    assert least == sum_of_misfits(known, distance, found)


@given(seed=st.integers(0, 2**32 - 1), d=st.sampled_from([2, 3]))
@settings(max_examples=60, deadline=None)
def test_the_mirror_image_of_the_mirror_image_is_the_place(seed, d):
    known, pos, _ = layout(seed, d)
    image = mirror_image(d, known, pos)
    np.testing.assert_allclose(mirror_image(d, known, image), pos, atol=1e-9)
    if d == 2:
        assert image[2] == pos[2]


@pytest.mark.parametrize("d", [2, 3])
def test_short_distances_say_more_than_long_ones(d):
    known, pos, distance = layout(0, d)
    long, short = distance.copy(), distance.copy()
    long[0] += 2.0 * SHORT
    short[0] -= 2.0 * SHORT
    assert sum_of_misfits(known, short, pos) == pytest.approx(4.0)
    assert sum_of_misfits(known, long, pos) < 1.0


def test_others_in_line_leave_both_sides():
    """The place that is found is on one side or the other, and fits all distances."""
    known = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.5, 0.0, 0.0]])
    pos = np.array([0.3, 1.2, 0.0])
    distance = np.linalg.norm(known - pos, axis=1)
    found = np.array([0.5, -0.2, 0.0])
    assert best_place(2, known, distance, found) < 1e-6
    np.testing.assert_allclose(np.abs(found), np.abs(pos), atol=1e-4)
