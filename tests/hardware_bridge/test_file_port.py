"""Files as ports: every byte once, from the start, while the file is not replaced."""

import random
import time

import pytest
from terminals import until

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.links.ports import PortSpec

NOW = time.monotonic_ns


def spec(path, name="links.a"):
    return PortSpec(name=name, port=f"file:{path}")


def size(chunks):
    return sum(len(c.data) for c in chunks)


def test_a_file_is_read_from_its_start_and_followed(tmp_path):
    path, rng = tmp_path / "p.jsonl", random.Random(3)
    sent = rng.randbytes(300_000)  # more than a pipe holds
    path.write_bytes(sent)
    with Links([spec(path)], NOW) as links, path.open("ab") as file:
        chunks = until(links, lambda c: size(c) >= len(sent))
        for _ in range(5):
            more = rng.randbytes(rng.randint(1, 3000))
            file.write(more)
            file.flush()
            sent += more
            n = len(more)
            chunks += until(links, lambda c, n=n: size(c) >= n)
        assert links.wait(0.05) == []
        assert b"".join(c.data for c in chunks) == sent
        assert links.is_up("links.a")
        assert not links.send("links.a", b"no")


def test_a_file_that_became_shorter_is_read_anew(tmp_path):
    path = tmp_path / "p.jsonl"
    path.write_bytes(b"one two\n")
    with Links([spec(path)], NOW) as links:
        until(links, lambda c: size(c) == 8)
        path.write_bytes(b"3\n")
        assert b"".join(c.data for c in until(links, bool)) == b"3\n"
        reasons = [n.reason for n in links.drain_notices() if not n.up]
        assert reasons == ["the file became shorter"]


def test_a_file_that_was_replaced_is_read_anew(tmp_path):
    path, new = tmp_path / "p.jsonl", tmp_path / "new"
    path.write_bytes(b"one\n")
    with Links([spec(path)], NOW) as links:
        until(links, lambda c: size(c) == 4)
        new.write_bytes(b"another, longer\n")
        new.replace(path)
        assert b"".join(c.data for c in until(links, bool)) == b"another, longer\n"
        assert "the file was replaced" in [n.reason for n in links.drain_notices()]


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(BridgeError, match=r"links.a: cannot open the file .*not there"):
        Links([spec(tmp_path / "none")], NOW)
    with pytest.raises(BridgeError, match=r"links.a: .* is no file"):
        Links([spec(tmp_path)], NOW)


def test_a_file_is_the_port_of_one_link(tmp_path):
    (tmp_path / "p").write_bytes(b"")
    with pytest.raises(BridgeError, match="is the port of links.a too"):
        Links([spec(tmp_path / "p"), spec(f"{tmp_path}/./p", "links.b")], NOW)


def test_closing_waits_for_nobody_who_reads(tmp_path):
    path = tmp_path / "p"
    path.write_bytes(bytes(300_000))
    links = Links([spec(path)], NOW)
    links.close()
    links.close()
