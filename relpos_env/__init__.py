"""A simulated world of RC cars with real estimators in the loop, as standard environments.

``relpos_env.formation_v0.parallel_env()`` is the PettingZoo environment; `relpos_env.sim` is
the simulation without any environment interface around it.
"""
