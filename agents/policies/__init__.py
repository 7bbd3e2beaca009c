"""Trained policies: observation layout, files, and inference.

A policy is two files, ``name.onnx`` and its model card ``name.json``. Nothing is unpickled, and
inference needs neither torch nor Stable-Baselines3.
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
