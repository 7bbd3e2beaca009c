"""The clock of the simulated world."""

DT = 0.01
"""[s] One step of the physics, of the IMUs, and of the air."""
DECISION = 0.1
"""[s] From one action of a policy to the next."""
STAND_STILL = 2.0
"""[s] Cars and people stand while their trackers are switched on, as real ones do."""
SOON = 1e-9
"""[s] What happens to cars is due that much earlier, for the roundings of times."""
