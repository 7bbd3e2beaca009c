"""Counter-based random numbers: normal, uniform, and independent for neighbouring keys."""

import numpy as np
import pytest
from scipy.stats import chisquare, kstest, norm

from relpos_env.sensors.radio._normal_kernels import DENSITIES, EDGES, TAIL, normal
from relpos_env.sensors.radio._random_kernels import draw_key, uniform
from tracking.kernels.jit import kernel


def key_of(seed, count):
    return np.uint64(draw_key(np.uint64(seed), np.uint64(count)))


NEIGHBOURS = {
    "counts": lambda k: key_of(7, k),
    "messages": lambda k: key_of(7, (1 << 40) + 4096 * k),
    "knots": lambda k: key_of(key_of(7, 2 << 40), k),
    "seeds": lambda k: key_of(k, 1 << 40),
}
"""Keys that a simulation uses next to each other."""


@pytest.mark.parametrize("what", NEIGHBOURS)
def test_counted_numbers_are_normal_and_independent(what):
    n = 20_000
    keys = [NEIGHBOURS[what](k) for k in range(n)]
    z = np.array([[normal(key, k) for k in range(4)] for key in keys]).T
    for row in z:
        assert kstest(row, "norm").pvalue > 1e-3
        for lag in (1, 2, 64):
            assert abs(np.corrcoef(row[lag:], row[:-lag])[0, 1]) < 4.5 / np.sqrt(n)
    off = np.corrcoef(z) - np.eye(4)
    shifted = np.corrcoef(z[:, 1:], z[:, :-1])[:4, 4:]
    squares = np.corrcoef(z**2) - np.eye(4)
    for table in (off, shifted, squares):
        assert np.abs(table).max() < 4.5 / np.sqrt(n)
    assert kstest([uniform(key, 0) for key in keys], "uniform").pvalue > 1e-3


@kernel
def draw_many(seed, numbers):
    for count in range(numbers.shape[0]):
        key = draw_key(seed, np.uint64(count))
        for k in range(numbers.shape[1]):
            numbers[count, k] = normal(key, k)


def test_millions_of_numbers_have_the_normal_distribution_and_its_tail():
    numbers = np.empty((500_000, 8))
    draw_many(np.uint64(11), numbers)
    edges = norm.ppf(np.linspace(0.0, 1.0, 2001))
    assert chisquare(np.histogram(numbers, edges)[0]).pvalue > 1e-3
    for beyond in (3.0, TAIL, 4.0, 4.5):
        expected = 2.0 * norm.sf(beyond) * numbers.size
        assert abs((np.abs(numbers) > beyond).sum() - expected) < 4.0 * np.sqrt(expected)


def test_layers_are_of_one_size_and_end_at_zero():
    areas = EDGES[1:-1] * np.diff(DENSITIES[1:])
    tail = np.sqrt(2.0 * np.pi) * norm.sf(TAIL)
    np.testing.assert_allclose(areas, TAIL * DENSITIES[1] + tail, rtol=1e-11)
    assert EDGES[-1] == 0.0
    assert (np.diff(EDGES) < 0.0).all()
