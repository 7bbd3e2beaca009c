"""A car whose own computer decides for it alone, by its own tracker."""

from __future__ import annotations

from dataclasses import replace

from hardware_bridge.config.swarm import SwarmConfig
from hardware_bridge.errors import BridgeError

TASKS_ALONE = ("hold", "rendezvous", "escort", "seek")
"""Tasks without a plan over time, which computers without a common clock cannot share."""


def known_by(config: SwarmConfig, node: int) -> SwarmConfig:
    """Return the configuration for a tracker that knows what one node knows.

    Args:
        config: Configuration with the links of this node.
        node: A node that moves.

    Raises:
        BridgeError: The file has no such node.
    """
    group = config.constellation
    moving = [each.id for each in group.nodes if each.kind == "moving"]
    if node not in moving:
        known = ", ".join(map(str, moving))
        raise BridgeError(f"--node: expected a node that moves ({known}), got {node}")
    cars = tuple(car for car in config.cars if car.node == node)
    safety = replace(config.safety, others_drive=True)
    return replace(config, cars=cars, safety=safety, alone=node)


def alone(config: SwarmConfig, node: int) -> SwarmConfig:
    """Return the configuration for the computer of one car.

    Only this car is driven, and it leaves the others half of the way between them, since their
    computers decide by themselves.

    Args:
        config: Configuration with the links of this computer.
        node: Node on the car.

    Raises:
        BridgeError: The file has no such car, or the task needs a plan that all cars share.
    """
    config_alone = known_by(config, node)
    if not config_alone.cars:
        known = ", ".join(str(car.node) for car in config.cars) or "none"
        raise BridgeError(f"--node: expected a car of [cars] ({known}), got {node}")
    if config.task.name not in TASKS_ALONE:
        raise BridgeError(
            f"task.name: a car alone expects one of {', '.join(TASKS_ALONE)}, got "
            f"{config.task.name!r}: cars without a common clock do not share a plan over time"
        )
    first = config.constellation.ids[0]
    if config.task.name in ("escort", "seek") and node == first:
        raise BridgeError(
            f"--node: expected another one than {first}, which the others escort or seek: a person "
            "moves it"
        )
    if config.task.command == "link":
        raise BridgeError(
            'task.command: a car alone expects "plan", got "link": an operator commands a group'
        )
    return config_alone
