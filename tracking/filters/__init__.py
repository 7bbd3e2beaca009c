"""Position filters. Adding one: a folder beside `joint` and a line in `FILTERS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.filters.base import Filter
from tracking.filters.joint import JointEkf
from tracking.filters.pair import PairEkf
from tracking.filters.paper import PaperEkf
from tracking.filters.params import FilterParams

FILTERS: dict[str, Callable[[Constellation, FilterParams, int], Filter]] = {
    "joint": lambda who, params, n_envs: JointEkf(who, params.joint, n_envs),
    "ekf-mds": lambda who, params, n_envs: PairEkf(who, params.pair, n_envs),
    "ekf": lambda who, params, n_envs: PairEkf(who, params.pair, n_envs, use_mds=False),
    "paper-ekf-mds": lambda who, params, n_envs: PaperEkf(who, params.paper, n_envs),
    "paper-ekf": lambda who, params, n_envs: PaperEkf(
        who, replace(params.paper, feedback="none"), n_envs
    ),
}
"""Name to builder ``(constellation, params, n_envs) -> Filter``."""

DEFAULT_FILTER = "joint"


def filter_builder(name: str) -> Callable[[Constellation, FilterParams, int], Filter]:
    """Look a filter up.

    Raises:
        ConfigError: No filter of that name.
    """
    if name not in FILTERS:
        raise ConfigError(f"filter: expected one of {', '.join(FILTERS)}, got {name!r}")
    return FILTERS[name]


__all__ = ["DEFAULT_FILTER", "FILTERS", "Filter", "FilterParams", "filter_builder"]
