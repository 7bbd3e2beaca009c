"""Feed every decoder with a million damaged chunks, and measure undetected damage.

python tests/hardware_bridge/fuzz_decoders.py [--chunks 1000000] [--trials 200000] [FORMAT ...]

Prints two tables in Markdown, those of docs/reference/decoders.md. The cells of the second have
three numbers: readings that differ from the sent ones, without the bounds of
`hardware_bridge.decoders.plausible`; the same with them; and of these the ones with a wrong
distance to a known device.
"""

import argparse
from contextlib import ExitStack, contextmanager
from unittest import mock

from decoder_damage import DAMAGES, fuzz, wrongly_accepted

from hardware_bridge.decoders import DECODERS, dw1000, dwm1001, linktrack, uwb_core


@contextmanager
def without_bounds():
    """Disable the bounds of distance and power."""
    with ExitStack() as stack:
        for module in (dw1000, dwm1001, linktrack, uwb_core):
            for bound in ("distance", "power"):
                if hasattr(module, bound):
                    stack.enter_context(mock.patch.object(module, bound, lambda v, *_: v))
        yield


def fuzz_table(names, chunks):
    """Print the results of `fuzz`."""
    print("| format | chunks | bytes | readings | most bytes waiting | asked | out of step |")
    print("|---|--:|--:|--:|--:|--:|--:|")
    for name in names:
        f = fuzz(name, chunks)
        cells = (f.chunks, f.n_bytes, f.readings, f.most_waiting, f.checks, f.out_of_step)
        print(
            f"| `{name}` |", " | ".join(f"{c:,}".replace(",", " ") for c in cells), "|", flush=True
        )


def damage_table(names, trials):
    """Print the percentage of damaged frames that give a reading that was not sent."""
    print("| format | " + " | ".join(DAMAGES) + " |")
    print("|---|" + "--:|" * len(DAMAGES))
    for name in names:
        cells = []
        for kind in DAMAGES:
            with without_bounds():
                free, _ = wrongly_accepted(name, kind, trials)
            wrong, far = wrongly_accepted(name, kind, trials)
            cells.append(" / ".join(f"{100 * n / trials:.3g}" for n in (free, wrong, far)))
        print(f"| `{name}` |", " | ".join(cells), "|", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("formats", nargs="*", default=list(DECODERS))
    parser.add_argument("--chunks", type=int, default=1_000_000)
    parser.add_argument("--trials", type=int, default=200_000)
    options = parser.parse_args()
    names = options.formats
    fuzz_table(names, options.chunks)
    print()
    damage_table(names, options.trials)


if __name__ == "__main__":
    main()
