"""With exact data, no numbering of the nodes leads to an estimate that is OK and wrong."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from tests.exact_motion import ExactGroup
from tracking import Tracker
from tracking.measurements import Kind
from tracking.metrics.integrity import wrong_while_ok

T = np.arange(0.2, 11.5, 0.05)
NUMBERINGS = (
    *permutations(range(3)),
    *list(permutations(range(4)))[::5],
    *list(permutations(range(5)))[::30],
)
PLANE = ("none", "robot", "human", "car", "drone")


def track(group, block=None, filter="joint"):
    block = group.block if block is None else block
    return Tracker(group.constellation, filter=filter).run(block, T).take(0)


def check_numberings(groups):
    """Assert that no pair is OK and wrong, and that pairs that are OK agree within 3 sigma."""
    first = {}
    for numbering, group in groups:
        estimate = track(group)
        assert not wrong_while_ok(estimate, group.pairs(T)).any(), numbering
        # Keyed by the original nodes, so that pairs of two numberings can be compared.
        for p, (i, j) in enumerate(group.constellation.pairs):
            a, b = numbering[i], numbering[j]
            sign = 1.0 if a < b else -1.0
            key = len(numbering), min(a, b), max(a, b)
            pos, cov = sign * estimate.pos_ij_w[:, p], estimate.cov[:, p, :3, :3]
            ok = estimate.ok[:, p]
            if key in first:
                other, other_cov, other_ok = first[key]
                off = pos - other
                far = np.linalg.norm(off, axis=-1)
                along = np.einsum("ti,tij,tj->t", off, cov + other_cov, off)
                both = ok & other_ok & (far > 0.3)
                assert (far[both] ** 4 <= 9.0 * along[both]).all(), numbering
            else:
                first[key] = pos, cov, ok


@pytest.mark.parametrize("hz", [28.0, 50.0, 100.0])
@pytest.mark.parametrize("at_rest", [False, True], ids=["moving", "at rest"])
@pytest.mark.parametrize("vehicle", PLANE)
def test_no_numbering_is_ok_and_wrong(vehicle, at_rest, hz):
    check_numberings((o, ExactGroup(vehicle, o, hz=hz, at_rest=at_rest)) for o in NUMBERINGS)


@pytest.mark.parametrize("hz", [28.0, 100.0])
@pytest.mark.parametrize("at_rest", [False, True], ids=["moving", "at rest"])
@pytest.mark.parametrize("vehicle", ["human", "drone"])
def test_no_numbering_is_ok_and_wrong_in_space(vehicle, at_rest, hz):
    orders = [o for o in NUMBERINGS if len(o) > 3]
    check_numberings(
        (o, ExactGroup(vehicle, o, hz=hz, at_rest=at_rest, dimensions=3)) for o in orders
    )


def with_absurd(group, add, count, seed):
    """Return the block with outliers among the first ranges of a pair."""
    block, rng = group.block, np.random.default_rng(seed)
    i, j = group.constellation.pairs[rng.integers(group.constellation.n_pairs)]
    of_pair = (block.kind[0] == Kind.RANGE) & (block.i[0] == i) & (block.j[0] == j)
    before = np.nonzero(of_pair & (block.t[0] <= 0.5))[0]
    values = block.values.copy()
    hit = rng.choice(before[-8:], count, replace=False)
    values[0, hit, 0] = np.maximum(values[0, hit, 0] + add, 0.01)
    return replace(block, values=values)


@pytest.mark.parametrize("add", [10.0, 20.0, 50.0, -2.0])
@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("vehicle", ["robot", "car", "human"])
def test_absurd_first_ranges_make_nothing_ok_and_wrong_and_delay_little(vehicle, count, add):
    for seed in range(4):
        # The rotation of cars that start in motion is determined after 12 s.
        group, t = (
            ExactGroup(vehicle, (0, 1, 2, 3), hz=50.0, seconds=16.0),
            np.arange(0.2, 15.5, 0.05),
        )
        runs = group.block, with_absurd(group, add, count, seed)
        clean, hit = (Tracker(group.constellation).run(block, t).take(0) for block in runs)
        assert not wrong_while_ok(hit, group.pairs(t)).any()
        begins = [t[e.ok.all(axis=1)][0] for e in (clean, hit)]
        assert begins[1] <= begins[0] + 0.5
