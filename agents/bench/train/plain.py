"""The learner without what makes ours fast."""

from __future__ import annotations

import torch
from stable_baselines3 import PPO
from torch import nn

from agents.training.ppo.hyperbolic import FromLogistic
from agents.training.ppo.network import SwarmFeatures


def make_plain(model: PPO) -> PPO:
    """Let a learner compute the same the long way, and give it back.

    That is torch's own tangent, absent others computed and multiplied by zero, and
    Stable-Baselines3's own optimiser.
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
