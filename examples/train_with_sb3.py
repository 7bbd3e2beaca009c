"""A few hundred steps of PPO on one policy that all cars share.

Needs Stable-Baselines3: ``pip install "relpos-env[train]"``.
"""

import numpy as np
from stable_baselines3 import PPO

from relpos_env.api.sb3_vec_env import FormationVecEnv

envs = FormationVecEnv(n_envs=4, observation="estimate_cov", max_cycles=100)
model = PPO("MlpPolicy", envs, n_steps=32, batch_size=64, n_epochs=2, seed=0, device="cpu")
model.learn(total_timesteps=768)  # a useful policy takes some hundred thousand

envs.seed(1)
observations, rewards = envs.reset(), []
for _ in range(50):
    actions, _ = model.predict(observations, deterministic=True)
    observations, reward, dones, infos = envs.step(actions)
    rewards.append(reward)
print(
    f"{envs.num_envs} agent slots, {model.num_timesteps} steps, mean reward {np.mean(rewards):.2f}"
)
envs.close()
