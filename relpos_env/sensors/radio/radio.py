"""Radios of a batch of environments: ranges from the protocol, simulated per message.

Every node runs the compiled session of `tracking.ranging`. The nodes resolve the ranges
themselves, at the node with the smaller number. A range refers to the time of that node's
transmission and is available a good part of a round later.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.sensors.radio._air_kernels import make_nodes
from relpos_env.sensors.radio._air_state import (
    CHANNEL,
    FLIGHT,
    LATENT,
    NODE,
    RECEPTION,
    RadioNumbers,
    RangeBuffer,
    make_channel,
)
from relpos_env.sensors.radio._channel_kernels import KNOT
from relpos_env.sensors.radio._radio_kernels import Air, Scene, power_nodes, run_window
from relpos_env.sensors.radio.params import RadioSimParams
from tracking.arrays import F64, I64, Bool
from tracking.params.short_repr import short_repr
from tracking.ranging.compiled.overheard import Overheard, make_overheard
from tracking.ranging.compiled.state import (
    MESSAGE,
    SessionNumbers,
    make_sessions,
    session_numbers,
)
from tracking.ranging.frames.airtime import airtime, round_rate, table_bytes
from tracking.ranging.frames.timestamps import TICK_HZ
from tracking.ranging.members import MAX_MEMBERS


@dataclass(frozen=True, slots=True)
class Ranges:
    """Ranges resolved in one window, padded; (env, slot)."""

    __repr__ = short_repr

    t: F64
    """Time of the range [s]."""
    i: I64
    """The node with the smaller number."""
    j: I64
    values: F64
    """Distance [m], received and first-path power [dBm], (env, slot, 3)."""
    nlos: Bool
    """True if an obstacle was between the antennas (NLOS)."""
    count: I64
    """Number of slots used, (env)."""


class Radio:
    """Radios of all environments and the channels between them.

    Properties: equal seeds and motions give equal streams; environment k of a batch equals that
    environment alone, bit for bit; without errors and clock offsets, ranges equal distances.
    """

    def __init__(
        self,
        params: RadioSimParams,
        n_nodes: int,
        seeds: list[int],
        dt: float,
        clocks: F64 | None = None,
        overheard_windows: int = 0,
    ) -> None:
        """Allocate the state with every node switched off.

        Args:
            params: Parameters of the radios.
            n_nodes: Number of nodes in each environment.
            seeds: One for each environment, 0 to 2^63.
            dt: Length of a window [s].
            clocks: Relative rate offset of each node's clock, (node) [1]; drawn if None.
            overheard_windows: Number of windows for which `overheard` has room.

        Raises:
            EnvError: There are more nodes than a message can list.
        """
        phy = params.session.phy
        most = min(MAX_MEMBERS, phy.room + 1)
        if n_nodes > most:
            raise EnvError(
                f"radio: expected at most {most} nodes with frames of {phy.max_frame} bytes, "
                f"got {n_nodes}"
            )
        self._dt, self._params = dt, params
        self._numbers = session_numbers(params.session, n_nodes)
        rows = np.arange(len(self._numbers.frame))
        self._radio = RadioNumbers(
            phy.header_time,
            phy.detect,
            params.capture,
            params.clock_wander,
            np.array([airtime(phy, table_bytes(phy, int(k))) for k in rows]),
        )
        e, n = len(seeds), n_nodes
        sessions, peers = make_sessions(e, n)
        self._air = Air(
            np.zeros((e, n), dtype=NODE),
            np.zeros((e, n, n), dtype=LATENT),
            sessions,
            peers,
            np.zeros((e, n), dtype=MESSAGE),
            np.zeros((e, n, n), dtype=np.int64),
            np.zeros((e, n + 1), dtype=RECEPTION),
            np.zeros((e, n), dtype=FLIGHT),
            np.full((e, n), np.inf),
            np.zeros(e, dtype=CHANNEL),
            np.zeros(e, dtype=np.uint64),
            np.zeros(e, dtype=np.int64),
        )
        pairs = n * (n - 1) // 2
        self.room = room = pairs * (2 + int(np.ceil(dt * round_rate(phy, max(n, 2)))))
        """Largest number of ranges in a window."""
        # Messages follow each other on the air; each may complete ranges with all other nodes.
        messages = 2 + int(np.ceil(dt * n * round_rate(phy, max(n, 2))))
        self.overheard = make_overheard(e, n, overheard_windows * messages * n * n)
        """What every node knows from its radio since the reader set `used` to 0."""
        for k, seed in enumerate(seeds):
            self.reset(k, seed)
        if clocks is not None:
            self._air.nodes["rate"] = TICK_HZ * (1.0 + clocks)
        self._out = RangeBuffer(
            np.zeros((e, room)),
            np.zeros((e, room), dtype=np.int64),
            np.zeros((e, room), dtype=np.int64),
            np.zeros((e, room, 3)),
            np.zeros((e, room), dtype=bool),
            np.zeros(e, dtype=np.int64),
        )

    def reset(self, env: int, seed: int, params: RadioSimParams | None = None) -> None:
        """Restart one environment with every node switched off.

        Args:
            env: Index of the environment.
            seed: Seed of the environment, 0 to 2^63.
            params: Channel, clock offsets and antenna delays of this environment; by default those
                of the constructor. The protocol does not change.
        """
        params, air = params or self._params, self._air
        sessions, peers = make_sessions(1, air.nodes.shape[1])
        for name in ("nodes", "messages", "rows", "latents", "receptions", "flights"):
            getattr(air, name)[env] = 0
        air.sessions[env], air.peers[env] = sessions[0], peers[0]
        air.latents["knot"][env] = -1
        air.receptions["src"][env] = -1
        air.flights["detect"][env] = air.flights["end"][env] = np.inf
        air.due[env] = np.inf
        air.channel[env] = make_channel(params.channel, KNOT)[0]
        air.seeds[env], air.window[env] = seed, 0
        for array in self.overheard[6:]:
            array[env] = 0
        make_nodes(air.nodes[env], air.seeds[env], params.clock_offset, params.antenna_delay_std)

    def part(self, envs: slice) -> Radio:
        """Return a view of some of the environments that shares their memory."""
        part = copy.copy(self)
        part._air = Air._make(array[envs] for array in self._air)
        part._out = RangeBuffer._make(array[envs] for array in self._out)
        part.overheard = Overheard._make(array[envs] for array in self.overheard)
        return part

    @property
    def kernel_arguments(self) -> tuple[SessionNumbers, RadioNumbers, Air, RangeBuffer, Overheard]:
        """Arguments of `run_env_window` that this object holds."""
        return self._numbers, self._radio, self._air, self._out, self.overheard

    def switch_on(self, env: int, node: int, *, boot: int, after: float = 0.0) -> None:
        """Switch a node on, `after` seconds after the start of the next window."""
        power_nodes(self._numbers, self._air, env, node, True, boot, after)

    def switch_off(self, env: int, node: int) -> None:
        """Switch a node off at the start of the next window."""
        power_nodes(self._numbers, self._air, env, node, False, 0, 0.0)

    def step(
        self, pos0: F64, pos1: F64, boxes: F64 | None = None, capsules: F64 | None = None
    ) -> Ranges:
        """Simulate one window.

        Args:
            pos0: Antennas at the start of the window, (env, node, 3) [m].
            pos1: Antennas at the end of the window, (env, node, 3) [m].
            boxes: Obstacles in the plane: centre x y, half width, half depth [m], cosine and
                sine of the angle, (env, box, 6).
            capsules: Obstacles in 3D: two ends and the radius [m], (env, capsule, 7).
        """
        e = len(self._air.seeds)
        scene = Scene(
            pos0,
            pos1,
            np.zeros((e, 0, 6)) if boxes is None else boxes,
            np.zeros((e, 0, 7)) if capsules is None else capsules,
        )
        start = self._air.window[:, None] * self._dt
        run_window(
            self._numbers, self._radio, self._air, scene, self._dt, self._out, self.overheard
        )
        out, used = self._out, int(self._out.used.max())
        return Ranges(
            start + out.t[:, :used],
            out.i[:, :used].copy(),
            out.j[:, :used].copy(),
            out.values[:, :used].copy(),
            out.nlos[:, :used].copy(),
            out.used.copy(),
        )
