"""`relpos warmup`."""

from __future__ import annotations

import click

from agents.console import emit_json, print_table, progress_bar


@click.command()
@click.option(
    "--filter",
    "filters",
    multiple=True,
    help="joint (default), ekf-mds, ekf, paper-ekf-mds, paper-ekf or all; may be given again.",
)
@click.option("--jobs", type=click.IntRange(1, 64), help="Processes; default: one for each core.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def warmup(filters: tuple[str, ...], jobs: int | None, as_json: bool) -> None:
    """Compile trackers ahead: for containers, CI and laptops before a demo.

    What is compiled is kept on the disk until the package, numba or the processor change.
    """
    from agents.warm_up import warm_up
    from tracking.filters import DEFAULT_FILTER, FILTERS

    names = tuple(dict.fromkeys(filters)) or (DEFAULT_FILTER,)
    if "all" in names:
        names = tuple(FILTERS)
    with progress_bar("compiling the tracker, once") as tell:
        found = warm_up(names, jobs=jobs, progress=tell)
    if as_json:
        emit_json([found.summary])
        return
    done = f"{found.n_compiled} of {found.n_kernels}"
    rows = [
        ["filters", ", ".join(found.filters)],
        ["kernels compiled now", done],
        ["time [s]", f"{found.seconds:.1f}"],
    ]
    print_table("Warm-up", ["", ""], rows)
