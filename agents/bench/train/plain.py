"""The learner without our optimisations."""

from __future__ import annotations

import torch
from stable_baselines3 import PPO
from torch import nn

from agents.training.ppo.hyperbolic import FromLogistic
from agents.training.ppo.network import SwarmFeatures


def make_plain(model: PPO) -> PPO:
    """Remove our optimisations from a learner, and return it.

    It then uses tanh of torch, computes features of absent neighbours and multiplies them by zero,
    and uses torch's Adam, as Stable-Baselines3 does.
    """
    policy = model.policy
    for module in policy.modules():
        if isinstance(module, SwarmFeatures):
            module.skips_absent = False
        for name, child in module.named_children():
            if isinstance(child, FromLogistic):
                setattr(module, name, nn.Tanh())
    rate = policy.optimizer.param_groups[0]["lr"]
    policy.optimizer = torch.optim.Adam(policy.parameters(), lr=rate, eps=1e-5)
    return model
