"""A square room in which cars keep a ring round a wall that hides them from each other."""

from dataclasses import replace

from relpos_env.scenarios.base import Scenario
from relpos_env.world import Obstacle

RING_LOS = Scenario(name="ring-los", room=(5.0, 5.0), ring=(1.4, 1.4))
RING_NLOS = replace(
    RING_LOS, name="ring-nlos", obstacles=(Obstacle(x=0.0, y=0.0, width=1.45, height=0.2),)
)
