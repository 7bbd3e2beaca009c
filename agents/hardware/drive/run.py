"""Run a drive with real cars, from opening the ports to the final stop."""

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
from hardware_bridge.config import SwarmConfig, alone, read_config
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
    node: int | None = None,
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
        config: Path of a swarm.toml, or the result of `read_config`.
        node: Node of the only car to drive, on its own computer; see `alone`. None drives all.
        name: A controller of `agents.controllers.CONTROLLERS`, or a policy as for
            `agents.policies.load_policy`.
        observation: Observation mode; by default that of the policy's training, or `estimate`.
        arm: Whether the cars may move: they are armed after all checks have passed for a while.
            False is a dry run, which opens no port of a car.
        seconds: Length after arming [s]; None runs until Ctrl-C or the end of the task.
        wait: Longest wait until all checks pass [s].
        record: File for a recording.
        watch: Called after every control step.
        attend: Called every 10 ms with a function that takes operator commands: ``arm``,
            ``disarm``, ``stop``, ``clear``, or ``quit``, which ends the drive.

    Raises:
        BridgeError: A part of the swarm cannot be used, or the cars could not be armed.
        UsageError: No driver of that name, or it does not fit these cars.
    """
    swarm = config if isinstance(config, SwarmConfig) else read_config(config)
    if node is not None:
        swarm = alone(swarm, node)

    def open_bridge() -> Bridge:
        return Bridge(swarm, drive=True, arm=arm, wait=wait, record=record)

    return drive_on(
        open_bridge,
        swarm.n_slots,
        n_rangefinders=swarm.task.proximity,
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
    n_rangefinders: int = 0,
    name: str = CONTROLLER,
    observation: str | None = None,
    arm: bool = True,
    seconds: float | None = None,
    watch: Watch | None = None,
    attend: Callable[[Callable[[str], None]], None] | None = None,
) -> DriveResult:
    """Drive the cars of a bridge, which is opened after all other checks and closed at the end.

    Args:
        open_bridge: Opens the bridge.
        n_slots: Slots of its swarm.
        n_rangefinders: Distance sensors of each car.
        name: Controller or policy, as for `drive`.
        observation: Observation mode, as for `drive`.
        arm: Whether the bridge arms the cars.
        seconds: Length after arming [s], as for `drive`.
        watch: Called after every control step.
        attend: Called with a function that takes operator commands, as for `drive`.

    Raises:
        BridgeError: As `drive`.
        UsageError: As `drive`.
    """
    entry = find_entry(name)
    if entry.proximity is not None and entry.proximity != n_rangefinders:
        raise UsageError(
            f"{name}: expected {entry.proximity} distance sensors, the cars have "
            f"{n_rangefinders}: see proximity of [task]"
        )
    seen = observation or entry.trained_on or "estimate"
    if seen == "truth":
        raise UsageError("observation: real cars know no truth, expected estimate")
    reason = entry.refusal(seen, n_slots, n_rangefinders)
    if reason is not None:
        raise UsageError(f"{name}: {reason}")
    driver = entry.driver(seen, n_slots, n_rangefinders)
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
            # Raise the original error, not the one of a supervisor that has already ended.
            with suppress(BridgeError):
                bridge.feed.order("quit")
            raise
        bridge.feed.order("quit")
        return log.result(arm)


class _Orders:
    """Operator commands during a drive."""

    def __init__(self, bridge: OpenBridge) -> None:
        self._bridge, self._quit = bridge, False

    def take(self, what: str) -> None:
        """Pass an operator command to the start-up and to the supervisor."""
        self._quit |= what == "quit"
        self._bridge.start.heed(what)
        self._bridge.feed.order(what)

    def show(self, env: HardwareFormationEnv, watch: Watch | None) -> bool:
        """Call `watch`; return whether the operator has ended the drive."""
        if watch is not None:
            watch(self._bridge, env)
        return self._quit


def _drive(
    env: HardwareFormationEnv, driver: Driver, log: DriveLog, is_over: Callable[[], bool]
) -> None:
    """Run control steps until the time is up, the task is done, or `is_over` returns True."""
    for space in env.observation_spaces.values():
        driver.act(np.zeros(space.shape, np.float32))  # compiles and loads before the drive
    observations, _ = env.reset()
    log.first()
    while env.agents:
        actions = {agent: driver.act(seen) for agent, seen in observations.items()}
        observations, *_ = env.step(actions)
        log.add()
        if is_over():
            return
