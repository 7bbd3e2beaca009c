"""`relpos sniff`."""

from __future__ import annotations

import click

from agents.cli.console import emit_json
from agents.cli.options import json_option
from agents.errors import UsageError


@click.command()
@click.argument("port")
@click.option("--format", "format", help="Serial format.  [default: detected]")
@click.option("--baud", type=int, help="Baud rate.  [default: that of the format, else 115200]")
@click.option("--seconds", type=float, help="Time to listen [s].  [default: until Ctrl-C]")
@click.option("--key", help="Key of signed formats: 32 hex digits, or @FILE.")
@click.option("--raw", is_flag=True, help="Print the bytes in hex.")
@json_option
def sniff(
    port: str,
    format: str | None,
    baud: int | None,
    seconds: float | None,
    key: str | None,
    raw: bool,
    as_json: bool,
) -> None:
    """Show the readings of a device at PORT; only --format rplidar sends a request to it.

    PORT is a path, serial:NUMBER, tcp:host:port or file:path.
    """
    from agents.hardware.inspection.sniff import as_line, as_record
    from agents.hardware.inspection.sniff import sniff as run
    from hardware_bridge.links.link_state import LinkNotice
    from hardware_bridge.links.ports import Chunk
    from hardware_bridge.readings import Reading

    def show(t: float, reading: Reading) -> None:
        if as_json:
            emit_json([as_record(t, reading)])
        else:
            click.echo(as_line(t, reading))

    def show_chunk(t: float, chunk: Chunk) -> None:
        if as_json:
            emit_json([{"kind": "bytes", "t_s": round(t, 6), "hex": chunk.data.hex()}])
        else:
            click.echo(f"{t:9.3f}  {len(chunk.data):4d}  {chunk.data.hex(' ')}")

    def show_notice(notice: LinkNotice) -> None:
        click.echo(f"{port}: {'back' if notice.up else notice.reason}", err=True)

    sniffed = run(
        port,
        format=format,
        baud=baud,
        seconds=seconds,
        key=_key(key),
        show=None if raw else show,
        show_chunk=show_chunk if raw else None,
        show_notice=show_notice,
    )
    if as_json:
        emit_json([sniffed.record])
        return
    fits = f"sends {sniffed.format}, " if sniffed.format is not None else "no format fits, "
    click.echo(
        f"{port}: {fits}{sniffed.n_bytes} bytes in {sniffed.seconds:.1f} s, "
        f"{sniffed.readings} readings in {sniffed.frames} frames, {sniffed.damaged} damaged, "
        f"{sniffed.skipped} skipped, {sniffed.strange} bytes between frames"
    )


def _key(text: str | None) -> bytes | None:
    from hardware_bridge.wire.key import read_key

    try:
        return read_key(text)
    except ValueError as error:
        raise UsageError(f"--key: {error}") from error
