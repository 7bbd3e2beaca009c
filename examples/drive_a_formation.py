"""Three cars keep a ring round a wall, knowing each other through their trackers only."""

from agents.controllers import Consensus
from relpos_env import formation_v0

env = formation_v0.parallel_env(scenario="ring-nlos", observation="estimate", max_cycles=200)
observations, infos = env.reset(seed=0)
controller = Consensus(env.fields)
while env.agents:
    actions = {agent: controller.act(o) for agent, o in observations.items()}
    observations, rewards, terminations, truncations, infos = env.step(actions)
for agent, info in infos.items():
    print(f"{agent}: formation error {info['formation_error']:.2f} m")
