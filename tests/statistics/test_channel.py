"""What the air does to messages, against real ranges, published figures and its own laws."""

import itertools
from dataclasses import replace
from runpy import run_path

import numpy as np
import pytest
from conftest import ROOT
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.stats import kstest

from relpos_env.sensors._air_kernels import hear_message, make_nodes, next_window
from relpos_env.sensors._air_state import LATENT, NODE, RECEPTION, make_channel
from relpos_env.sensors._channel_kernels import KNOT
from relpos_env.sensors._occlusion_kernels import crosses_box, crosses_capsule
from relpos_env.sensors._path_kernels import read_clock
from relpos_env.sensors._random_kernels import draw_key, normal_pair, uniform
from relpos_env.sensors.channel import CALIBRATED, EXACT, HALL, INDOOR, OUTDOOR
from relpos_env.sensors.radio import Radio
from relpos_env.sensors.radio_params import RadioSimParams
from tracking.ranging.timestamps import SPEED_OF_LIGHT

EXAMPLE = run_path(str(ROOT / "examples" / "channel_against_data.py"))
simulate = EXAMPLE["simulate"]
IN_SIGHT, BEHIND = False, True


def standing(channel, nlos, pairs, distance=4.0, seconds=0.02):
    """Pairs that stand in as many places; the same of all in sight and behind an obstacle."""
    return simulate(channel, np.full(pairs, distance), np.full(pairs, nlos), seconds)


def first_of_each(channel, nlos, pairs=4000):
    """One range of every pair: rows of independent (error, received power, gap)."""
    place, _, values = standing(channel, nlos, pairs, seconds=0.05)
    return values[np.unique(place, return_index=True)[1]]


def circling(channel, speed, seconds, pairs, radius=5.0, dt=0.01):
    """One node goes round the other: (way [m], error [m]) of the ranges of every pair."""
    radio = Radio(RadioSimParams(channel=channel), 2, list(range(pairs)), dt)
    for k, node in itertools.product(range(pairs), range(2)):
        radio.switch_on(k, node, boot=node, after=0.002 * node)

    def where(t):
        angle = speed * t / radius
        pos = np.zeros((pairs, 2, 3))
        pos[:, 1, :2] = radius * np.cos(angle), radius * np.sin(angle)
        return pos

    way, error, pair = [], [], []
    for w in range(round(seconds / dt)):
        ranges = radio.step(where(w * dt), where((w + 1) * dt))
        k, slot = np.nonzero(np.arange(ranges.t.shape[1]) < ranges.count[:, None])
        t = ranges.t[k, slot]
        # Nodes go straight within a window.
        share = np.clip(t / dt - w, -1.0, 1.0) % 1.0
        chord = 2.0 * radius * np.sin(0.5 * speed * dt / radius)
        true = np.sqrt(radius**2 - share * (1.0 - share) * chord**2)
        way.append(speed * t)
        error.append(ranges.values[k, slot, 0] - true)
        pair.append(k)
    way, error, pair = map(np.concatenate, (way, error, pair))
    return [(way[pair == k], error[pair == k]) for k in range(pairs)]


def autocorrelation(tracks, lag, width):
    """Of errors whose ways differ by so much, over all tracks."""
    mean = np.mean(np.concatenate([error for _, error in tracks]))
    square = np.mean(np.concatenate([error for _, error in tracks]) ** 2) - mean**2
    total, count = 0.0, 0
    for way, error in tracks:
        a, b = np.nonzero(np.abs(way[None] - way[:, None] - lag) < width)
        keep = a != b
        total += np.sum((error[a] - mean)[keep] * (error[b] - mean)[keep])
        count += keep.sum()
    return total / count / square


class Line:
    """Nodes and the messages between them, one by one, as `relpos_env.sensors.air` does it."""

    def __init__(self, channel, pos, seed=1, clock_offset=0.0):
        n = len(pos)
        self.channel, self.seed = make_channel(channel, KNOT), np.uint64(seed)
        self.nodes, self.heard = np.zeros(n, dtype=NODE), np.zeros(n, dtype=RECEPTION)
        self.latents = np.zeros((n, n), dtype=LATENT)
        self.latents["knot"] = -1
        make_nodes(self.nodes, self.seed, clock_offset, 0.0)
        self.pos, self.dt, self.window = np.array(pos, dtype=np.float64), 0.01, 0

    def move(self, pos):
        """Go to other places in one window."""
        pos = np.array(pos, dtype=np.float64)
        self.nodes["step"] = np.linalg.norm(pos - self.pos, axis=1)
        next_window(self.nodes, self.seed, self.window, 0.0, self.dt)
        self.window += 1
        self.pos, self.nodes["step"] = pos, 0.0

    def send(self, s, r, boxes=(), capsules=(), t=0.0):
        """What r hears of a message of s at a time in the window, None if nothing."""
        boxes = np.array(boxes, dtype=np.float64).reshape(-1, 6)
        capsules = np.array(capsules, dtype=np.float64).reshape(-1, 7)
        heard = hear_message(
            self.channel, self.latents, self.seed, self.nodes, s, r, t,
            (self.pos, self.pos, self.dt), boxes, capsules, self.heard,
        )  # fmt: skip
        self.nodes["sent"][s] += 1
        return self.heard[r].copy() if heard else None

    def flown(self, r, heard):
        """Distance that a stamp of a message sent at time 0 means, with a perfect clock [m]."""

        node = self.nodes[r]
        ticks = float(heard["stamp"] - node["base"]) - node["frac"]
        return ticks / node["rate"] * SPEED_OF_LIGHT


# Real ranges


def test_the_outdoor_channel_is_that_of_the_real_ranges(data):
    tables = EXAMPLE["compare"](EXAMPLE["find_data"]() or data)
    for (name, label), (real, simulated, weight) in tables.items():
        off = EXAMPLE["quantiles"](simulated, weight) - EXAMPLE["quantiles"](real)
        print(name, label, np.round(off, 3))
