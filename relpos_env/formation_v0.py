"""Formation driving on estimated relative positions: ``formation_v0.parallel_env()``."""

from relpos_env.parallel_env import FormationEnv

parallel_env = FormationEnv

__all__ = ["parallel_env"]
