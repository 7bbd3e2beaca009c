"""Groups with known and healthy states, for tests of the gate that add faults."""

import numpy as np

from hardware_bridge.safety.gate import Gate
from hardware_bridge.safety.moment import Moment
from hardware_bridge.safety.params import Fence, SafetyParams
from hardware_bridge.safety.picture import Picture, blank_picture
from hardware_bridge.safety.recent import at_rest
from hardware_bridge.safety.rules import RULES
from hardware_bridge.safety.telemetry import no_telemetry
from tracking.estimate import Status

TICK = 0.01
SQUARE = Fence(node=9, corners=((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)))


def picture(n_envs=1, n_cars=2, *, t=0.0, sigma=0.05, spacing=3.0) -> Picture:
    """Return cars in a row along x with headings along y, which request full speed."""
    q = blank_picture(n_envs, n_cars)
    q.t[:] = t
    q.requested_speed[:] = 3.0
    q.present[:] = q.oriented[:] = q.placed[:] = 1.0
    q.heading[:] = 0.5 * np.pi
    q.status[:] = Status.OK
    q.sound[:] = 1.0
    q.sigma[:] = sigma
    x = spacing * np.arange(n_cars)
    q.pos[..., 0] = x[None, :] - x[:, None]
    q.distance[:] = np.abs(q.pos[..., 0])
    q.ranged[:] = t
    q.place[:] = 2.0
    q.place_sigma[:] = 0.03
    return q


def check(name, q, params=None, *, now=0.0, word=0.0, t_last_message=0.0, was_slow=False, **other):
    """Return the verdict of one rule."""
    shape = q.heading.shape
    rule = next(rule for rule in RULES if rule.name == name)
    fields = {
        "linked": np.ones(shape, dtype=bool),
        "armed": np.ones(shape, dtype=bool),
        "recent": at_rest(shape),
        "telemetry": no_telemetry(shape, params or SafetyParams()),
        **other,
    }
    moment = Moment(
        q, np.full(shape[0], now), np.full(shape[0], word), np.full(shape, t_last_message),
        was_slow=np.full(shape, was_slow), **fields,
    )  # fmt: skip
    with np.errstate(invalid="ignore", over="ignore"):
        return rule.check(moment, params or SafetyParams())


class Driven:
    """A gate with a clock, and a group that is healthy by default."""

    def __init__(self, params=None, n_envs=1, n_cars=2, **options):
        self.params = params or SafetyParams()
        self.gate = Gate(self.params, n_envs, n_cars)
        self.q = picture(n_envs, n_cars, **options)
        self.shape = (n_envs, n_cars)
        self.now = np.zeros(n_envs)
        self.word = np.zeros(n_envs)
        self.heard = np.zeros(self.shape)
        self.linked = np.ones(self.shape, dtype=bool)
        self.out = None

    def tick(self, n=1, *, word=True, heard=True, fresh=True):
        for _ in range(n):
            self.now = self.now + TICK
            if word:
                self.word = self.now.copy()
            if heard:
                self.heard = np.repeat(self.now[:, None], self.shape[1], axis=1)
            if fresh:
                self.q.t[:] = self.now
                self.q.ranged[:] = self.now[:, None, None]
            self.out = self.gate.step(self.q, self.now, self.word, self.heard, self.linked)
        return self.out

    def arm(self):
        return self.gate.arm(self.now, np.ones(self.shape, dtype=bool))

    def drive(self):
        """Arm the cars and bring them to full speed."""
        self.tick(60)
        assert self.arm().all()
        self.tick(60)
        assert (self.out.speed > 0.5).all()
        return self
