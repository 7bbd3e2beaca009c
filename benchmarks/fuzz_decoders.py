"""Coverage-guided fuzzing of the decoders.

pip install atheris
python benchmarks/fuzz_decoders.py FORMAT --seconds 120 --corpus DIR  any format of the registry
python benchmarks/fuzz_decoders.py FORMAT --replay --corpus DIR  lines that the corpus reaches

The initial corpus contains the frames and tokens of tests/hardware_bridge/decoder_samples.py. Every
input is fed whole and split. Invariants: both give the same readings, nothing raises, the buffer
stays within its limit, and the second of two valid frames after the input is decoded. For formats
with a checksum, which random inputs rarely match, the input is also fed with a valid checksum; for
our own nodes, as a COBS frame with MAC and checksum. Kernels run as plain Python, so that their
branches count as coverage. Inputs that violate an invariant are written as files ``crash-...``.
"""

from __future__ import annotations

import argparse
import dis
import inspect
import os
import sys
import warnings
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
MOST_FRAME = 500
"""[byte] Longest message of a frame without MAC and checksum."""
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "hardware_bridge")]
FOLDERS = [ROOT / "hardware_bridge" / name for name in ("decoders", "wire")]
os.environ["NUMBA_DISABLE_JIT"] = "1"
warnings.filterwarnings("ignore", "overflow encountered", RuntimeWarning)  # hashes overflow


def plain(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap an uncompiled kernel: views of structured arrays as recarrays, for attribute access."""
    import numpy as np

    def call(*arrays: Any) -> Any:
        return kernel(*(a.view(np.recarray) if hasattr(a, "dtype") and a.dtype.names else a
                        for a in arrays))  # fmt: skip

    return call


def check_of(name: str) -> Callable[[bytes], None]:
    """Return a function that asserts the invariants of a decoder for one input."""
    from hardware_bridge.decoders import DECODERS
    from hardware_bridge.decoders.base import MOST_WAITING
    from hardware_bridge.wire.codec import kernels

    for kernel in ("encode_frames", "decode_frames"):
        setattr(kernels, kernel, plain(getattr(kernels, kernel)))
    from decoder_samples import SAMPLES, decoder_of

    unit = SAMPLES[name].unit
    alone = decoder_of(name).feed(unit)

    def check(data: bytes) -> None:
        obeys(data)
        if name == "relpos":
            obeys(framed(data[:MOST_FRAME]))
        elif DECODERS[name].checked:
            obeys(data + bytes((sum(data) & 0xFF,)))

    def obeys(data: bytes) -> None:
        whole, cut = decoder_of(name), decoder_of(name)
        at = data[0] % len(data) if data else 0
        readings = whole.feed(data)
        assert cut.feed(data[:at]) + cut.feed(data[at:]) == readings
        assert cut.counts == whole.counts
        assert whole.waiting <= MOST_WAITING
        whole.feed(unit)
        assert set(alone) <= set(whole.feed(unit))

    return check


def framed(data: bytes) -> bytes:
    """Return a message as a frame of our own nodes, with MAC, checksum and COBS."""
    from cobs import cobs
    from wire_twin import KEY, siphash

    signed = data + siphash(data, KEY).to_bytes(8, "little")
    stuffed: bytes = cobs.encode(signed + zlib.crc32(signed).to_bytes(4, "little"))
    return b"\0" + stuffed + b"\0"


def unframed(frame: bytes) -> bytes:
    """Return the message of a frame with MAC and checksum."""
    from cobs import cobs

    message: bytes = cobs.decode(frame.strip(b"\0"))[:-12]
    return message


def fuzz(name: str, corpus: Path, seconds: int) -> None:
    """Run libFuzzer, which exits the process."""
    import atheris

    with atheris.instrument_imports(include=["hardware_bridge.decoders", "hardware_bridge.wire"]):
        check = check_of(name)
    from decoder_samples import SAMPLES

    sample = SAMPLES[name]
    corpus.mkdir(parents=True, exist_ok=True)
    too_long = b"[" * 2000 + sample.end + sample.unit
    begin = [too_long, *sample.all_frames]
    if name == "relpos":
        begin += [unframed(frame) for frame in sample.all_frames]
    for k, seed in enumerate(begin):
        (corpus / f"seed-{k}").write_bytes(seed)
    words = corpus.with_suffix(".dict")
    quoted = ("".join(f"\\x{b:02x}" for b in word) for word in sample.tokens if len(word) < 64)
    words.write_text("".join(f'"{word}"\n' for word in quoted))
    options = [
        f"-max_total_time={seconds}",
        "-max_len=4096",
        f"-dict={words}",
        "-print_final_stats=1",
    ]
    atheris.Setup(
        [sys.argv[0], str(corpus), *options, f"-artifact_prefix={corpus}/"],
        check,
    )
    atheris.Fuzz()


def lines_of(code: CodeType) -> Iterator[int]:
    """Yield the line numbers of all functions in a code object."""
    if code.co_flags & inspect.CO_OPTIMIZED:
        yield from (line for _, line in dis.findlinestarts(code) if line is not None)
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from lines_of(inner)


def replay(name: str, corpus: Path) -> None:
    """Print the line coverage of each decoder file by the inputs of a corpus."""
    ran: dict[str, set[int]] = {}

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        path = frame.f_code.co_filename
        if not path.startswith(tuple(map(str, FOLDERS))):
            return None
        ran.setdefault(path, set()).add(frame.f_lineno)
        return trace

    files = sorted(p for p in corpus.iterdir() if p.is_file())
    check = check_of(name)
    sys.settrace(trace)
    for file in files:
        check(file.read_bytes())
    sys.settrace(None)
    print(f"{name}: {len(files)} inputs")
    for path, lines in sorted(ran.items()):
        text = Path(path).read_text()
        all_lines = set(lines_of(compile(text, path, "exec")))
        missed = sorted(all_lines - lines)
        reached = len(all_lines) - len(missed)
        print(f"  {Path(path).name}: {reached} of {len(all_lines)} lines, missed {missed}")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("format")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("--replay", action="store_true")
    options = parser.parse_args()
    corpus = options.corpus / options.format
    if options.replay:
        replay(options.format, corpus)
    else:
        fuzz(options.format, corpus, options.seconds)


if __name__ == "__main__":
    main()
