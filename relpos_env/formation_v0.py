"""Formation driving on estimated relative positions, as a PettingZoo environment.

`parallel_env` is the environment itself; `env` is its turn-by-turn (AEC) form with checks of the
order of calls, `raw_env` the AEC form without checks.
"""

from __future__ import annotations

from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils import OrderEnforcingWrapper
from pettingzoo.utils.conversions import parallel_to_aec

from relpos_env.api.parallel_env import FormationEnv

parallel_env = FormationEnv


def raw_env(**arguments: Any) -> AECEnv:
    """Return the turn-by-turn (AEC) form; arguments as for `parallel_env`."""
    return parallel_to_aec(FormationEnv(**arguments))


def env(**arguments: Any) -> AECEnv:
    """Return the AEC form that checks the order of calls; arguments as for `parallel_env`."""
    return OrderEnforcingWrapper(raw_env(**arguments))


__all__ = ["env", "parallel_env", "raw_env"]
