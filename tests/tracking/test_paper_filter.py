"""The paper's algorithm: the compiled filter matches the specification, and its parts are right."""

from dataclasses import replace

import numpy as np
import pytest

from tests.exact_motion import ExactGroup
from tests.tracking.paper_reference import PaperReference
from tests.tracking.paper_reference_ekf import PairFilter
from tracking import Status, Tracker, TrackerParams
from tracking.errors import ConfigError
from tracking.filters import FilterParams
from tracking.filters.paper import PaperEkf, PaperParams
from tracking.filters.paper.params import CHOICES
from tracking.measurements import Kind, MeasurementBlock

OPTIONS = [{}, *({name: value} for name, values in CHOICES.items() for value in values[1:])]


def noisy(group, seed=0):
    """Return ranges with noise and outliers, and a node that leaves and comes back."""
    rng, block = np.random.default_rng(seed), group.block
    values, ranges = block.values.copy(), block.kind[0] == Kind.RANGE
    values[0, ranges, 0] += 0.05 * rng.standard_normal(ranges.sum())
    values[0, ranges, 0] += 3.0 * (rng.random(ranges.sum()) < 0.02)
    last = group.constellation.n_nodes - 1
    silent = (block.i[0] == last) | (block.j[0] == last)
    silent &= ranges & (block.t[0] > 3.0) & (block.t[0] < 4.0)
    leave = MeasurementBlock.of_kind(
        Kind.LEAVE, np.array([3.2]), np.array([last]), np.zeros((1, 1)), j=np.array([last])
    )
    kept = replace(block, values=values).take(~silent)
    return MeasurementBlock.concatenate([kept, leave]).sorted()


@pytest.mark.parametrize("option", OPTIONS, ids=str)
@pytest.mark.parametrize(("n", "dimensions", "seconds"), [(3, 2, 12.0), (5, 2, 8.0), (6, 3, 2.5)])
def test_the_compiled_filter_is_the_specification(n, dimensions, seconds, option):
    if dimensions == 3 and "scaling" in option:
        seconds = 1.5  # a layout that shrinks to a metre amplifies rounding
    group = ExactGroup("human", range(n), hz=50.0, dimensions=dimensions, seconds=seconds)
    t, block = np.linspace(0.2, seconds - 0.1, 150), noisy(group)
    # Noise as in the data: divergence amplifies rounding.
    params = PaperParams(accel_std=0.5, range_std=0.1, speed_std=0.5, **option)
    x, P = PaperReference(group.constellation, params).run(block, t)
    estimate = PaperEkf(group.constellation, params).run(block, t[None]).take(0)
    np.testing.assert_allclose(estimate.pos_ij_w, x[..., :3], atol=1e-9, rtol=0.0)
    np.testing.assert_allclose(estimate.vel_ij_w, x[..., 3:6], atol=1e-9, rtol=0.0)
    np.testing.assert_allclose(estimate.cov, P[..., :6, :6], atol=1e-9, rtol=0.0)
    for p, (i, j) in enumerate(group.constellation.pairs):
        there = estimate.status[:, p] >= Status.OK
        q = estimate.relative_orientation(i, j)
        np.testing.assert_allclose(q[there], x[there, p, 6:], atol=1e-9)


def test_the_covariance_of_the_relative_orientation_is_that_of_both():
    """The reference is W_q Sigma_q W_q^T with the matrices of the specification, at random."""
    rng = np.random.default_rng(3)
    f = PairFilter(3, np.array([1.0, 2.0, 3.0]), np.array([1.0, 0, 0, 0]), 0.0, 3.7, False)
    u = rng.standard_normal(14)
    u[6:10] /= np.linalg.norm(u[6:10])
    u[10:] /= np.linalg.norm(u[10:])
    f.predict(0.01, u, np.diag(np.r_[np.full(6, 0.3), np.full(8, 0.02)] ** 2), 3)
    np.testing.assert_allclose(f.P[6:, 6:], 2.0 * 0.02**2 * np.eye(4), atol=1e-15)
    np.testing.assert_array_equal(f.P[:6, 6:], 0.0)


@pytest.mark.parametrize("model", CHOICES["speed"])
def test_the_jacobian_of_the_speed_is_that_of_its_model(model):
    """A correction by a tiny innovation moves the state along P H^T, H by finite differences."""
    c = PaperParams(speed=model, range_std=1e6, speed_std=1.0, gate_floor=1e9)
    x, v, h = np.array([1.0, -2.0, 0.5]), np.array([0.4, 0.9, -0.3]), 1e-6

    def speed(state):
        norm = np.linalg.norm(state[3:])
        return norm if model == "norm" else state[:3] @ state[3:] / np.linalg.norm(state[:3])

    state = np.r_[x, v]
    H = [(speed(state + h * e) - speed(state - h * e)) / (2 * h) for e in np.eye(6)]
    f = PairFilter(3, x, np.array([1.0, 0, 0, 0]), 0.0, float(np.linalg.norm(x)), False)
    f.x[3:6] = v
    f.rate = speed(state) + 0.01
    f.last = f.mean = float(np.linalg.norm(x))
    f.correct(0.0, f.last, c)
    moved = f.x[:6] - state
    np.testing.assert_allclose(moved, 0.01 * np.array(H) / (np.dot(H, H) + 1.0), atol=1e-5)


def test_mds_reproduces_the_distances():
    group = ExactGroup("none", range(5), dimensions=3, seconds=1.0)
    pos = np.random.default_rng(1).standard_normal((5, 3))
    D = np.linalg.norm(pos[:, None] - pos[None], axis=-1)
    X = PaperReference(group.constellation, PaperParams()).mds(D)
    np.testing.assert_allclose(np.linalg.norm(X[:, None] - X[None], axis=-1), D, atol=1e-12)
    assert (np.sum(X**3, axis=0) >= 0.0).all()


def test_given_its_first_layout_it_follows_exact_data_in_the_frame_of_the_world():
    """The range has its true derivative; without a first layout the frame is arbitrary."""
    group = ExactGroup("human", range(4), hz=100.0, seconds=6.0)
    first = group.at(group.pos, np.array([0.08]))[0]
    params = PaperParams(
        speed="rate", speed_std=1e3, first_layout=tuple(tuple(map(float, p)) for p in first)
    )
    tracker = Tracker(
        group.constellation, TrackerParams(filter=FilterParams(paper=params)),
        filter="paper-ekf-mds",
    )  # fmt: skip
    t = np.arange(2.0, 5.9, 0.1)
    error = tracker.run(group.block, t).take(0).pos_ij_w - group.pairs(t)
    assert np.sqrt((error**2).sum(axis=-1).mean()) < 0.2


@pytest.mark.parametrize(
    ("wrong", "named"),
    [({"speed": "fast"}, "speed"), ({"range_std": 0.0}, "range_std"), ({"k": -1}, "k")],
)
def test_wrong_parameters_are_named(wrong, named):
    with pytest.raises(ConfigError, match=named):
        PaperParams(**wrong)


def test_a_layout_of_another_number_of_nodes_is_refused():
    group = ExactGroup("none", range(3), seconds=1.0)
    with pytest.raises(ConfigError, match="first_layout"):
        PaperEkf(group.constellation, PaperParams(first_layout=((0.0, 0.0, 0.0),)))
