"""Trained policies: what they see, how they lie on disk, and how they are run.

A policy is two files, ``name.onnx`` and its card ``name.json``. Nothing here unpickles, and
running one needs neither torch nor Stable-Baselines3.
"""

from __future__ import annotations

from agents.policies.card import Card
from agents.policies.errors import PolicyError
from agents.policies.find import shipped_names
from agents.policies.layout import Layout
from agents.policies.trained import TrainedPolicy, load_policy
from agents.policies.write import write_policy

__all__ = [
    "Card",
    "Layout",
    "PolicyError",
    "TrainedPolicy",
    "load_policy",
    "shipped_names",
    "write_policy",
]
