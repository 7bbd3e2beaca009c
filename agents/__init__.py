"""Controllers, training, evaluation, reports and the command line.

The functions for most users, imported on first use:

>>> from agents import compare, demo, evaluate, simulate, track, train
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_FUNCTIONS = {
    "compare": "agents.comparison.compare",
    "demo": "agents.simulation.demo",
    "evaluate": "agents.evaluation.evaluate",
    "simulate": "agents.simulation.simulate",
    "track": "agents.evaluation.track:track_log",
    "train": "agents.training.run:train_policy",
}
"""Module of each name, with the name of the function if it differs."""

__all__ = ["compare", "demo", "evaluate", "simulate", "track", "train"]


def __getattr__(name: str) -> Any:
    if name not in _FUNCTIONS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, function = _FUNCTIONS[name].partition(":")
    return getattr(import_module(module), function or name)
