"""Conversion of device stamps to host time: unwrapping, fitting, slewing, detection of steps."""

from __future__ import annotations

from fractions import Fraction

from hardware_bridge.clocks.envelope import SHIFT, LowerEnvelope
from hardware_bridge.clocks.params import NS, ClockParams
from hardware_bridge.readings import DeviceClock

SHORTEST_PERIOD = 4.0
"""[s] Smallest period of a counter: rare delays of seconds must not look like a wrap."""

ENOUGH = 20
"""[-] Number of stamps needed for a settled fit, regardless of their time span."""

MILLION = 1_000_000


class DeviceTime:
    """Host times of one device's measurements by the stamps of its counter.

    Invariants:
        The counter is unwrapped exactly, across silences of any number of wraps, as long as drift
        times silence stays below half a period (32 bit microseconds: months; 40 bit radio ticks: 10
        hours).
        A mapped time is never after the arrival. A new stamp is not mapped before any earlier one;
        late or repeated stamps are mapped to their own time.
        Equal input gives equal output, to the last bit.
        Memory is bounded; the cost of a stamp does not depend on the length of the stream.

    The least delay of the link is unobservable: all mapped times are late by this constant.
    """

    steps: int
    """Number of times the device's clock was set or restarted, as detected from its stamps."""
    strays: int
    """Number of stamps that agreed with none before or after; mapped to their arrival."""

    def __init__(self, clock: DeviceClock, params: ClockParams | None = None) -> None:
        """Create a mapping without stamps.

        Args:
            clock: The counter.
            params: Limits of the clock and the link.

        Raises:
            ValueError: The counter wraps within four seconds, or has no positive rate.
        """
        params = ClockParams() if params is None else params
        if not (clock.hz > 0.0 and clock.modulus > SHORTEST_PERIOD * clock.hz):
            raise ValueError("clock: one that wraps after more than 4 s expected")
        hz = Fraction(clock.hz)
        self._modulus = clock.modulus
        # One tick is num / den nanoseconds, exactly.
        self._num, self._den = NS * hz.denominator, hz.numerator
        self._line = LowerEnvelope(params)
        self._window, self._settling = round(params.window * NS), round(params.settling * NS)
        self._stray, self._step = round(params.stray * NS), round(params.step * NS)
        self._patience, self._haste = (
            round(params.patience * NS),
            round(params.haste * NS / MILLION),
        )
        self._slew, self._drift = round(params.slew * MILLION), round(params.drift * MILLION)
        self.steps = self.strays = 0
        self._begun = False
        self._ticks = self._x = self._settled_at = self._fitted = 0
        self._mapped = 0
        self._arrival: int | None = None
        self._suspect: tuple[int, int] | None = None
        self._late_since: int | None = None

    @property
    def ticks(self) -> int:
        """Newest stamp, unwrapped, counted from the last 0 before the first stamp of this start."""
        return self._ticks

    @property
    def drift(self) -> float:
        """[-] Host seconds per device second, minus 1; positive if the device is slow."""
        return self._line.slope / (1 << SHIFT)

    def restart(self) -> None:
        """Handle a restart of the device and its counter; keep the rate."""
        self._begun = False

    def map(self, ticks: int | None, arrival_ns: int) -> int:
        """Return the host time of a measurement; see `StreamTime.map`."""
        if ticks is None:
            return arrival_ns
        before = arrival_ns if self._arrival is None else self._arrival
        arrival = max(arrival_ns, before)
        ticks %= self._modulus
        mapped = (
            self._follow(ticks, arrival, before) if self._begun else self._begin(ticks, arrival)
        )
        return min(mapped, arrival_ns)

    def _follow(self, ticks: int, arrival: int, before: int) -> int:
        """Map a stamp that follows others, the newest of which arrived at `before`."""
        unwrapped = self._unwrap(ticks, arrival)
        x = unwrapped * self._num // self._den
        old, ahead, silence = self._x - x, self._line.at(x) - arrival, arrival - before
        if silence > self._window:
            doubt = self._step + 2 * self._drift * silence // MILLION
            if old > self._step or abs(ahead) > doubt:
                return self._doubt(unwrapped, x, arrival)
            return self._learn(unwrapped, x, arrival)
        settled = self._is_settled(x)
        if old > self._step or ahead > (self._stray if settled else self._step):
            return self._doubt(unwrapped, x, arrival)
        self._acquit()
        if old >= 0:
            return self._mapped - old
        if ahead > -self._step:
            self._late_since = None
        elif self._late_since is None:
            self._late_since = arrival
        elif arrival - self._late_since > self._patience:
            self.steps += 1
            return self._begin(ticks, arrival)
        return self._accept(unwrapped, x, arrival)

    def _is_settled(self, x: int) -> bool:
        return x >= self._settled_at and self._fitted >= ENOUGH

    def _unwrap(self, ticks: int, arrival: int) -> int:
        """Return the unwrapped count nearest to the one the line predicts for this arrival."""
        expected = self._line.inverse(arrival) * self._den // self._num
        half = self._modulus // 2
        return ticks + (expected - ticks + half) // self._modulus * self._modulus

    def _begin(self, ticks: int, arrival: int) -> int:
        """Restart from this stamp alone; keep the rate."""
        self._begun = True
        return self._learn(ticks, ticks * self._num // self._den, arrival)

    def _learn(self, unwrapped: int, x: int, arrival: int) -> int:
        """Restart the fit at this stamp."""
        self._acquit()
        self._late_since = None
        self._line.start(x, arrival)
        self._settled_at, self._fitted = x + self._settling, 1
        self._ticks, self._x, self._mapped, self._arrival = unwrapped, x, arrival, arrival
        return arrival

    def _doubt(self, unwrapped: int, x: int, arrival: int) -> int:
        """Handle an implausible stamp: a second one in a row that agrees confirms it."""
        suspect, self._suspect = self._suspect, (unwrapped, arrival)
        if suspect is None:
            return arrival
        if not self._agree(suspect, unwrapped, arrival):
            self.strays += 1
            return arrival
        self._suspect = None
        if x > self._x and abs(self._line.at(x) - arrival) <= self._step:
            # The suspect stamp was mapped to its arrival: no later one may be mapped before it.
            self._mapped = max(self._accept(unwrapped, x, arrival), suspect[1])
            return self._mapped
        self.steps += 1
        return self._begin(unwrapped % self._modulus, arrival)

    def _acquit(self) -> None:
        """Count a suspect stamp as a stray, since the stamp after it is as expected."""
        if self._suspect is not None:
            self.strays += 1
            self._suspect = None

    def _agree(self, suspect: tuple[int, int], ticks: int, arrival: int) -> bool:
        """Return whether device and host measured the same interval, modulo the period."""
        passed = (arrival - suspect[1]) * self._den // self._num
        half = self._modulus // 2
        excess = (ticks - suspect[0] - passed + half) % self._modulus - half
        return abs(excess) * self._num < self._step * self._den

    def _accept(self, unwrapped: int, x: int, arrival: int) -> int:
        """Add a newer stamp to the fit and slew towards the fit at the allowed rate."""
        self._line.add(x, arrival)
        self._fitted += 1
        target = self._line.at(x)
        passed = target - self._line.at(self._x)
        error = target - self._mapped - passed
        if not self._is_settled(x):
            limit = passed // 2
        else:
            rate = max(self._slew, abs(error) // self._haste)
            limit = min(passed // 2, passed * rate // MILLION)
        mapped = self._mapped + passed + max(-limit, min(limit, error))
        self._ticks, self._x, self._arrival = unwrapped, x, arrival
        self._mapped = min(mapped, arrival)
        return self._mapped
