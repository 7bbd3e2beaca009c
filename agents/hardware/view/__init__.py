"""A swarm drawn by Rerun: what `--view` shows."""

from agents.hardware.view.viewer import Viewer, open_viewer

__all__ = ["Viewer", "open_viewer"]
