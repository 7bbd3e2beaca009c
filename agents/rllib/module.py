"""RLlib module of the network that all cars share: actor and critic, two hidden layers each.

The network scales observations by fixed factors, so the exported policy needs no statistics.
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
"""Scale by field, in the field's unit: the value that becomes 1; the default is 1."""
LIMIT = 5.0
"""[-] Limit of scaled observations."""
FIRST_LOG_STD = -0.7
"""[-] Initial log standard deviation of actions, which are fractions of the largest."""
N_ACTIONS = 2


def gain_of(layout: Layout) -> F32:
    """Return the scale factor of every number of an observation, (size)."""
    one = [np.full(f.size, 1.0 / SCALES.get(f.name, 1.0)) for f in layout.fields]
    return np.tile(np.concatenate(one), layout.history).astype(np.float32)


class CarModule(TorchRLModule, ValueFunctionAPI):  # type: ignore[misc]
    """Actor with mean and log standard deviation of actions, and critic.

    `model_config` has ``gain``, the scale factors of observations, and ``width``, the number of
    units per layer.
    """

    def setup(self) -> None:
        """Create the layers."""
        gain = torch.tensor(self.model_config["gain"], dtype=torch.float32)
        self.register_buffer("gain", gain, persistent=False)
        width = self.model_config["width"]
        # Initial actions are near zero: cars at rest learn faster than cars that hit walls.
        self.actor = _layers(len(gain), width, N_ACTIONS, first=0.01)
        self.critic = _layers(len(gain), width, 1)
        self.log_std = nn.Parameter(torch.full((N_ACTIONS,), FIRST_LOG_STD))

    def mean(self, observations: Tensor) -> Tensor:
        """Return the mean actions, (batch, 2), not clipped."""
        actions: Tensor = self.actor(self._scaled(observations))
        return actions

    def _forward(self, batch: Mapping[str, Any], **_: Any) -> dict[str, Any]:
        mean = self.mean(batch[Columns.OBS])
        spread = self.log_std.expand_as(mean)
        return {Columns.ACTION_DIST_INPUTS: torch.cat([mean, spread], dim=-1)}

    def compute_values(self, batch: Mapping[str, Any], embeddings: Any = None) -> Tensor:
        """Return the expected return, (batch)."""
        values: Tensor = self.critic(self._scaled(batch[Columns.OBS]))
        return values.squeeze(-1)

    def _scaled(self, observations: Tensor) -> Tensor:
        scaled: Tensor = (observations * self.gain).clamp(-LIMIT, LIMIT)
        return scaled


def _layers(size: int, width: int, out: int, first: float = 1.0) -> nn.Sequential:
    """Return two hidden layers and an output layer with weights scaled by `first`."""
    last = nn.Linear(width, out)
    with torch.no_grad():
        last.weight.mul_(first)
        last.bias.zero_()
    return nn.Sequential(
        nn.Linear(size, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh(), last
    )
