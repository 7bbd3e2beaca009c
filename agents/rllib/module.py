"""The network that all cars share, as RLlib trains it: actor and critic, two layers each.

Observations are scaled by fixed lengths and times inside the network, so what is exported needs no
statistics next to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.apis.value_function_api import ValueFunctionAPI
from ray.rllib.core.rl_module.torch import TorchRLModule
from torch import Tensor, nn

from agents.policies.layout import Layout
from relpos_env.interface.observations.base import F32

SCALES = {"pos": 2.0, "target": 2.0, "range": 2.0, "std": 0.3, "gap": 10.0}
"""Field to the value that becomes 1, in the field's unit; 1 for those not named."""
LIMIT = 5.0
"""[-] Scaled numbers are cut at this."""
FIRST_LOG_STD = -0.7
"""[-] Logarithm of the standard deviation of first actions, which are shares of the largest."""
N_ACTIONS = 2


def gain_of(layout: Layout) -> F32:
    """What every number of an observation is multiplied by, (size)."""
    one = [np.full(f.size, 1.0 / SCALES.get(f.name, 1.0)) for f in layout.fields]
    return np.tile(np.concatenate(one), layout.history).astype(np.float32)


class CarModule(TorchRLModule, ValueFunctionAPI):  # type: ignore[misc]
    """Mean and spread of a car's action, and the value of what it sees.

    `model_config` has ``gain``, a number for each of the observation, and ``width``, units of a
    layer.
    """

    def setup(self) -> None:
        """Lay the layers out."""
        gain = torch.tensor(self.model_config["gain"], dtype=torch.float32)
        self.register_buffer("gain", gain, persistent=False)
        width = self.model_config["width"]
        # First actions are near zero: cars that stand learn sooner than cars that hit walls.
        self.actor = _layers(len(gain), width, N_ACTIONS, first=0.01)
        self.critic = _layers(len(gain), width, 1)
        self.log_std = nn.Parameter(torch.full((N_ACTIONS,), FIRST_LOG_STD))

    def mean(self, observations: Tensor) -> Tensor:
        """The most likely actions, (batch, 2), not cut."""
        actions: Tensor = self.actor(self._scaled(observations))
        return actions

    def _forward(self, batch: Mapping[str, Any], **_: Any) -> dict[str, Any]:
        mean = self.mean(batch[Columns.OBS])
        spread = self.log_std.expand_as(mean)
        return {Columns.ACTION_DIST_INPUTS: torch.cat([mean, spread], dim=-1)}

    def compute_values(self, batch: Mapping[str, Any], embeddings: Any = None) -> Tensor:
        """What return to expect, (batch)."""
        values: Tensor = self.critic(self._scaled(batch[Columns.OBS]))
        return values.squeeze(-1)

    def _scaled(self, observations: Tensor) -> Tensor:
        scaled: Tensor = (observations * self.gain).clamp(-LIMIT, LIMIT)
        return scaled


def _layers(size: int, width: int, out: int, first: float = 1.0) -> nn.Sequential:
    """Two layers and what comes out, which is small at first by a factor."""
    last = nn.Linear(width, out)
    with torch.no_grad():
        last.weight.mul_(first)
        last.bias.zero_()
    return nn.Sequential(
        nn.Linear(size, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh(), last
    )
