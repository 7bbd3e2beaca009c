"""Registration of the environments in Gymnasium and PettingZoo."""

from __future__ import annotations

import gymnasium
import pettingzoo


def register_environments() -> None:
    """Register all environments; repeated calls have no effect."""
    if "relpos_env/Formation-v0" in gymnasium.registry:
        return
    gymnasium.register(
        "relpos_env/Formation-v0",
        entry_point="relpos_env.api.gym_env:FormationGymEnv",
        vector_entry_point="relpos_env.api.vector_env:FormationVectorEnv",
    )
    # Versions of PettingZoo before 1.27 have no registry and use `formation_v0` directly.
    if not hasattr(pettingzoo, "register"):
        return
    module = "relpos_env.formation_v0"
    pettingzoo.register("parallel", "relpos_env/formation-v0", f"{module}:parallel_env")
    pettingzoo.register("aec", "relpos_env/formation-v0", f"{module}:env")
