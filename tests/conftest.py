"""Shared fixtures: the folder of recorded data, and groups."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from tracking.constellation import Constellation, NodeConfig
from tracking.measurements import Kind, MeasurementBlock

# The first example may include compilation of kernels.
settings.register_profile("compiled", deadline=None)
settings.load_profile("compiled")

ROOT = Path(__file__).resolve().parents[1]


def find_data() -> Path | None:
    named = os.environ.get("RELPOS_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def data() -> Path:
    """Return the folder of recorded data; tests without it are skipped, but never in CI."""
    folder = find_data()
    if folder is None:
        message = "no recorded data: set RELPOS_DATA to a folder with logs/"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    return folder


@pytest.fixture(scope="session", autouse=True)
def logs_of_stable_baselines(tmp_path_factory):
    """Redirect the log folders that Stable-Baselines3 makes for learners without a logger."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SB3_LOGDIR", str(tmp_path_factory.mktemp("sb3")))
        yield


class Group:
    """Nodes on circles of their own, with exact measurements and the truth."""

    def __init__(self, n: int = 4, dimensions: int = 2, seconds: float = 14.0, hz: float = 50.0):
        self.constellation = Constellation(
            nodes=tuple(NodeConfig(id=10 + k) for k in range(n)), dimensions=dimensions
        )
        self.t = np.arange(1, int(seconds * hz)) / hz
        self.dimensions = dimensions
        k = np.arange(n)
        self.rate = 0.9 + 0.35 * k
        self.centre = 2.0 * np.stack([np.cos(2.4 * k), np.sin(2.4 * k), 0.5 * np.cos(5.0 * k)], -1)
        self.block = self._block()

    def pos(self, t):
        phase = self.rate * np.asarray(t)[..., None] + np.arange(len(self.rate))
        axes = np.stack([np.cos(phase), np.sin(phase), 0.5 * np.sin(1.4 * phase)], axis=-1)
        pos = self.centre + axes
        pos[..., self.dimensions :] = 0.0
        return pos

    def accel(self, t, h=1e-3):
        return (self.pos(t + h) - 2.0 * self.pos(t) + self.pos(t - h)) / h**2

    def pairs(self, t):
        pos = self.pos(t)
        i, j = self.constellation.pairs.T
        return pos[..., j, :] - pos[..., i, :]

    def _block(self):
        # The acceleration is held until the next sample: send its mean over that time.
        dt = self.t[1] - self.t[0]
        vel = (self.pos(self.t[:, None] + [dt, 0.0]) - self.pos(self.t[:, None] + [0.0, -dt])) / dt
        held = (vel[:, 0] - vel[:, 1]) / dt
        ints = lambda k: np.full(len(self.t), k, dtype=np.int64)  # noqa: E731
        parts = []
        for k in range(self.constellation.n_nodes):
            values = np.zeros((len(self.t), 7))
            values[:, 0] = 1.0
            values[:, 4:] = held[:, k]
            parts.append(MeasurementBlock.of_kind(Kind.STATE, self.t, ints(k), values))
        relative = self.pairs(self.t)
        for p, (i, j) in enumerate(self.constellation.pairs):
            distance = np.linalg.norm(relative[:, p], axis=-1)[:, None]
            ends = ints(i), ints(j)
            parts.append(
                MeasurementBlock.of_kind(
                    Kind.RANGE, self.t, ends[0], distance, j=ends[1], antennas=ends
                )
            )
        return MeasurementBlock.concatenate(parts).sorted()


@pytest.fixture(scope="session")
def make_group():
    return Group


@pytest.fixture(scope="session")
def group():
    return Group()
