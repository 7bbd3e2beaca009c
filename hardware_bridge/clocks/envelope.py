"""Lower envelope of arrivals: offset and rate of a device's clock relative to the host's.

A message that was stamped x by the device arrives at

    y = a + (1 + s) x + d,   d >= 0

with offset a, rate error s and a delay d that is often small, sometimes large, never negative.
Of all lines below the points of a window the one with the least sum of distances to them is used:
the edge, above the middle of the window, of their lower convex hull [1]. In each time bucket only
the point nearest to the line is kept, a minimum filter as in [2].

All numbers are integers: nanoseconds, and the slope in units of 2^-40. Equal input gives equal bits
on every machine and after any run time.

References:
    [1] Zhang, Liu, Xia, Clock Synchronization Algorithms for Network Measurements, INFOCOM 2002.
    [2] Mills, RFC 5905 Network Time Protocol Version 4, section 10 (clock filter).
"""

from __future__ import annotations

from collections import deque

from hardware_bridge.clocks.params import NS, ClockParams

SHIFT = 40

Point = tuple[int, int]


class LowerEnvelope:
    """Sliding window of points (device time, arrival) [ns] and the line below them."""

    slope: int
    """[2^-40] Host seconds per device second, minus 1."""

    def __init__(self, params: ClockParams) -> None:
        self._window = round(params.window * NS)
        self._bucket = round(params.bucket * NS)
        self._steepest = int(params.drift * (1 << SHIFT))
        self.slope = 0
        self._x0 = 0
        self._y0 = 0
        self._kept: deque[Point] = deque()
        self._best: Point = (0, 0)

    def start(self, x: int, y: int) -> None:
        """Discard all points except this one; keep the slope."""
        self._kept.clear()
        self._best = self._x0, self._y0 = x, y

    def at(self, x: int) -> int:
        """Return the arrival [ns] of a least delayed message stamped x [ns]."""
        dx = x - self._x0
        return self._y0 + dx + (dx * self.slope >> SHIFT)

    def inverse(self, y: int) -> int:
        """Return the stamp [ns] of a least delayed message that arrives at y [ns]."""
        return self._x0 + ((y - self._y0) << SHIFT) // ((1 << SHIFT) + self.slope)

    def add(self, x: int, y: int) -> None:
        """Add a point newer than all others; the line stays below it."""
        if x // self._bucket != self._best[0] // self._bucket:
            self._kept.append(self._best)
            while self._kept[0][0] < x - self._window:
                self._kept.popleft()
                if not self._kept:
                    self.start(x, y)
                    return
            self._fit()
            self._best = x, y
        elif y - self.at(x) < self._best[1] - self.at(self._best[0]):
            self._best = x, y
        self._y0 -= max(0, self.at(x) - y)

    def _fit(self) -> None:
        """Fit the best line below the kept points, at most window / bucket + 1."""
        self._x0 = self._kept[-1][0]
        if len(self._kept) > 1:
            left, right = self._middle_edge()
            dx = right[0] - left[0]
            slope = ((right[1] - left[1] - dx) << SHIFT) // dx
            self.slope = max(-self._steepest, min(self._steepest, slope))
        self._y0 = 0
        self._y0 = min(y - self.at(x) for x, y in self._kept)

    def _middle_edge(self) -> tuple[Point, Point]:
        """Return the edge of the lower hull above the middle of the window."""
        hull: list[Point] = []
        for point in self._kept:
            while len(hull) > 1 and _is_above(hull[-1], hull[-2], point):
                hull.pop()
            hull.append(point)
        middle = (hull[0][0] + hull[-1][0]) // 2
        k = 1
        while hull[k][0] < middle:
            k += 1
        return hull[k - 1], hull[k]


def _is_above(point: Point, left: Point, right: Point) -> bool:
    """Return whether a point is on or above the line from left to right."""
    dx, dy = right[0] - left[0], right[1] - left[1]
    return (point[1] - left[1]) * dx >= (point[0] - left[0]) * dy
