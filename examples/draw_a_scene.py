"""Four cars circle a wall; a picture of the room and of the estimates of one car's tracker.

python examples/draw_a_scene.py [scene.png]
"""

import sys

from agents.controllers import Consensus
from relpos_env import formation_v0
from relpos_env.render import save_snapshot
from relpos_env.render.film import Film

path = sys.argv[1] if len(sys.argv) > 1 else "scene.png"
env = formation_v0.parallel_env(scenario="ring-nlos", n_cars=4, max_cycles=130)
observations, infos = env.reset(seed=3)
controller, film = Consensus(env.fields), Film("rgb_array", fps=10.0)
while env.agents:
    actions = {agent: controller.act(o) for agent, o in observations.items()}
    observations, rewards, terminations, truncations, infos = env.step(actions)
    film.add(env.formation)  # it keeps the errors of the last while for its curves
save_snapshot(film.snapshot(env.formation), path)

picture = film.picture(env.formation)
error = infos["car_0"]["formation_error"]
print(f"{path}: {picture.shape[1]} x {picture.shape[0]}, formation error {error:.2f} m")
