"""The operator: equal trim for all cars, delay, position error, and limits."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relpos_env.errors import EnvError
from relpos_env.sensors.operator import CONTROL_STEP, Operator, OperatorSimParams

ALL = slice(None)
IDEAL = {"reaction": 0.0, "position_std": 0.0, "max_trim": 1e9, "max_speed": 1e9}


@dataclass
class Room:
    """True state and targets."""

    pos_w: np.ndarray
    present: np.ndarray
    plan: np.ndarray
    goal_w: np.ndarray


def room(n_envs=3, n_cars=4, seed=0):
    rng = np.random.default_rng(seed)
    pos, plan, goal = rng.uniform(-2.0, 2.0, (3, n_envs, n_cars, 2))
    present = rng.uniform(size=(n_envs, n_cars)) < 0.8
    present[:, 0] = True
    return Room(pos, present, plan, goal)


def begun(r, seeds=None, **params):
    n_envs, n_cars = r.present.shape
    operator = Operator(OperatorSimParams(**params), n_cars, n_envs)
    operator.reset(np.arange(n_envs, dtype=np.uint64) if seeds is None else seeds, ALL)
    return operator


def twin_trim(r, env, gain):
    p = r.present[env]
    return -gain * (r.pos_w[env, p] - r.goal_w[env, p]).mean(axis=0)


def test_no_gain_is_the_pure_plan():
    r = room()
    command = begun(r, gain=0.0, max_speed=1e9).sample(r, r, ALL)
    assert np.array_equal(command, r.plan * r.present[..., None])


def test_an_ideal_operator_adds_the_same_trim_for_all_who_are_present():
    r = room()
    command = begun(r, gain=0.7, **IDEAL).sample(r, r, ALL)
    for env, present in enumerate(r.present):
        trim = command[env, present] - r.plan[env, present]
        assert np.allclose(trim, twin_trim(r, env, 0.7))
        assert not command[env, ~present].any()


def test_he_reacts_late_and_at_first_to_what_he_saw_first():
    r = room()
    operator = begun(r, gain=1.0, **{**IDEAL, "reaction": 0.3})
    seen = []
    for step in range(9):
        r.pos_w = r.pos_w + np.random.default_rng(step).normal(size=(3, 1, 2))
        seen.append([twin_trim(r, env, 1.0) for env in range(3)])
        command = operator.sample(r, r, ALL)
        trim = np.array([command[env, 0] - r.plan[env, 0] for env in range(3)])
        assert np.allclose(trim, seen[max(step - 3, 0)])


def test_the_group_comes_to_its_goals_and_the_formation_is_left_alone():
    r = room(1, 5, seed=2)
    r.plan[:] = 0.0
    operator = begun(r, gain=0.5, reaction=0.3, position_std=0.0)
    shape = r.pos_w - r.pos_w[:, :1]
    for _ in range(300):
        r.pos_w = r.pos_w + CONTROL_STEP * operator.sample(r, r, ALL) * r.present[..., None]
    p = r.present[0]
    assert np.allclose(r.pos_w[0, p].mean(axis=0), r.goal_w[0, p].mean(axis=0), atol=1e-3)
    assert np.allclose((r.pos_w - r.pos_w[:, :1])[0, p], shape[0, p])


def test_his_error_has_the_stated_spread_and_correlation():
    r = room(200, 2)
    r.pos_w, r.plan = r.goal_w.copy(), np.zeros_like(r.plan)
    operator = begun(r, gain=1.0, **{**IDEAL, "position_std": 0.2}, position_time=2.0)
    errors = np.array([operator.sample(r, r, ALL)[:, 0].copy() for _ in range(60)])
    assert errors[0].std() == pytest.approx(0.2, rel=0.15)
    assert errors.std() == pytest.approx(0.2, rel=0.06)
    lag = round(2.0 / CONTROL_STEP)
    correlation = np.mean(errors[lag:] * errors[:-lag]) / np.mean(errors**2)
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.07)
    assert abs(np.mean(errors[..., 0] * errors[..., 1])) < 0.1 * 0.2**2


def test_an_environment_of_a_batch_is_that_environment_alone_and_seeds_repeat():
    r = room(4)
    seeds = np.array([5, 6, 7, 8], dtype=np.uint64)
    together, again = begun(r, seeds), begun(r, seeds)
    alone = [begun(room(1), seeds[k : k + 1]) for k in range(4)]
    for step in range(6):
        r.pos_w = r.pos_w + 0.1 * step
        command = together.sample(r, r, ALL).copy()
        assert np.array_equal(command, again.sample(r, r, ALL))
        for k, operator in enumerate(alone):
            one = Room(*(a[k : k + 1] for a in (r.pos_w, r.present, r.plan, r.goal_w)))
            assert np.array_equal(operator.sample(one, one, ALL)[0], command[k])
    assert not np.allclose(command[0, 0] - r.plan[0, 0], command[1, 0] - r.plan[1, 0])
    first = begun(r, seeds).sample(r, r, ALL).copy()
    together.reset(seeds[1:3], slice(1, 3))
    after = together.sample(r, r, slice(1, 3))
    assert np.array_equal(after[1:3], first[1:3])
    assert np.array_equal(after[[0, 3]], command[[0, 3]])


@given(
    gain=st.floats(0.0, 1e3),
    reaction=st.floats(0.0, 5.0),
    std=st.floats(0.0, 10.0),
    max_trim=st.floats(0.0, 3.0),
    max_speed=st.floats(0.01, 5.0),
    seed=st.integers(0, 2**63),
)
@settings(max_examples=40)
def test_commands_are_within_their_limits(gain, reaction, std, max_trim, max_speed, seed):
    r = room()
    seeds = np.full(3, seed, dtype=np.uint64)
    operator = begun(
        r, seeds, gain=gain, reaction=reaction, position_std=std,
        max_trim=max_trim, max_speed=max_speed,
    )  # fmt: skip
    for _ in range(4):
        command = operator.sample(r, r, ALL)
        assert np.linalg.norm(command, axis=-1).max() <= max_speed * (1.0 + 1e-9)
        wide = begun(r, seeds, gain=gain, max_trim=max_trim, max_speed=1e9)
        trim = (wide.sample(r, r, ALL) - r.plan) * r.present[..., None]
        assert np.linalg.norm(trim, axis=-1).max() <= max_trim + 1e-6


@pytest.mark.parametrize(
    ("name", "value"),
    [("gain", -1.0), ("reaction", 6.0), ("position_std", np.nan), ("position_time", 0.0),
     ("max_trim", -0.1), ("max_speed", np.inf)],
)  # fmt: skip
def test_bad_params_are_named(name, value):
    with pytest.raises(EnvError, match=f"operator {name}"):
        OperatorSimParams(**{name: value})


def test_some_episodes_have_no_operator_by_their_seeds_alone():
    r = room(400, 2)
    seeds = np.random.default_rng(3).integers(1 << 62, size=400, dtype=np.uint64)
    alone = begun(r, gain=0.0, max_speed=1e9).sample(r, r, ALL)
    both = begun(r, seeds, share=0.3, max_speed=1e9).sample(r, r, ALL)
    always = begun(r, seeds, max_speed=1e9).sample(r, r, ALL)
    trims = (both != alone).any(axis=(1, 2))
    assert 0.22 < trims.mean() < 0.38
    assert np.array_equal(both, np.where(trims[:, None, None], always, alone))
    some = begun(room(5, 2), seeds[:5], share=0.3, max_speed=1e9)
    some.reset(seeds[200:202], slice(2, 4))
    r.present[:5] = True
    few = Room(*(a[:5] for a in vars(r).values()))
    trimmed = (some.sample(few, few, ALL) != few.plan).any(axis=(1, 2))
    assert np.array_equal(trimmed, trims[[0, 1, 200, 201, 4]])
