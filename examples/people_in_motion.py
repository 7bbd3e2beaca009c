"""The simulated person next to motion capture: accelerations, distances, hidden pairs.

Prints a table. With a path as argument it also draws the exercises as stick figures:

    python examples/people_in_motion.py people.svg
"""

import sys

import numpy as np

from relpos_env.people.clips import find_recordings, load_clips
from relpos_env.people.exercises import EXERCISES
from relpos_env.people.motion import SITES, BodyMotion
from relpos_env.people.procedural import procedural_body
from relpos_env.people.recorded import recorded_body
from relpos_env.sensors.radio._occlusion_kernels import crosses_capsule
from relpos_env.sensors.radio._path_kernels import SKIN

ROOM, STILL, DT = (3.0, 5.0), 2.0, 0.01
FIRST, SECOND = np.triu_indices(len(SITES), k=1)


def procedural(names, seed, seconds=60.0):
    return BodyMotion(procedural_body(names, ROOM, seconds, STILL, DT, np.random.default_rng(seed)))


def hidden_share(motion, t):
    """Share of pairs with the trunk or the head in between."""
    pos, limbs = motion.at(t).pos_w, motion.obstacles(t)
    hits = [
        any(crosses_capsule(*pos[k, i], *pos[k, j], limb, SKIN) for limb in limbs[k])
        for k in range(len(t))
        for i, j in zip(FIRST, SECOND, strict=True)
    ]
    return np.mean(hits)


def figures(motions):
    """Numbers of some runs: (row name, numbers)."""
    t = [np.arange(3.5, m.duration, DT) for m in motions]
    states = [m.at(times) for m, times in zip(motions, t, strict=True)]
    accel = np.concatenate([np.linalg.norm(s.accel_w, axis=-1) for s in states])
    rate = np.concatenate([np.linalg.norm(s.rate_b, axis=-1) for s in states])
    pos = np.concatenate([s.pos_w for s in states])
    apart = np.linalg.norm(pos[:, SECOND] - pos[:, FIRST], axis=-1)
    shares = [hidden_share(m, times[::20]) for m, times in zip(motions, t, strict=True)]
    rows = [
        (
            f"acceleration [m/s2], {site}: rms, 99 %, largest",
            f"{np.sqrt(np.mean(a**2)):.0f}, {np.quantile(a, 0.99):.0f}, {a.max():.0f}",
        )
        for site, a in zip(SITES, accel.T, strict=True)
    ]
    turning = ", ".join(f"{np.quantile(r, 0.99):.0f}" for r in rate.T)
    low, middle, high = np.quantile(apart, [0.05, 0.5, 0.95])
    return [
        *rows,
        ("angular rate [rad/s], 99 %, in the same order", turning),
        ("distance of a pair [m]: 5 %, 50 %, 95 %", f"{low:.2f}, {middle:.2f}, {high:.2f}"),
        ("pairs behind trunk or head", f"{100 * np.mean(shares):.0f} %"),
    ]


def print_table():
    columns = {name: [procedural((name,), seed) for seed in range(4)] for name in EXERCISES}
    columns["all three"] = [procedural(tuple(EXERCISES), seed, 120.0) for seed in range(4)]
    if find_recordings() is not None:
        rng = np.random.default_rng(0)
        columns["recorded"] = [BodyMotion(recorded_body(load_clips(), 240.0, STILL, DT, rng))]
    tables = [figures(motions) for motions in columns.values()]
    print("| | " + " | ".join(columns) + " |")
    print("|---|" + "--:|" * len(columns))
    for cells in zip(*tables, strict=True):
        print(f"| {cells[0][0]} | " + " | ".join(cell[1] for cell in cells) + " |")


SHOTS = {
    "walking": (1, 5.0 + 0.28 * np.arange(5), 0.62, 1.2),
    "jumping-jacks": (2, 2.42 + 0.11 * np.arange(4), 1.3, 0.0),
    "squats": (0, 2.3 + 0.26 * np.arange(5), 0.74, 0.9),
}
"""Seed, times [s], distance between figures [m], and how far they turn to their left [rad]."""
COLOURS = ("#dc2626", "#d97706", "#16a34a", "#0891b2", "#2563eb", "#9333ea")


def seen(points, limbs, turn):
    """Points as seen from in front of the person, who has turned; (..., 2) [m]."""
    left = limbs[3, :2] - limbs[2, :2]  # from one hip to the other
    left = left / np.linalg.norm(left)
    right = np.cos(turn) * left + np.sin(turn) * np.array([left[1], -left[0]])
    return np.stack([(points[..., :2] - limbs[0, :2]) @ right, points[..., 2]], axis=-1)


def draw(path):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 2.9), layout="constrained")
    widths = [1.3 + apart * (len(t) - 1) for _, t, apart, _ in SHOTS.values()]
    axes = figure.subplots(1, 3, width_ratios=widths)
    for ax, width, (name, (seed, times, apart, turn)) in zip(
        axes, widths, SHOTS.items(), strict=True
    ):
        motion = procedural((name,), seed, 30.0)
        state, limbs = motion.at(times), motion.limbs(times)
        ax.set(xlim=(-0.6, width - 0.6), ylim=(-0.03, 2.15), aspect="equal", title=name)
        ax.axis("off")
        ax.axhline(0.0, color="#94a3b8", lw=1.0)
        figure.draw_without_rendering()
        metre = 72.0 * ax.get_window_extent().height / figure.dpi / 2.18
        for k in range(len(times)):
            place = np.array([apart * k, 0.0])
            for limb in limbs[k]:
                ends = seen(limb[:6].reshape(2, 3), limbs[k], turn) + place
                look = {"lw": 2.0 * limb[6] * metre, "solid_capstyle": "round"}
                ax.plot(*ends.T, color="#64748b", alpha=0.3, **look)
            dots = seen(state.pos_w[k], limbs[k], turn) + place
            for site, (x, z) in zip(SITES, dots, strict=True):
                colour = COLOURS[SITES.index(site)]
                ax.plot(x, z, "o", color=colour, ms=5, label=site if k == 0 else None)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, frameon=False)
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    print_table()
    if len(sys.argv) > 1:
        draw(sys.argv[1])
