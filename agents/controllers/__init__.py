"""Classical controllers on the observations that policies get. Adding one: a file and a line."""

from __future__ import annotations

from collections.abc import Callable

from agents.controllers.consensus import Consensus, ConsensusParams
from agents.controllers.leader_follower import LeaderFollower, LeaderFollowerParams
from agents.controllers.range_only import RangeOnly, RangeOnlyParams
from agents.driver import Driver
from relpos_env.interface.observations import Field

CONTROLLERS: dict[str, Callable[[tuple[Field, ...]], Driver]] = {
    "consensus": Consensus,
    "leader-follower": LeaderFollower,
    "range-only": RangeOnly,
}
"""Name to builder ``(observation fields) -> Driver``."""

__all__ = [
    "CONTROLLERS",
    "Consensus",
    "ConsensusParams",
    "LeaderFollower",
    "LeaderFollowerParams",
    "RangeOnly",
    "RangeOnlyParams",
]
