"""The scenarios of the paper's room, which the evaluation changes in many ways."""

from relpos_env.scenarios.catalogue import shipped

CARS_LOS = shipped("cars-los")
CARS_NLOS = shipped("cars-nlos")
