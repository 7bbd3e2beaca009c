"""Policies observe no truth: their input comes from sensors, radio and tracker."""

import numpy as np
import pytest
from runs import busy

from relpos_env.formation_v0 import parallel_env
from relpos_env.interface.observations import OBSERVATIONS, observation_mode


def move_everything(formation):
    """Move all bodies of the world without the sensors' knowledge."""
    state, task = formation.state, formation.task
    rng = np.random.default_rng(0)
    truths = (state.pos_w, state.vel_w, state.accel_w, state.heading, state.yaw_rate)
    for truth in (
        *truths,
        state.steering,
        state.clearance,
        task.error,
        task.rewards,
        task.goal_w,
        task.plan,
    ):
        truth += rng.uniform(0.3, 0.7, truth.shape)
    formation.loop.swarm.boxes[..., :2] += 0.5
    formation.loop.swarm.contacts[:] += 1.0


@pytest.mark.parametrize(
    "kwargs",
    [{}, {"scenario": busy(), "task": "hold"}, {"task": "follow"}, {"proximity": 8}],
)
@pytest.mark.parametrize("name", OBSERVATIONS)
def test_a_policy_sees_no_truth(name, kwargs):
    env = parallel_env(observation=name, max_cycles=80, **kwargs)
    env.reset(seed=0)
    for _ in range(75):
        env.step({a: np.array([0.4, 0.5], np.float32) for a in env.agents})
    formation = env.formation
    everything = slice(0, 1)
    before = formation.observations.copy()
    formation._observe(everything)
    assert formation.observations.tobytes() == before.tobytes()
    assert before.any()
    move_everything(formation)
    formation._observe(everything)
    changed = not np.array_equal(formation.observations, before)
    assert changed == observation_mode(name, 3).needs_truth


@pytest.mark.parametrize("name", [n for n in OBSERVATIONS if n != "truth"])
def test_before_the_first_ranges_nobody_is_seen(name):
    env = parallel_env(observation=name, max_cycles=5)
    assert not observation_mode(name, 3).needs_truth
    env.reset(seed=0)
    view = env.loop.view
    for array in (view.ok, view.status, view.distance, view.pos):
        array[:] = 0
    view.t_last_range[:] = -np.inf
    env.formation._observe(slice(0, 1))
    n_masked = env.fields[0].size
    assert env.fields[0].name == "mask"
    assert not env.formation.observations[..., :n_masked].any()


def test_the_truth_is_the_truth():
    env = parallel_env(observation="truth", max_cycles=40)
    observations, _ = env.reset(seed=2)
    for _ in range(30):
        observations, *_ = env.step({a: np.array([0.4, 0.3], np.float32) for a in env.agents})
    state = env.formation.state
    for i, seen in enumerate(observations.values()):
        c, s = np.cos(state.heading[0, i]), np.sin(state.heading[0, i])
        others = [j for j in range(3) if j != i]
        away = state.pos_w[0, others] - state.pos_w[0, i]
        moving = state.vel_w[0, others] - state.vel_w[0, i]
        turn = np.array([[c, -s], [s, c]])
        assert seen[:2].tolist() == [1.0, 1.0]
        np.testing.assert_allclose(seen[2:6].reshape(2, 2), away @ turn, atol=1e-5)
        np.testing.assert_allclose(seen[6:10].reshape(2, 2), moving @ turn, atol=1e-5)
