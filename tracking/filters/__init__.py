"""Position filters. Adding one: a file beside `pair_ekf.py` and a line in `FILTERS`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from tracking.errors import ConfigError
from tracking.filters.base import Filter
from tracking.filters.pair_ekf import PairEkf

FILTERS: dict[str, Callable[..., Filter]] = {
    "ekf": partial(PairEkf, use_mds=False),
    "ekf-mds": PairEkf,
}
"""Name to builder ``(constellation, params, n_envs) -> Filter``."""

DEFAULT_FILTER = "ekf-mds"


def filter_builder(name: str) -> Callable[..., Filter]:
    """Look a filter up.

    Raises:
        ConfigError: No filter of that name.
    """
    if name not in FILTERS:
        raise ConfigError(f"filter: expected one of {', '.join(FILTERS)}, got {name!r}")
    return FILTERS[name]


__all__ = ["DEFAULT_FILTER", "FILTERS", "Filter", "PairEkf", "filter_builder"]
