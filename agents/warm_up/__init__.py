"""Compile ahead of time, in one process per core by default (`relpos warmup`)."""

from agents.warm_up.background import BackgroundWarmUp
from agents.warm_up.parts import ORIENTATION, PURPOSES, Part, parts_of
from agents.warm_up.processes import WarmUp, shown_progress, warm_up, warm_up_first

__all__ = [
    "ORIENTATION",
    "PURPOSES",
    "BackgroundWarmUp",
    "Part",
    "WarmUp",
    "parts_of",
    "shown_progress",
    "warm_up",
    "warm_up_first",
]
