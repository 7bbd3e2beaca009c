"""Simulated ranges next to real ones: same distances, same share behind an obstacle.

The real ones are those that the channel `OUTDOOR` was fitted to; they are not part of the
project. With a path as argument, the picture of `docs/explanation/simulator.md` is saved there.
"""

import os
import sys
from pathlib import Path

import numpy as np

from relpos_env.sensors.radio.channel import OUTDOOR
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.sensors.radio.radio import Radio

DT = 0.01
SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
QUANTITIES = ("range error [m]", "received power [dBm]", "power gap [dB]")


def find_data():
    named = os.environ.get("RELPOS_DATA")
    folder = Path(named) if named else Path(__file__).resolve().parents[2] / "shared" / "data"
    path = folder / "uwb_error" / "outdoor_static_hanyang.csv.gz"
    return path if path.exists() else None


def load(path):
    """The real rows: whether behind an obstacle, place, and the three quantities; the places."""
    rows = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1, 2, 4, 5, 6))
    rows = rows[np.isfinite(rows).all(axis=1)]
    los, distance, measured, height, power, first_path = rows.T
    values = np.stack([measured - distance, power, power - first_path], axis=1)
    places, place = np.unique(np.stack([los, distance, height], 1), axis=0, return_inverse=True)
    return los == 0, place, values, places[:, 1], places[:, 0] == 0


def simulate(channel, distance, nlos, seconds=0.5, seed=0):
    """Simulate two static nodes at each place, one environment per place.

    Returns:
        Place, time [s] and the three quantities of every range.
    """
    n = len(distance)
    radio = Radio(RadioSimParams(channel=channel), 2, list(range(seed, seed + n)), DT)
    for k in range(n):
        radio.switch_on(k, 0, boot=1)
        radio.switch_on(k, 1, boot=2, after=0.002)
    pos = np.zeros((n, 2, 3))
    pos[:, 1, 0] = distance
    boxes = np.zeros((n, 1, 6))  # halfway between the nodes, or 50 m to the side
    boxes[:, 0] = [0.0, 0.0, 0.2, 0.2, 1.0, 0.0]
    boxes[:, 0, 0], boxes[:, 0, 1] = 0.5 * np.asarray(distance), np.where(nlos, 0.0, 50.0)
    found = []
    for _ in range(round((0.2 + seconds) / DT)):  # they need 0.2 s to find each other
        ranges = radio.step(pos, pos, boxes)
        k, slot = np.nonzero(np.arange(ranges.t.shape[1]) < ranges.count[:, None])
        measured, power, first_path = ranges.values[k, slot].T
        values = np.stack([measured - pos[k, 1, 0], power, power - first_path], axis=1)
        found.append((k, ranges.t[k, slot], values))
    place, t, values = (np.concatenate(part) for part in zip(*found, strict=True))
    settled = t >= 0.2
    return place[settled], t[settled], values[settled]


def compare(path, copies=8):
    """Real and simulated values by quantity and class; every place as often as it was measured."""
    behind, place, real, distance, nlos = load(path)
    many, hidden = np.tile(distance, copies), np.tile(nlos, copies)
    channel = OUTDOOR
    where, _, values = simulate(channel, many, hidden)
    weight = np.bincount(place)[where % len(distance)] / np.bincount(where)[where]
    return {
        (name, label): (
            real[behind == label, k],
            values[hidden[where] == label, k],
            weight[hidden[where] == label],
        )
        for k, name in enumerate(QUANTITIES)
        for label in (False, True)
    }


def distance_of_distributions(real, simulated, weight):
    """The statistic of Kolmogorov and Smirnov."""
    order = np.argsort(simulated)
    share = np.concatenate([[0.0], np.cumsum(weight[order]) / weight.sum()])
    at = np.unique(np.concatenate([real, simulated]))
    of_real = np.searchsorted(np.sort(real), at, side="right") / len(real)
    return np.abs(of_real - share[np.searchsorted(simulated[order], at, side="right")]).max()


def quantiles(values, weight=None):
    return np.quantile(values, SHARES, method="inverted_cdf", weights=weight)


def print_table(tables):
    print(f"{'':32}" + "".join(f"{100 * share:7.0f} %" for share in SHARES) + "       KS")
    for (name, label), (real, simulated, weight) in tables.items():
        where = "behind" if label else "in sight"
        ks = distance_of_distributions(real, simulated, weight)
        for source, row in (("real", quantiles(real)), ("sim", quantiles(simulated, weight))):
            cells = "".join(f"{value:9.2f}" for value in row)
            print(f"{name:21}{where:9}{source:>4}" + cells + (f"{ks:9.3f}" * (source == "sim")))


def save_picture(tables, path):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.7), layout="constrained")
    spans = ((-0.15, 0.55), (-98.0, -77.0), (-1.5, 5.0))
    steps = (0.0188, 0.4, 0.125)  # the real ranges come in steps of 1.88 cm
    for ax, name, span, step in zip(figure.subplots(1, 3), QUANTITIES, spans, steps, strict=True):
        bins = np.arange(span[0], span[1] + step, step)
        for label, colour in ((False, "#2563eb"), (True, "#d97706")):
            real, simulated, weight = tables[name, label]
            where = "behind an obstacle" if label else "in sight"
            look = {"bins": bins, "density": True, "color": colour}
            ax.hist(real, alpha=0.3, label=f"real, {where}", **look)
            ax.hist(
                simulated, weights=weight, histtype="step", lw=1.6, label=f"simulated, {where}",
                **look,
            )  # fmt: skip
        ax.set(xlabel=name, xlim=span, yticks=[])
        ax.spines[["top", "right", "left"]].set_visible(False)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, frameon=False)
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    data = find_data()
    if data is None:
        print("no real ranges here: set RELPOS_DATA to a folder with uwb_error/")
        sys.exit()
    result = compare(data)
    print_table(result)
    if len(sys.argv) > 1:
        save_picture(result, sys.argv[1])
