"""Scenarios of the paper's room, the basis of the variants in the evaluation."""

from relpos_env.scenarios.catalogue import shipped

CARS_LOS = shipped("cars-los")
CARS_NLOS = shipped("cars-nlos")
