"""Random faults of a run: one at a time, of one car or of all, repeatedly."""

import numpy as np

KINDS = (
    "none", "silence", "stale", "growth", "unsound", "jump", "ambiguous", "held", "unlinked",
)  # fmt: skip
LONGEST = 1.5


class Faults:
    """Faults, sampled for every environment when the last one ends; arrays over (env)."""

    def __init__(self, n_envs, n_cars, rng, kinds=KINDS):
        self._rng, self._n = rng, n_cars
        self._kinds = np.array([KINDS.index(kind) for kind in kinds])
        self._kind = np.zeros(n_envs, dtype=int)
        self._until = rng.uniform(1.0, 2.0, n_envs)
        self._since = np.zeros(n_envs)
        self._victim = np.zeros(n_envs, dtype=int)
        self.growth = np.zeros(n_envs)
        self.jump = np.zeros(n_envs, dtype=bool)

    def _is(self, kind):
        return self._kind == KINDS.index(kind)

    def step(self, t):
        rng, n = self._rng, len(self._kind)
        over = t >= self._until
        kind = self._kinds[rng.integers(0, len(self._kinds), n)]
        self._kind = np.where(over, kind, self._kind)
        self._since = np.where(over, t, self._since)
        self._until = np.where(over, t + rng.uniform(0.02, LONGEST, n), self._until)
        self._victim = np.where(over, rng.integers(0, self._n, n), self._victim)
        self.jump = self._is("jump") & (rng.random(n) < 0.3)
        self.growth = np.where(self._is("growth"), 4.0 * (t - self._since), 0.0)

    @property
    def silence(self):
        return self._is("silence")

    @property
    def held(self):
        """True where snapshots are late: the old one is sent again."""
        return self._is("held")

    @property
    def unsound(self):
        return self._is("unsound")

    @property
    def ambiguous(self):
        return self._is("ambiguous")

    @property
    def stale(self):
        """True for cars without telemetry, (env, car)."""
        return self._is("stale")[:, None] & self._one

    @property
    def linked(self):
        return ~(self._is("unlinked")[:, None] & self._one)

    @property
    def _one(self):
        return np.arange(self._n) == self._victim[:, None]

    def hit(self, n_cars):
        """True for the car whose view is affected, (env, car, 1)."""
        return self._one[:, :, None]
