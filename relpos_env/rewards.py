"""Reward terms that any task can have besides its own, by name. A new one needs a line here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from relpos_env.tasks.observe import information_of
from tracking.arrays import F64


def information(formation: Any) -> F64:
    """Return the `information` term of `observe`, (env, car)."""
    view = formation.loop.view
    return information_of(view.cov, view.ok, formation.state.present)


REWARDS: dict[str, Callable[[Any], F64]] = {"information": information}
"""Name to ``(formation) -> (env, car)``."""
