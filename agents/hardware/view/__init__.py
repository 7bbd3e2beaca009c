"""Rerun view of a swarm (`--view`)."""

from agents.hardware.view.viewer import Viewer, open_viewer

__all__ = ["Viewer", "open_viewer"]
