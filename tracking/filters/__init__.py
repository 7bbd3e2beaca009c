"""Position filters. A new one needs a folder next to `joint` and a line in `FILTERS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tracking.constellation import Constellation
from tracking.filters.base import Filter
from tracking.filters.joint import JointEkf
from tracking.filters.pair import PairEkf
from tracking.filters.paper import PaperEkf
from tracking.filters.params import FilterParams
from tracking.params.registry import build, look_up

FilterBuilder = Callable[[Constellation, FilterParams, int], Filter]

FILTERS: dict[str, FilterBuilder] = {
    "joint": lambda who, params, n_envs: JointEkf(who, params.joint, n_envs),
    "ekf-mds": lambda who, params, n_envs: PairEkf(who, params.pair, n_envs),
    "ekf": lambda who, params, n_envs: PairEkf(who, params.pair, n_envs, use_mds=False),
    "paper-ekf-mds": lambda who, params, n_envs: PaperEkf(who, params.paper, n_envs),
    "paper-ekf": lambda who, params, n_envs: PaperEkf(
        who, replace(params.paper, feedback="none"), n_envs
    ),
}
"""Name to builder ``(constellation, params, n_envs) -> Filter``."""

DESCRIPTIONS = {
    "joint": "one filter over the whole group",
    "ekf-mds": "a filter for each pair, corrected by MDS over the group",
    "ekf": "a filter for each pair, alone",
    "paper-ekf-mds": "Armani and Holz, as the text of their paper has it",
    "paper-ekf": "the same without MDS",
}
"""Short description of each filter."""

DEFAULT_FILTER = "joint"


def filter_builder(
    name: str | FilterBuilder,
) -> FilterBuilder:
    """Return the builder of a filter.

    Args:
        name: One of `FILTERS`, ``package.module:Name``, a name among the entry points
            ``relpos_env.filters``, or a builder itself.

    Raises:
        ConfigError: No filter has that name.
    """
    return look_up(FILTERS, name, "filter", group="relpos_env.filters")


def build_filter(
    name: str | FilterBuilder, constellation: Constellation, params: FilterParams, n_envs: int
) -> Filter:
    """Return a filter over a batch of groups.

    Args:
        name: As for `filter_builder`.
        constellation: The nodes.
        params: Parameters of all filters.
        n_envs: Number of groups.

    Raises:
        ConfigError: No filter has that name, or it is something else than a filter.
    """
    expected = "filter: expected a function (constellation, params, n_envs) that returns a Filter"
    return build(filter_builder(name), name, (constellation, params, n_envs), Filter, expected)


__all__ = [
    "DEFAULT_FILTER", "FILTERS", "Filter", "FilterBuilder", "FilterParams", "build_filter",
    "filter_builder",
]  # fmt: skip
