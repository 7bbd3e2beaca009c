"""Classical controllers on the observations that policies get. Adding one: a file and a line."""

from __future__ import annotations

from collections.abc import Callable

from agents.controllers.base import Controller
from agents.controllers.consensus import Consensus
from relpos_env.interface.observations import Field

CONTROLLERS: dict[str, Callable[[tuple[Field, ...]], Controller]] = {"consensus": Consensus}
"""Name to builder ``(observation fields) -> Controller``."""

__all__ = ["CONTROLLERS", "Consensus", "Controller"]
