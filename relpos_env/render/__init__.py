"""Images of cars in a room and of the estimates of one car, from plain arrays.

    Snapshot -> Renderer.draw -> (height, width, 3) uint8, or a window

Needs pygame, which is imported by the first `Renderer`: ``pip install -e '.[render]'``.
"""

from relpos_env.render.renderer import RENDER_MODES, Renderer, save_snapshot
from relpos_env.render.snapshot import LINE_OF_SIGHT, NO_LINE_OF_SIGHT, NO_RANGE, Snapshot

__all__ = [
    "LINE_OF_SIGHT",
    "NO_LINE_OF_SIGHT",
    "NO_RANGE",
    "RENDER_MODES",
    "Renderer",
    "Snapshot",
    "save_snapshot",
]
