"""A simulated world of RC cars with real estimators in the loop, as standard environments.

Importing this package registers ``relpos_env/Formation-v0`` with Gymnasium and
``relpos_env/formation-v0`` with PettingZoo. `relpos_env.formation_v0.parallel_env` is the
environment of the latter; `relpos_env.simulation.simulation` is the simulation without any
interface around it.
"""

from relpos_env.api.registration import register_environments

register_environments()
