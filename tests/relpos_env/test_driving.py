"""Driving on estimates: observations stay in their space, and the formation is kept."""

import numpy as np
import pytest
from runs import busy, commands

from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.formation_v0 import parallel_env
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations import OBSERVATIONS, index_table
from relpos_env.tasks import TASKS


class Follower:
    """A driver that follows the operator's command, and moves to its place among the others."""

    def __init__(self, fields):
        rows = index_table(fields)
        self._at = {row["name"]: slice(row["first"], row["last"] + 1) for row in rows}

    def act(self, seen, blind=False):
        part = {name: seen[at] for name, at in self._at.items()}
        ok = part["mask"] * part["has_target"] * (not blind)
        off = (part["pos"] - part["target"]).reshape(-1, 2)
        trim = ok @ off / max(ok.sum(), 1.0)
        ahead, left = part["command"] + 0.8 * np.clip(trim, -1.0, 1.0)
        steering = 1.2 * np.arctan2(left, max(ahead, 0.3))
        return np.clip([ahead / MAX_SPEED, steering / MAX_STEERING], -1.0, 1.0)


@pytest.mark.parametrize("kwargs", [{"scenario": busy()}, {"scenario": "hall", "level": 4}])
@pytest.mark.parametrize("observation", OBSERVATIONS)
def test_observations_stay_inside_their_space(observation, kwargs):
    env = parallel_env(observation=observation, history=2, max_cycles=80, **kwargs)
    rng = np.random.default_rng(0)
    for seed in range(3):
        observations, _ = env.reset(seed=seed)
        while env.agents:
            for agent, seen in observations.items():
                assert env.observation_space(agent).contains(seen)
            actions = {a: commands(env.action_space(a), rng) for a in env.agents}
            observations, *_ = env.step(actions)


@pytest.mark.parametrize("task", TASKS)
def test_a_controller_drives_every_task_with_finite_rewards(task):
    env = parallel_env(task=task, max_cycles=100)
    observations, _ = env.reset(seed=1)
    controller = Follower(env.fields)
    while env.agents:
        actions = {a: controller.act(o) for a, o in observations.items()}
        observations, rewards, *_, infos = env.step(actions)
        for agent, info in infos.items():
            assert np.isfinite(rewards[agent])
            parts = [info[f"reward_{term}"] for term in env.formation.task.terms]
            assert rewards[agent] == pytest.approx(sum(parts))


def formation_error(observation, seed, blind=False):
    env = parallel_env(observation=observation, max_cycles=400)
    observations, _ = env.reset(seed=seed)
    controller = Follower(env.fields)
    trace = []
    while env.agents:
        actions = {a: controller.act(o, blind) for a, o in observations.items()}
        observations, _, _, _, infos = env.step(actions)
        trace.append(np.mean([info["formation_error"] for info in infos.values()]))
    return np.mean(trace[150:])


def test_the_formation_is_kept_on_estimates():
    """The error is below that of the operator's command alone, which an oracle beats by far."""
    seeds = range(2)
    truth = np.mean([formation_error("truth", s) for s in seeds])
    estimate = np.mean([formation_error("estimate", s) for s in seeds])
    blind = np.mean([formation_error("estimate", s, blind=True) for s in seeds])
    assert truth < 0.2
    assert estimate < 0.35
    assert blind > 2.0 * estimate


@pytest.mark.parametrize("n_cars", [4, 6])
def test_a_group_that_stands_at_first_is_found_right(n_cars):
    """All rotations are possible until a car moves: no car is OK and wrong by a metre."""
    formation = EnvCore(configure({"scenario": "ring-nlos", "n_cars": n_cars}), 8)
    for env in range(8):
        formation.seed(env, np.random.default_rng(env))
        formation.begin([env])
    for _ in range(40):
        command, heading = formation.operator.command, formation.state.heading
        ahead = np.cos(heading) * command[..., 0] + np.sin(heading) * command[..., 1]
        left = np.cos(heading) * command[..., 1] - np.sin(heading) * command[..., 0]
        turn = np.arctan(np.clip(np.arctan2(left, ahead), -1.0, 1.0))
        formation.step(np.hypot(ahead, left), np.clip(turn, -0.4, 0.4))
        wrong = formation.tracking_error() > 1.0
        assert not wrong.any()
    assert formation.loop.view.ok.any(axis=(1, 2)).all()
