"""Formation driving on estimated relative positions, as a PettingZoo environment.

`parallel_env` is the environment itself; `env` is its turn-by-turn (AEC) form with the usual
checks around it, `raw_env` the same without them.
"""

from __future__ import annotations

from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils import OrderEnforcingWrapper
from pettingzoo.utils.conversions import parallel_to_aec

from relpos_env.api.parallel_env import FormationEnv

parallel_env = FormationEnv


def raw_env(**arguments: Any) -> AECEnv:
    """The turn-by-turn form; arguments as for `parallel_env`."""
    return parallel_to_aec(FormationEnv(**arguments))


def env(**arguments: Any) -> AECEnv:
    """The turn-by-turn form that refuses calls in the wrong order; arguments likewise."""
    return OrderEnforcingWrapper(raw_env(**arguments))


__all__ = ["env", "parallel_env", "raw_env"]
