"""A scenario from a file next to this one: desks, a box to push, trackers that lose power."""

from pathlib import Path

import numpy as np

from agents.controllers import Consensus
from relpos_env import formation_v0

room = Path(__file__).with_suffix(".toml")
env = formation_v0.parallel_env(scenario=room, task="ring", max_cycles=300)
observations, infos = env.reset(seed=0)
controller, errors, contacts = Consensus(env.fields), [], 0
while env.agents:
    actions = {agent: controller.act(o) for agent, o in observations.items()}
    observations, rewards, terminations, truncations, infos = env.step(actions)
    errors.append(np.mean([info["formation_error"] for info in infos.values()]))
    contacts += sum(info["collisions"] for info in infos.values())
print(f"{env.scenario.name}: formation error {np.mean(errors[100:]):.2f} m, {contacts} contacts")
