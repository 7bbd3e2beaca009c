"""Learning about a car that leaves: the value of its zero observations has no effect."""

import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3.common.buffers import RolloutBuffer

from agents.training.ppo.buffer import SwarmRolloutBuffer

STEPS, SLOTS = 12, 3
SPACE = Box(-np.inf, np.inf, (2,), np.float32)


def filled(kind, zeros_worth, *, away=(), left=None):
    """Return a buffer in which agent slot 0 is away for some steps, or gone after one.

    Args:
        kind: Class of the buffer.
        zeros_worth: Value that the critic gives zero observations.
        away: Steps in which the car of slot 0 is away.
        left: Step in which it leaves.
    """
    rng = np.random.default_rng(3)
    buffer = kind(STEPS, SPACE, SPACE, device="cpu", gae_lambda=0.95, gamma=0.99, n_envs=SLOTS)
    starts = np.zeros(SLOTS)
    for step in range(STEPS):
        obs = rng.standard_normal((SLOTS, 2)).astype(np.float32)
        value, reward = torch.tensor(rng.standard_normal(SLOTS)), rng.standard_normal(SLOTS)
        gone = step in away or (left is not None and step > left)
        if gone:
            obs[0], value[0], reward[0] = 0.0, zeros_worth, 0.0
        if step == left:
            reward[0] += 0.99 * zeros_worth  # what Stable-Baselines3 adds at the end
        action = rng.standard_normal((SLOTS, 2))
        buffer.add(obs, action, reward, starts, value, torch.zeros(SLOTS))
        starts = np.array([float(step == left), 0.0, 0.0])
    last = torch.tensor([[zeros_worth if gone else 0.3], [0.4], [0.5]])
    buffer.compute_returns_and_advantage(last, np.zeros(SLOTS))
    return buffer


@pytest.mark.parametrize("case", [{"away": range(5, 9)}, {"left": 6}])
def test_what_nothing_is_worth_does_not_matter(case):
    low, high = (filled(SwarmRolloutBuffer, worth, **case) for worth in (-1000.0, 1000.0))
    present = low.observations.any(axis=2)
    np.testing.assert_array_equal(low.advantages[present], high.advantages[present])
    np.testing.assert_array_equal(low.returns[present], high.returns[present])
    last = np.flatnonzero(~present[:, 0])[0] - 1
    assert low.advantages[last, 0] == 0.0
    # With the buffer of Stable-Baselines3 it has an effect.
    low, high = (filled(RolloutBuffer, worth, **case) for worth in (-1000.0, 1000.0))
    assert np.abs(low.advantages - high.advantages)[present].max() > 100.0


def test_where_nobody_goes_it_is_the_librarys():
    ours, theirs = filled(SwarmRolloutBuffer, 0.0), filled(RolloutBuffer, 0.0)
    np.testing.assert_allclose(ours.advantages, theirs.advantages, atol=1e-6)
    np.testing.assert_allclose(ours.returns, theirs.returns, atol=1e-6)
