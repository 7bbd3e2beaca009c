"""swarm.toml: the nodes of the group, the ports and the permitted actions."""

from hardware_bridge.config.alone import alone, known_by
from hardware_bridge.config.read import parse_config, read_config
from hardware_bridge.config.swarm import CarConfig, LinkConfig, SwarmConfig, TaskConfig

__all__ = [
    "CarConfig",
    "LinkConfig",
    "SwarmConfig",
    "TaskConfig",
    "alone",
    "known_by",
    "parse_config",
    "read_config",
]
