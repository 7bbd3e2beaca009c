"""A simulated world of RC cars with real estimators in the loop, as standard environments.

Importing this package registers ``relpos_env/Formation-v0`` with Gymnasium and
``relpos_env/formation-v0`` with PettingZoo. `relpos_env.formation_v0.parallel_env` is the
environment of the latter; `relpos_env.simulation.simulation` is the simulation without any
interface around it.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from relpos_env.api.registration import register_environments

register_environments()

_CLASSES = {
    "EnvError": "relpos_env.errors",
    "FormationGymEnv": "relpos_env.api.gym_env",
    "FormationTorchEnv": "relpos_env.api.torchrl_env",
    "FormationVecEnv": "relpos_env.api.sb3_vec_env",
    "FormationVectorEnv": "relpos_env.api.vector_env",
    "Scenario": "relpos_env.scenarios",
    "Simulation": "relpos_env.simulation.simulation",
}
"""Module of each class, imported on first use; those of Stable-Baselines3 and TorchRL need their
extras."""

__all__ = [
    "EnvError", "FormationGymEnv", "FormationVectorEnv", "Scenario", "Simulation", "formation_v0",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "formation_v0":
        return import_module("relpos_env.formation_v0")
    if name not in _CLASSES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_CLASSES[name]), name)
