"""The room of the paper, 3 m x 5 m: RC cars drive about, with and without an obstacle.

From Armani and Holz, ICRA 2024, section III: three cars, constantly moving; in the second
experiment they drive round an obstacle that hides them from each other now and then.
"""

from dataclasses import replace

from relpos_env.scenarios.base import Scenario
from relpos_env.world import Obstacle

CARS_LOS = Scenario(name="cars-los", room=(3.0, 5.0), ring=(0.95, 1.8))
CARS_NLOS = replace(
    CARS_LOS, name="cars-nlos", obstacles=(Obstacle(x=0.0, y=0.0, width=0.5, height=1.2),)
)
