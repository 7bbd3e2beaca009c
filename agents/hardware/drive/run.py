"""A drive with real cars, from opened ports to cars that stand again."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import TypeAlias

import numpy as np

from agents.comparison.contender import find_entry
from agents.driver import Driver
from agents.errors import UsageError
from agents.hardware.drive.log import DriveLog
from agents.hardware.drive.result import DriveResult
from hardware_bridge.config import SwarmConfig, read_config
from hardware_bridge.errors import BridgeError
from hardware_bridge.live.bridge import Bridge
from hardware_bridge.live.env import HardwareFormationEnv
from hardware_bridge.live.opened import OpenBridge
from relpos_env.timing import DECISION

CONTROLLER = "consensus"
Watch: TypeAlias = Callable[[OpenBridge, HardwareFormationEnv], None]
MOST_CYCLES = 800_000


def drive(
    *,
    config: SwarmConfig | Path | str,
    name: str = CONTROLLER,
    observation: str | None = None,
    arm: bool = False,
    seconds: float | None = None,
    wait: float = 60.0,
    record: Path | str | None = None,
    watch: Watch | None = None,
    attend: Callable[[Callable[[str], None]], None] | None = None,
) -> DriveResult:
    """Drive the cars of a swarm on the estimates of their trackers.

    Args:
        config: A swarm.toml, or what `read_config` made of one.
        name: A controller of `agents.controllers.CONTROLLERS`, or a policy as for
            `agents.policies.load_policy`.
        observation: What they see; by default what the policy was trained on, or `estimate`.
        arm: Whether the cars may move: they are armed once all has been well for a while. Without
            it is a dry run, and no port of a car is opened.
        seconds: Length from then on; None ends with Ctrl-C or when the task is done.
        wait: So long is waited for all to be well [s].
        record: File for a recording.
        watch: Called after every decision.
        attend: Called every hundredth of a second with what takes orders: ``arm``, ``disarm``,
            ``stop``, ``clear``, or ``quit``, which ends the drive.

    Raises:
        BridgeError: Something of the swarm cannot be used, or the cars could not be armed.
        UsageError: No driver of that name, or not for such cars.
    """
    swarm = config if isinstance(config, SwarmConfig) else read_config(config)

    def open_bridge() -> Bridge:
        return Bridge(swarm, drive=True, arm=arm, wait=wait, record=record)

    return drive_on(
        open_bridge,
        swarm.n_slots,
        n_beams=swarm.task.proximity,
        name=name,
        observation=observation,
        arm=arm,
        seconds=seconds,
        watch=watch,
        attend=attend,
    )


def drive_on(
    open_bridge: Callable[[], OpenBridge],
    n_slots: int,
    *,
    n_beams: int = 0,
    name: str = CONTROLLER,
    observation: str | None = None,
    arm: bool = True,
    seconds: float | None = None,
    watch: Watch | None = None,
    attend: Callable[[Callable[[str], None]], None] | None = None,
) -> DriveResult:
    """Drive the cars of a bridge, which is opened when all else is well, and closed again.

    Args:
        open_bridge: Opens it.
        n_slots: Slots of its swarm.
        n_beams: Of the distance sensors of each car.
        name: As for `drive`, like all that follow.
        observation: What they see.
        arm: Whether the bridge arms the cars.
        seconds: Length.
        watch: Called after every decision.
        attend: Called with what takes orders.

    Raises:
        BridgeError: As `drive`.
        UsageError: As `drive`.
    """
    entry = find_entry(name)
    if entry.proximity is not None and entry.proximity != n_beams:
        raise UsageError(
            f"{name}: expected {entry.proximity} beams, the cars have {n_beams}: see proximity of "
            "[task]"
        )
    seen = observation or entry.trained_on or "estimate"
    if seen == "truth":
        raise UsageError("observation: real cars know no truth, expected estimate")
    reason = entry.refusal(seen, n_slots, n_beams)
    if reason is not None:
        raise UsageError(f"{name}: {reason}")
    driver = entry.driver(seen, n_slots, n_beams)
    cycles = MOST_CYCLES if seconds is None else round(seconds / DECISION)
    with closing(open_bridge()) as bridge:
        env = bridge.env(observation=seen, history=entry.history, max_cycles=cycles)
        log = DriveLog(entry.title, bridge, env, cycles)
        orders = _Orders(bridge)
        if attend is not None:
            bridge.feed.attend = lambda: attend(orders.take)
        bridge.start.attend = lambda: orders.show(env, watch)
        try:
            _drive(env, driver, log, lambda: orders.show(env, watch))
        except KeyboardInterrupt:
            pass
        except BaseException:
            # What is wrong is not that a supervisor that has ended takes no more orders.
            with suppress(BridgeError):
                bridge.feed.order("quit")
            raise
        bridge.feed.order("quit")
        return log.result(arm)


class _Orders:
    """What people ask for while it lasts."""

    def __init__(self, bridge: OpenBridge) -> None:
        self._bridge, self._quit = bridge, False

    def take(self, what: str) -> None:
        """An order."""
        self._quit |= what == "quit"
        self._bridge.start.heed(what)
        self._bridge.feed.order(what)

    def show(self, env: HardwareFormationEnv, watch: Watch | None) -> bool:
        """After a decision; whether it is to end."""
        if watch is not None:
            watch(self._bridge, env)
        return self._quit


def _drive(
    env: HardwareFormationEnv, driver: Driver, log: DriveLog, is_over: Callable[[], bool]
) -> None:
    """Decide until the time is up, the task is done, or it is stopped."""
    for space in env.observation_spaces.values():
        driver.act(np.zeros(space.shape, np.float32))  # loads what is loaded when first used
    observations, _ = env.reset()
    log.first()
    while env.agents:
        actions = {agent: driver.act(seen) for agent, seen in observations.items()}
        observations, *_ = env.step(actions)
        log.add()
        if is_over():
            return
