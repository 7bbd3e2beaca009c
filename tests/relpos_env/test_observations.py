"""Views and observations against reference implementations; layouts, spaces and limits."""

import numpy as np
import pytest

from relpos_env.interface.observations import (
    OBSERVATIONS,
    index_table,
    observation_mode,
    space_of,
    total_size,
)
from relpos_env.interface.views import bind_view, make_view, reveal
from tracking import Status
from tracking.constellation import Constellation, NodeConfig
from tracking.estimate import TeamEstimate
from tracking.geometry import quat_from_yaw, yaw_of

E, N = 3, 4
RNG = np.random.default_rng


def random_estimate(rng):
    group = Constellation(nodes=tuple(NodeConfig(id=k) for k in range(N)), dimensions=2)
    pairs = group.n_pairs
    root = rng.normal(0.0, 0.4, (E, pairs, 6, 6))
    estimate = TeamEstimate.empty(group, rng.uniform(3.0, 4.0, E))
    changed = {
        "pos_ij_w": rng.normal(0.0, 3.0, (E, pairs, 3)),
        "vel_ij_w": rng.normal(0.0, 1.0, (E, pairs, 3)),
        "cov": root @ np.swapaxes(root, -1, -2),
        "q_wb": quat_from_yaw(rng.uniform(-3.0, 3.0, (E, N))),
        "has_orientation": rng.random((E, N)) < 0.8,
        "age": rng.uniform(0.0, 2.0, (E, pairs)),
        "nlos_prob": rng.random((E, pairs)),
        "status": rng.integers(0, len(Status), (E, pairs)),
    }
    for name, value in changed.items():
        getattr(estimate, name)[...] = value
    return estimate


def random_view(seed, far=1.0):
    """Return a view with an estimate in it, and the estimate; the rest is random."""
    rng = RNG(seed)
    view, estimate = make_view(E, N), random_estimate(rng)
    estimate.pos_ij_w[...] *= far
    view.now[:] = estimate.t + rng.uniform(0.05, 0.2, E)
    powered = rng.random((E, N)) < 0.8
    turns = rng.uniform(-0.3, 0.3, (E, N))
    bind_view(view, estimate, powered, turns)()
    view.present[:] = rng.random((E, N)) < 0.8
    view.has_target[:] = rng.random(view.has_target.shape) < 0.6
    view.target[:] = far * rng.normal(0.0, 2.0, view.target.shape)
    view.command[:] = far * rng.normal(0.0, 1.0, view.command.shape)
    view.speed[:] = far * rng.normal(0.0, 1.0, view.speed.shape)
    view.steering[:] = rng.uniform(-0.4, 0.4, view.steering.shape)
    view.distance[:] = far * rng.uniform(-0.2, 9.0, view.distance.shape)
    view.t_last_range[:] = view.now[:, None, None] - rng.uniform(0.0, 15.0, view.t_last_range.shape)
    view.gap[:] = far * rng.normal(8.0, 4.0, view.gap.shape)
    for k in range(N):
        view.has_target[:, k, k] = False
    return view, estimate, powered, turns


def test_a_view_is_the_estimate_carried_to_now():
    view, estimate, powered, turns = random_view(1)
    now = estimate.at(view.now)
    for e in range(E):
        for p, (i, j) in enumerate(estimate.constellation.pairs):
            for a, b, sign in ((i, j, 1.0), (j, i, -1.0)):
                on = powered[e, a]
                status = now.status[e, p] if on else Status.ABSENT
                assert view.status[e, a, b] == status
                assert view.ok[e, a, b] == (status == Status.OK)
                expected = {
                    "pos": sign * now.pos_ij_w[e, p, :2],
                    "vel": sign * now.vel_ij_w[e, p, :2],
                    "cov": now.cov[e, p][[0, 1, 0], [0, 1, 1]],
                    "age": now.age[e, p],
                    "nlos": now.nlos_prob[e, p],
                }
                for name, value in expected.items():
                    seen = getattr(view, name)[e, a, b]
                    np.testing.assert_allclose(seen, on * value, atol=1e-12, err_msg=name)
    known = estimate.has_orientation & powered
    assert np.array_equal(view.oriented, known)
    np.testing.assert_allclose(view.heading, known * (yaw_of(estimate.q_wb) + turns), atol=1e-12)


def turned(view, e, a, vector):
    c, s = np.cos(view.heading[e, a]), np.sin(view.heading[e, a])
    return np.array([[c, s], [-s, c]]) @ vector


def twin(name, view, e, a):
    """Return the observation of a car as documented: field to numbers."""
    others = [b for b in range(N) if b != a]
    ok = view.ok[e, a, others].astype(float)
    age = view.now[e] - view.t_last_range[e, a, others]
    fresh = (age <= 10.0).astype(float)
    c, s = np.cos(view.heading[e, a]), np.sin(view.heading[e, a])
    std = []
    for b in others:
        xx, yy, xy = view.cov[e, a, b]
        turn = np.array([[c, s], [-s, c]])
        cov = turn @ np.array([[xx, xy], [xy, yy]]) @ turn.T
        ahead, left = np.sqrt(np.diag(cov))
        std += [ahead, left, cov[0, 1] / (ahead * left) if ahead * left > 0 else 0.0]
    ranges = name == "ranges"
    return {
        "mask": fresh if ranges else ok,
        "pos": [k * turned(view, e, a, view.pos[e, a, b]) for k, b in zip(ok, others, strict=True)],
        "vel": [k * turned(view, e, a, view.vel[e, a, b]) for k, b in zip(ok, others, strict=True)],
        "std": np.repeat(ok, 3) * std,
        "age": fresh * age if ranges else view.age[e, a, others],
        "nlos": view.nlos[e, a, others],
        "status": np.eye(6)[view.status[e, a, others]],
        "range": fresh * view.distance[e, a, others],
        "gap": fresh * view.gap[e, a, others],
        "has_target": view.has_target[e, a, others],
        "target": [
            view.has_target[e, a, b] * turned(view, e, a, view.target[e, a, b]) for b in others
        ],
        "command": turned(view, e, a, view.command[e, a]),
        "heading": view.oriented[e, a] * np.array([c, s]),
        "motion": [view.speed[e, a], view.steering[e, a]],
    }


def truth_in(view, seed=5):
    rng = RNG(seed)
    pos, vel = (rng.normal(0.0, 2.0, (E, N, 2)) for _ in range(2))
    reveal(view, pos, vel, rng.uniform(-3.0, 3.0, (E, N)))


@pytest.mark.parametrize("far", [1.0, 50.0])
@pytest.mark.parametrize("name", OBSERVATIONS)
def test_observations_are_what_the_fields_say(name, far):
    view, *_ = random_view(2, far)
    mode = observation_mode(name, N)
    if mode.needs_truth:
        truth_in(view)
    out = np.full((E, N, total_size(mode.fields)), np.nan, np.float32)
    mode.bind(view, out)()
    space = space_of(mode.fields)
    table = index_table(mode.fields)
    for e in range(E):
        for a in range(N):
            assert space.contains(out[e, a])
            if not view.present[e, a]:
                assert not out[e, a].any()
                continue
            has_target = twin(name, view, e, a)
            for field, row in zip(mode.fields, table, strict=True):
                seen = out[e, a, row["first"] : row["last"] + 1]
                value = np.clip(np.ravel(has_target[field.name]), -field.limit, field.limit)
                np.testing.assert_allclose(seen, value, rtol=2e-6, atol=2e-6, err_msg=field.name)


@pytest.mark.parametrize("n_cars", [2, 3, 20])
@pytest.mark.parametrize("name", OBSERVATIONS)
def test_layout(name, n_cars):
    fields = observation_mode(name, n_cars).fields
    table = index_table(fields)
    firsts, lasts = ([row[end] for row in table] for end in ("first", "last"))
    assert firsts == [0, *(last + 1 for last in lasts[:-1])]
    assert lasts[-1] + 1 == total_size(fields)
    assert len({f.name for f in fields}) == len(fields)
    space = space_of(fields, history=3)
    assert space.shape == (3 * total_size(fields),)
    assert space.dtype == np.float32
    for row in table:
        one = slice(row["first"], row["last"] + 1)
        assert (space.high[one] == np.float32(row["high"])).all()
        assert (space.low[one] == np.float32(row["low"])).all()


def test_the_truth_of_absent_cars_is_nobody():
    view, *_ = random_view(3)
    truth_in(view)
    both = view.present[:, :, None] & view.present[:, None, :] & ~np.eye(N, dtype=bool)
    assert np.array_equal(view.ok, both)
    assert np.array_equal(view.oriented, view.present)
    assert not view.pos[~both].any()
    assert not view.cov.any()
