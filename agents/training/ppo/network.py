"""Networks of a policy that all cars share, for any number of other cars.

A shared encoder is applied to every other car; the mean over the valid ones is concatenated with
the car's own features (deep sets [1]), so the output does not depend on the order of the others
or on absent ones. Observations are scaled by constants inside the network: exported networks need
no separate statistics.

References:
    [1] Zaheer et al., Deep sets, NeurIPS 30 (2017).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn

from agents.training.ppo.hyperbolic import Tanh
from relpos_env.interface.observations import Field
from relpos_env.interface.observations.base import F32
from tracking.arrays import I64

SCALES = {
    "pos": 2.0, "vel": 1.0, "std": 0.3, "age": 1.0, "target": 2.0, "range": 2.0, "gap": 10.0,
    "command": 1.0, "motion": 1.0, "near": 1.0,
}  # fmt: skip
"""Scale by observation field: the value that becomes 1, in the field's unit; 1 by default."""
CLOSE = 0.5
"""[m] Distance sensors have a second feature, from 0 at this reading to 1 at contact."""
ERROR_SCALE = 0.2
"""[m] Distance of a car from its target that becomes 1."""
LIMIT = 5.0
"""[-] Scaled numbers are clipped to this absolute value."""


class SwarmFeatures(BaseFeaturesExtractor):  # type: ignore[misc]
    """Features of an observation, invariant to the order of the other cars."""

    def __init__(
        self,
        observation_space: spaces.Box,
        *,
        fields: tuple[Field, ...],
        history: int,
        n_state: int,
        width: int,
        depth: int,
    ) -> None:
        """Build the network.

        Args:
            observation_space: Observations of one car, optionally with ground truth appended.
            fields: Fields of one observation.
            history: Number of stacked observations.
            n_state: Numbers of ground truth after the observation that are inputs, for critics.
            width: Units of each layer.
            depth: Layers of the encoder of the other cars.
        """
        super().__init__(observation_space, features_dim=2 * width + 1)
        where = _Where(fields, history)
        self._n_others, self._n_seen = len(where.others), where.size + n_state
        own = np.concatenate([where.own, where.size + np.arange(n_state)])
        gain = np.concatenate([where.gain, np.ones(n_state, np.float32)])
        self._keep("gain", gain)
        self._keep("others", where.others.ravel())
        self._keep("own", own)
        self._keep("mask", where.newest["mask"])
        self._keep("has_target", where.newest["has_target"])
        self._has_places, self._has_rangefinders = where.places is not None, where.near is not None
        self.skips_absent = True
        """True if other cars with zero weight are skipped, which only affects the run time."""
        if where.near is not None:
            self._keep("near", where.near)
        width_in = where.others.shape[1]
        if where.places is not None:
            for name, index in where.places.items():
                self._keep(name, index.ravel())
            width_in += where.places["place_pos"].shape[1]
        layers: list[nn.Module] = []
        for k in range(depth):
            layers += [nn.Linear(width if k else width_in, width), Tanh()]
        self.of_other = nn.Sequential(*layers)
        n_own = len(own) + (0 if where.near is None else len(where.near))
        self.of_own = nn.Sequential(nn.Linear(n_own, width), Tanh())

    def forward(self, observations: Tensor) -> Tensor:
        """Return the features, (batch, feature)."""
        seen = observations[:, : self._n_seen]
        scaled = (seen * self._gain).clamp(-LIMIT, LIMIT)
        others = self._by_other(scaled.index_select(1, self._others))
        if self._has_places:
            off = seen.index_select(1, self._place_pos) - seen.index_select(1, self._place_target)
            known = seen.index_select(1, self._place_mask)
            both = known * seen.index_select(1, self._place_has_target) / ERROR_SCALE
            error = self._by_other((off * both).clamp(-LIMIT, LIMIT))
            others = torch.cat([others, error], dim=-1)
        known, has_target = seen.index_select(1, self._mask), seen.index_select(1, self._has_target)
        weight = (known + has_target).clamp(max=1.0)
        count = weight.sum(dim=1, keepdim=True)
        mean = self._sum_of(others, weight) / count.clamp(min=1.0)
        own = scaled.index_select(1, self._own)
        if self._has_rangefinders:
            near = seen.index_select(1, self._near)
            own = torch.cat([own, (1.0 - near / CLOSE).clamp(0.0, 1.0)], dim=-1)
        return torch.cat([mean, self.of_own(own), 0.2 * count], dim=-1)

    def _sum_of(self, others: Tensor, weight: Tensor) -> Tensor:
        """Return the weighted sum of the encoded other cars, (batch, width)."""
        if torch.compiler.is_exporting() or not self.skips_absent:
            total: Tensor = (self.of_other(others) * weight[:, :, None]).sum(dim=1)
            return total
        # Absent cars cost nothing; there are many in environments with fewer cars than slots.
        counts = weight.flatten().nonzero().squeeze(1)
        made = self.of_other(others.flatten(0, 1).index_select(0, counts))
        made = made * weight.reshape(-1, 1).index_select(0, counts)
        total = made.new_zeros(len(weight), made.shape[1])
        return total.index_add_(0, counts // self._n_others, made)

    def _by_other(self, flat: Tensor) -> Tensor:
        return flat.reshape(-1, self._n_others, flat.shape[1] // self._n_others)

    def _keep(self, name: str, array: I64 | F32) -> None:
        """Register a constant of the layout as a buffer that is not saved with the weights."""
        self.register_buffer(f"_{name}", torch.from_numpy(array), persistent=False)


class SwarmPolicy(ActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic with separate features; a central critic also observes ground truth."""

    def __init__(
        self, *args: Any, features: dict[str, Any], n_state: int = 0, **kwargs: Any
    ) -> None:
        """Build the actor and the critic.

        Args:
            args: As for `ActorCriticPolicy`.
            features: Arguments of `SwarmFeatures`.
            n_state: Numbers of ground truth after every observation, for the critic only.
            kwargs: As for `ActorCriticPolicy`.
        """
        self._features, self._n_state, self._made = features, n_state, 0
        super().__init__(
            *args,
            features_extractor_class=SwarmFeatures,
            share_features_extractor=False,
            **kwargs,
        )

    def make_features_extractor(self) -> SwarmFeatures:
        """Return the features of the actor at the first call, of the critic at the second."""
        n_state = self._n_state if self._made else 0
        self._made += 1
        return SwarmFeatures(self.observation_space, n_state=n_state, **self._features)


class Actor(nn.Module):
    """Deterministic actor: observations to the most likely actions, within their limits."""

    def __init__(self, policy: SwarmPolicy) -> None:
        super().__init__()
        self._features = policy.pi_features_extractor
        self._layers = policy.mlp_extractor.policy_net
        self._action = policy.action_net

    def forward(self, observations: Tensor) -> Tensor:
        """Return speed and steering as shares of their largest values, (batch, 2)."""
        actions: Tensor = self._action(self._layers(self._features(observations)))
        return actions.clamp(-1.0, 1.0)


class _Where:
    """Indices of the fields in an observation with its history."""

    def __init__(self, fields: Sequence[Field], history: int) -> None:
        n_others = next(f.size for f in fields if f.name == "mask")
        one = sum(f.size for f in fields)
        indices: dict[str, I64] = {}
        first = 0
        for f in fields:
            # (history, other or 1, number)
            index = first + np.arange(f.size) + one * np.arange(history)[:, None]
            indices[f.name] = index.reshape(history, n_others if f.per_other else 1, -1)
            first += f.size
        self.size = one * history
        self.others = _join([indices[f.name] for f in fields if f.per_other])
        self.own = _join([indices[f.name] for f in fields if not f.per_other])[0]
        self.near = indices["near"].ravel() if "near" in indices else None
        # A car is valid if its newest observation has a position or a target.
        self.newest = {n: np.ascontiguousarray(indices[n][0, :, 0]) for n in ("mask", "has_target")}
        self.gain = np.ones(self.size, np.float32)
        for f in fields:
            self.gain[indices[f.name].ravel()] = 1.0 / SCALES.get(f.name, 1.0)
        self.places: dict[str, I64] | None = None
        if "pos" in indices:
            # For each coordinate of each observation: position, target and their masks.
            twice = {n: np.repeat(indices[n], 2, axis=-1) for n in ("mask", "has_target")}
            named = {"pos": indices["pos"], "target": indices["target"], **twice}
            self.places = {f"place_{n}": _join([index]) for n, index in named.items()}


def _join(parts: Sequence[I64]) -> I64:
    """Concatenate index arrays (history, other, number) to (other, history x number)."""
    joined = np.concatenate(parts, axis=-1)
    return np.ascontiguousarray(np.moveaxis(joined, 0, 1).reshape(joined.shape[1], -1))
