"""Time constants of the simulated world."""

DT = 0.01
"""[s] Step of the physics, the IMUs and the radios."""
DECISION = 0.1
"""[s] Control period, from one action of a policy to the next."""
STAND_STILL = 2.0
"""[s] Initial rest of cars and people while their trackers are switched on, as for real ones."""
SOON = 1e-9
"""[s] Time by which events are due early, because of rounding errors of times."""
