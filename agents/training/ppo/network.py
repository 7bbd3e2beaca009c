"""The networks of a policy that all cars share, for any number of others.

Every other car goes through the same small network, the mean over those that count is joined
with what the car knows of itself (deep sets [1]), so the order of the others does not matter and
absent ones leave no trace. Observations are scaled by fixed lengths and times, in the network:
what is exported needs no statistics next to it.

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
"""Field to the value that becomes 1, in the field's unit; 1 for those not named."""
CLOSE = 0.5
"""[m] What a beam sees nearer than this has a feature of its own, which is 1 at a touch."""
ERROR_SCALE = 0.2
"""[m] Distance from a place that becomes 1."""
LIMIT = 5.0
"""[-] Scaled numbers are cut at this."""


class SwarmFeatures(BaseFeaturesExtractor):  # type: ignore[misc]
    """What a car sees, as features that do not depend on the order of the others."""

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
        """Lay the network out.

        Args:
            observation_space: Of one car; `n_state` numbers of the truth may follow.
            fields: Stretches of one observation.
            history: So many observations in one.
            n_state: Numbers behind the observation that are seen as well; for critics.
            width: Units of each layer.
            depth: Layers for each of the others.
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
        self._keep("wanted", where.newest["wanted"])
        self._has_places, self._has_beams = where.places is not None, where.near is not None
        self.skips_absent = True
        """Whether others that do not count are left out, which changes nothing but the time."""
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
        """Features, (batch, feature)."""
        seen = observations[:, : self._n_seen]
        scaled = (seen * self._gain).clamp(-LIMIT, LIMIT)
        others = self._by_other(scaled.index_select(1, self._others))
        if self._has_places:
            off = seen.index_select(1, self._place_pos) - seen.index_select(1, self._place_target)
            known = seen.index_select(1, self._place_mask)
            both = known * seen.index_select(1, self._place_wanted) / ERROR_SCALE
            error = self._by_other((off * both).clamp(-LIMIT, LIMIT))
            others = torch.cat([others, error], dim=-1)
        known, wanted = seen.index_select(1, self._mask), seen.index_select(1, self._wanted)
        weight = (known + wanted).clamp(max=1.0)
        count = weight.sum(dim=1, keepdim=True)
        mean = self._sum_of(others, weight) / count.clamp(min=1.0)
        own = scaled.index_select(1, self._own)
        if self._has_beams:
            near = seen.index_select(1, self._near)
            own = torch.cat([own, (1.0 - near / CLOSE).clamp(0.0, 1.0)], dim=-1)
        return torch.cat([mean, self.of_own(own), 0.2 * count], dim=-1)

    def _sum_of(self, others: Tensor, weight: Tensor) -> Tensor:
        """Sum over the others, by their weights, of what the small network makes of each."""
        if torch.compiler.is_exporting() or not self.skips_absent:
            total: Tensor = (self.of_other(others) * weight[:, :, None]).sum(dim=1)
            return total
        # In rooms with fewer cars than slots, many of the others are absent: they cost nothing.
        counts = weight.flatten().nonzero().squeeze(1)
        made = self.of_other(others.flatten(0, 1).index_select(0, counts))
        made = made * weight.reshape(-1, 1).index_select(0, counts)
        total = made.new_zeros(len(weight), made.shape[1])
        return total.index_add_(0, counts // self._n_others, made)

    def _by_other(self, flat: Tensor) -> Tensor:
        return flat.reshape(-1, self._n_others, flat.shape[1] // self._n_others)

    def _keep(self, name: str, array: I64 | F32) -> None:
        """Constants of the layout, which are not among the weights."""
        self.register_buffer(f"_{name}", torch.from_numpy(array), persistent=False)


class SwarmPolicy(ActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic with features of their own; a central critic sees the truth as well."""

    def __init__(
        self, *args: Any, features: dict[str, Any], n_state: int = 0, **kwargs: Any
    ) -> None:
        """Build both.

        Args:
            args: As for `ActorCriticPolicy`.
            features: Arguments of `SwarmFeatures`.
            n_state: So many numbers of the truth follow every observation, for the critic alone.
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
        """The actor's at the first call, the critic's at the second."""
        n_state = self._n_state if self._made else 0
        self._made += 1
        return SwarmFeatures(self.observation_space, n_state=n_state, **self._features)


class Actor(nn.Module):
    """What drives a car, alone: observations to the most likely actions, within their limits."""

    def __init__(self, policy: SwarmPolicy) -> None:
        super().__init__()
        self._features = policy.pi_features_extractor
        self._layers = policy.mlp_extractor.policy_net
        self._action = policy.action_net

    def forward(self, observations: Tensor) -> Tensor:
        """Speed and steering as shares of their largest values, (batch, 2)."""
        actions: Tensor = self._action(self._layers(self._features(observations)))
        return actions.clamp(-1.0, 1.0)


class _Where:
    """Where things stand in an observation with its history."""

    def __init__(self, fields: Sequence[Field], history: int) -> None:
        n_others = next(f.size for f in fields if f.name == "mask")
        one = sum(f.size for f in fields)
        stands: dict[str, I64] = {}
        first = 0
        for f in fields:
            # (history, other or 1, number)
            index = first + np.arange(f.size) + one * np.arange(history)[:, None]
            stands[f.name] = index.reshape(history, n_others if f.per_other else 1, -1)
            first += f.size
        self.size = one * history
        self.others = _join([stands[f.name] for f in fields if f.per_other])
        self.own = _join([stands[f.name] for f in fields if not f.per_other])[0]
        self.near = stands["near"].ravel() if "near" in stands else None
        # A car counts whose position is known, or that has a place; the newest says.
        self.newest = {n: np.ascontiguousarray(stands[n][0, :, 0]) for n in ("mask", "wanted")}
        self.gain = np.ones(self.size, np.float32)
        for f in fields:
            self.gain[stands[f.name].ravel()] = 1.0 / SCALES.get(f.name, 1.0)
        self.places: dict[str, I64] | None = None
        if "pos" in stands:
            # Of each coordinate of each observation: place, whether it is known, and wanted.
            twice = {n: np.repeat(stands[n], 2, axis=-1) for n in ("mask", "wanted")}
            named = {"pos": stands["pos"], "target": stands["target"], **twice}
            self.places = {f"place_{n}": _join([index]) for n, index in named.items()}


def _join(parts: Sequence[I64]) -> I64:
    """Index arrays (history, other, number) side by side, (other, history x number)."""
    joined = np.concatenate(parts, axis=-1)
    return np.ascontiguousarray(np.moveaxis(joined, 0, 1).reshape(joined.shape[1], -1))
