"""Classical controllers on observations of policies. A new one needs a file and a line here."""

from __future__ import annotations

from collections.abc import Callable

from agents.controllers.consensus import Consensus, ConsensusParams
from agents.controllers.leader_follower import LeaderFollower, LeaderFollowerParams
from agents.controllers.range_only import RangeOnly, RangeOnlyParams
from agents.controllers.weaving import Weaving, WeavingParams
from agents.driver import Driver
from relpos_env.interface.observations import Field
from relpos_env.registry import build, look_up

ControllerBuilder = Callable[[tuple[Field, ...]], Driver]

CONTROLLERS: dict[str, ControllerBuilder] = {
    "consensus": Consensus,
    "leader-follower": LeaderFollower,
    "range-only": RangeOnly,
    "weaving": Weaving,
}
"""Name to builder ``(observation fields) -> Driver``."""


def controller_builder(name: str | ControllerBuilder) -> ControllerBuilder:
    """Return the builder of a controller.

    Args:
        name: One of `CONTROLLERS`, ``package.module:Name``, a name among the entry points
            ``relpos_env.controllers``, or a builder.

    Raises:
        EnvError: There is no controller of this name.
    """
    return look_up(CONTROLLERS, name, "controller", group="relpos_env.controllers")


def build_controller(name: str | ControllerBuilder, fields: tuple[Field, ...]) -> Driver:
    """Build a controller.

    Args:
        name: As for `controller_builder`.
        fields: Fields of the observations.

    Raises:
        EnvError: There is no controller of this name, or it is something else than a controller.
    """
    expected = "controller: expected a function (fields) that returns a Driver"
    return build(controller_builder(name), name, (fields,), Driver, expected)


__all__ = [
    "CONTROLLERS",
    "Consensus",
    "ConsensusParams",
    "LeaderFollower",
    "LeaderFollowerParams",
    "RangeOnly",
    "RangeOnlyParams",
    "Weaving",
    "WeavingParams",
    "build_controller",
    "controller_builder",
]
