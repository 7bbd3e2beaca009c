"""Sixteen rooms at once as one Gymnasium vector environment, in compiled code."""

import time

import gymnasium
import numpy as np

import relpos_env  # noqa: F401  its environments are registered by this

envs = gymnasium.make_vec("relpos_env/Formation-v0", num_envs=16, level=2, max_cycles=100)
observations, infos = envs.reset(seed=0)
envs.action_space.seed(0)
envs.step(envs.action_space.sample())  # the first step compiles
began, episodes, n_steps = time.perf_counter(), 0, 200
for _ in range(n_steps):
    actions = envs.action_space.sample()
    observations, rewards, terminations, truncations, infos = envs.step(actions)
    episodes += int(np.sum(terminations | truncations))  # the next one has begun already
rate = n_steps * envs.num_envs / (time.perf_counter() - began)
print(
    f"observations {observations.shape}, {episodes} episodes, {rate:.0f} steps a second with resets"
)
envs.close()
