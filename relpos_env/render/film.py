"""Rendering of a running environment: snapshots, and the errors of the recent past."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from relpos_env.core.env_core import EnvCore
from relpos_env.errors import EnvError
from relpos_env.render.backend import load_pygame
from relpos_env.render.renderer import RENDER_MODES, Renderer
from relpos_env.render.snapshot import LINE_OF_SIGHT, NO_LINE_OF_SIGHT, NO_RANGE, Snapshot
from relpos_env.timing import DECISION

HISTORY = 20.0
"""[s] Time window of the displayed errors."""
SILENT = 0.5
"""[s] A pair without a range for longer is drawn as not connected."""


def check_render_mode(mode: str | None) -> None:
    """Check a render mode.

    Raises:
        EnvError: Neither None nor one of `RENDER_MODES`, or pygame is not installed.
    """
    if mode is not None and mode not in RENDER_MODES:
        raise EnvError(f"render_mode: expected None, {' or '.join(RENDER_MODES)}, got {mode!r}")
    if mode is not None:
        load_pygame()


class Film:
    """Images of one environment of a batch, with the estimates of its first present car."""

    def __init__(self, mode: str | None, fps: float, *, env: int = 0) -> None:
        self._mode, self._fps, self._env = mode, fps, env
        self._renderer: Renderer | None = None
        self._errors: deque[tuple[float, float, float]] = deque(maxlen=round(HISTORY / DECISION))

    def forget(self) -> None:
        """Clear the errors, for a new episode."""
        self._errors.clear()

    def add(self, formation: EnvCore) -> None:
        """Record the current errors and, in mode ``human``, draw."""
        env = self._env
        present = formation.state.present[env]
        formed = float(np.mean(formation.task.error[env], where=present)) if present.any() else 0.0
        tracking = formation.tracking_error()[env]
        known = np.isfinite(tracking)
        tracked = float(tracking[known].mean()) if known.any() else np.nan
        self._errors.append((float(formation.t[env]), formed, tracked))
        if self._mode == "human":
            self._draw(formation)

    def picture(self, formation: EnvCore) -> Any:
        """Return an image, uint8 (height, width, 3); None in mode ``human`` or without a mode."""
        return self._draw(formation) if self._mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window; the next drawing opens it again."""
        if self._renderer is not None:
            self._renderer.close()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the renderer, which is created again when needed."""
        return {**self.__dict__, "_renderer": None}

    def _draw(self, formation: EnvCore) -> Any:
        if self._renderer is None:
            self._renderer = Renderer(mode=self._mode or "rgb_array", fps=self._fps)
        return self._renderer.draw(self.snapshot(formation))

    def snapshot(self, formation: EnvCore) -> Snapshot:
        """Return a snapshot of the current state."""
        env, swarm, view = self._env, formation.loop.swarm, formation.loop.view
        state, task = swarm.state.take(env), formation.task
        present = state.present
        viewer = int(np.argmax(present))
        cov = view.cov[env, viewer]
        history = np.array(self._errors).reshape(-1, 3)
        boxes = swarm.boxes[env]
        scenario = formation.parts.scenario
        return Snapshot(
            t=max(float(formation.t[env]), 0.0),
            room=scenario.room,
            boxes=boxes,
            movable=swarm.movable(env),
            pose=np.column_stack([state.pos_w, state.heading]),
            steering=state.steering,
            present=present,
            powered=swarm.powered[env],
            car_size=(scenario.car.length, scenario.car.width),
            viewer=viewer,
            estimate=view.pos[env, viewer],
            estimate_cov=cov[:, [[0, 2], [2, 1]]],
            estimate_ok=view.ok[env, viewer],
            estimate_status=view.status[env, viewer],
            estimate_heading=view.heading[env],
            links=self._links(formation),
            target=task.target[env, viewer],
            has_target=task.has_target[env, viewer],
            goal=task.goal_w[env],
            history_t=history[:, 0],
            formation_error=history[:, 1],
            tracking_error=history[:, 2],
            title=f"{formation.parts.config.task}, {scenario.name}",
        )

    def _links(self, formation: EnvCore) -> np.ndarray:
        """Return the pairs of cars and the kinds of their links, (pair, 3)."""
        env, swarm, view = self._env, formation.loop.swarm, formation.loop.view
        i, j = swarm.constellation.pairs.T
        sight = swarm.line_of_sight(env)[i, j]
        kind = np.where(sight, LINE_OF_SIGHT, NO_LINE_OF_SIGHT)
        kind[view.now[env] - view.t_last_range[env, i, j] > SILENT] = NO_RANGE
        return np.column_stack([i, j, kind])
