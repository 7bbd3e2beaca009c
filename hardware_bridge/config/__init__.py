"""swarm.toml: who is in the group, where the bytes come from, what may be done."""

from hardware_bridge.config.read import parse_config, read_config
from hardware_bridge.config.swarm import CarConfig, LinkConfig, SwarmConfig, TaskConfig

__all__ = [
    "CarConfig",
    "LinkConfig",
    "SwarmConfig",
    "TaskConfig",
    "parse_config",
    "read_config",
]
