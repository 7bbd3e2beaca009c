"""Parts of a configuration that an inspection uses, as protocols."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from hardware_bridge.links.ports import PortSpec
from tracking.constellation import Constellation


class LinkLike(Protocol):
    """Part of a link that an inspection uses."""

    @property
    def port(self) -> PortSpec:
        """Return its port."""

    @property
    def format(self) -> str:
        """Return the name of its decoder."""

    @property
    def node(self) -> int | None:
        """Return the node, where messages do not name it."""

    @property
    def ids(self) -> Mapping[str, int]:
        """Return node ids by device id."""

    @property
    def key(self) -> bytes | None:
        """Return the key of signed messages."""


class CarLike(Protocol):
    """Part of a car that an inspection uses."""

    @property
    def port(self) -> PortSpec:
        """Return its port."""

    @property
    def driver(self) -> str:
        """Return the name of its driver."""


class ConfigLike(Protocol):
    """Part of a configuration that an inspection uses."""

    @property
    def constellation(self) -> Constellation:
        """Return the nodes."""

    @property
    def links(self) -> Sequence[LinkLike]:
        """Return the links of measuring devices."""

    @property
    def cars(self) -> Sequence[CarLike]:
        """Return the cars."""
