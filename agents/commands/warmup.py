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
    found = []
    for name in names:
        with progress_bar(f"compiling {name}, once") as tell:
            found.append(warm_up(name, jobs=jobs, progress=tell))
    if as_json:
        emit_json(each.summary for each in found)
        return
    rows = [
        [each.filter, f"{each.n_compiled} of {each.n_kernels}", f"{each.seconds:.1f}"]
        for each in found
    ]
    print_table("Compiled now", ["filter", "kernels", "time [s]"], rows)
