"""What there is to compile: trackers, the simulated world, tasks, the hardware bridge.

Each part is compiled by a process of its own (`python -m agents.warm_up NAME`), and shares little
code with the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np

from agents.errors import UsageError
from tracking import Constellation, NodeConfig, Tracker
from tracking.estimate import TeamEstimate
from tracking.filters import DEFAULT_FILTER, FILTERS, filter_builder
from tracking.kernels.jit import Call, bind, is_compiled, missing_in, types_of
from tracking.measurements import MeasurementBlock

SECONDS = {"env": 38.0, "joint.0": 33.0, "ekf-mds.0": 30.0, "joint.1": 29.0, "joint.2": 18.0,
           "paper-ekf-mds.0": 16.0, "hardware": 6.0, "tasks": 6.0}  # fmt: skip
"""[s] Time of a part on one core of a laptop, for the progress that is shown."""
ORIENTATION = "orientation"
"""Part that trackers with all filters have."""
OTHERS = 10.0
"""[s] Time of a part that is not in the table."""
SWARM = """
[nodes.1]
[nodes.2]
[nodes.3]
[links.n1]
port = "none"
format = "relpos"
"""
"""A swarm that is never opened."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Kernels that are compiled one after the other."""

    name: str
    is_kept: Callable[[], bool]
    """Whether the disk has its code."""
    compile: Callable[[], None]
    """Load the code of the part from the disk, or compile it."""
    needs_others: bool = False
    """True if it uses what other parts compile, and so comes after them."""

    @property
    def seconds(self) -> float:
        """About how long it takes [s]."""
        return SECONDS.get(self.name, OTHERS)


def parts_of(
    purpose: str, filters: tuple[str, ...] = (DEFAULT_FILTER,), *, in_space: bool = True
) -> list[Part]:
    """Parts that something needs.

    Args:
        purpose: One of `PURPOSES`.
        filters: Some of `tracking.filters.FILTERS`; all of them for the purpose ``all``.
        in_space: Whether groups move in space, too, or in a plane only.

    Raises:
        ConfigError: No filter of that name.
        UsageError: No such purpose.
    """
    if purpose not in PURPOSES:
        raise UsageError(f"--for: expected one of {', '.join(PURPOSES)}, got {purpose!r}")
    names = tuple(FILTERS) if purpose == "all" else filters
    others = [OTHER_PARTS[name] for name in PURPOSES[purpose]]
    trackers = list(_tracker_parts(names, in_space))
    if others:
        # The world is driven with orientations: little is left of that part.
        of_world = [part for part in trackers if part.name == ORIENTATION]
        late = [replace(part, needs_others=True) for part in of_world]
        trackers = [*(part for part in trackers if part.name != ORIENTATION), *late]
    return [*trackers, *others]


def _tracker_parts(filters: Iterable[str], in_space: bool) -> Iterator[Part]:
    """Parts of trackers; what filters share is one part."""
    known = set[frozenset[Any]]()
    for name in dict.fromkeys(filters):
        for part_name, calls in _kernel_groups(name, in_space):
            code = frozenset((id(kernel), types_of(given)) for kernel, given in calls)
            if code not in known:
                known.add(code)
                kept, compiles = partial(_are_kept, calls), partial(_bind_all, calls)
                yield Part(name=part_name, is_kept=kept, compile=compiles)


def _kernel_groups(name: str, in_space: bool) -> Iterator[tuple[str, list[Call]]]:
    """Of one tracker, the same for all groups of nodes in a plane, and for all in space."""
    filter_builder(name)
    nodes = tuple(NodeConfig(id=k) for k in range(4))
    who = Constellation(nodes=nodes, dimensions=3 if in_space else 2)
    groups = Tracker(who, filter=name).calls()
    for k, group in enumerate(groups):
        # The last is that of the orientations, the same for all filters.
        named = f"{name}.{k}" if k < len(groups) - 1 else ORIENTATION
        yield named, group


def _bind_all(calls: list[Call]) -> None:
    for kernel, given in calls:
        bind(kernel, *given)


def _are_kept(calls: list[Call]) -> bool:
    return all(is_compiled(kernel, *given) for kernel, given in calls)


class NoFilter:
    """Estimates nothing: with it the world is compiled while others compile the tracker."""

    follows_bias = False

    def __init__(self, constellation: Constellation, params: Any, n_envs: int) -> None:
        self._constellation, self._n_envs = constellation, n_envs

    def run(self, block: MeasurementBlock, t_out: Any) -> TeamEstimate:
        """An estimate of nothing."""
        return TeamEstimate.empty(self._constellation, np.array(t_out, dtype=np.float64))

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """Leaves the estimate as it is."""
        return lambda: None

    def calls(self, block: MeasurementBlock, estimate: TeamEstimate) -> list[list[Call]]:
        """None."""
        return []

    def reset(self, env: int) -> None:
        """Nothing is known before, either."""

    def part(self, envs: slice) -> Self:
        """The same."""
        return self

    def save(self) -> None:
        """Nothing."""

    def restore(self, saved: None) -> None:
        """Nothing."""

    def mean_nis(self) -> Any:
        """Not a number."""
        return np.full(self._n_envs, np.nan)

    def n_rejected(self) -> Any:
        """None."""
        return np.zeros(self._n_envs)


def _drive(**arguments: Any) -> None:
    from relpos_env import formation_v0

    env = formation_v0.parallel_env(**arguments)
    env.reset(seed=0)
    for _ in range(3):
        env.step({agent: np.zeros(2, dtype=np.float32) for agent in env.agents})
    env.close()


def _compile_world() -> None:
    from relpos_env.interface.observations import OBSERVATIONS

    for observation in OBSERVATIONS:
        _drive(filter=NoFilter, observation=observation, record=True)


def _compile_tasks() -> None:
    from relpos_env.tasks import TASKS

    for task in TASKS:
        _drive(filter=NoFilter, task=task, proximity=4)


def _swarm() -> Any:
    from hardware_bridge.config.read import parse_config

    return parse_config(SWARM, file="swarm.toml", folder=Path(), with_files=False)


def _compile_hardware() -> None:
    from agents.hardware.emulate.options import EmulateOptions
    from agents.hardware.emulate.warm_up import warm_up as drive_emulated_cars
    from hardware_bridge.live.warm_up import warm_up as drive_live

    drive_live(_swarm())
    drive_emulated_cars(EmulateOptions())


def _has_world() -> bool:
    import relpos_env.core.env_core  # noqa: F401

    driven = ("_step_kernels", "_result_kernels", "interface", "tasks._ring_kernels")
    return not any(missing_in(f"relpos_env.{name}") for name in driven)


def _has_tasks() -> bool:
    import relpos_env.tasks  # noqa: F401

    return not missing_in("relpos_env.tasks")


def _has_hardware() -> bool:
    import hardware_bridge.live.swarm
    import hardware_bridge.wire.codec  # noqa: F401

    return not missing_in("hardware_bridge.wire._codec_kernels")


OTHER_PARTS = {
    part.name: part
    for part in (
        Part(name="env", is_kept=_has_world, compile=_compile_world),
        Part(name="tasks", is_kept=_has_tasks, compile=_compile_tasks, needs_others=True),
        Part(name="hardware", is_kept=_has_hardware, compile=_compile_hardware, needs_others=True),
    )
}
PURPOSES: dict[str, tuple[str, ...]] = {
    "track": (),
    "env": ("env", "tasks"),
    "hardware": ("env", "hardware"),
    "all": ("env", "tasks", "hardware"),
}
"""Parts that are needed in addition to trackers, by purpose."""
