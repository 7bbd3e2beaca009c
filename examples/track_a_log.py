"""Track a log folder, the first argument, or a short simulated drive; look at the result."""

import sys

from agents.evaluation.track import track_log
from agents.simulation.simulate import simulate
from tracking.log import read_log

log = read_log(sys.argv[1]) if sys.argv[1:] else simulate(scenario="cars-los", seconds=30, seed=1)
result = track_log(log)
print(f"{log.n_ranges} ranges between {log.constellation.n_nodes} cars")
print(f"shape error {result.score.rmse_shape:.2f} m, world error {result.score.rmse:.2f} m")
pos, vel = result.estimate.between(0, 1)
print(f"at the end car 2 is {pos[-1, 0]:.2f} m east and {pos[-1, 1]:.2f} m north of car 1")
