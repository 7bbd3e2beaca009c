"""Several ports at once: received bytes, detection of losses, reopening of lost ports."""

from __future__ import annotations

import contextlib
import selectors
from collections.abc import Callable, Sequence

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.failures import lost_by, reason_of
from hardware_bridge.links.link_state import ASK_AGAIN, LinkNotice, LinkState, check_distinct
from hardware_bridge.links.opener import Opener, OpenPort, open_port
from hardware_bridge.links.ports import Chunk, PortSpec
from hardware_bridge.links.stream import Port

LINGER = 0.1
"""[s] Time for written bytes to be sent when all ports are closed."""


class Links:
    """The ports of one process, used by one thread.

    Invariants: no byte is lost or duplicated while a port is up; failures of one port do not affect
    the others; nothing is sent except messages passed to `send` since the port came up, and the
    port's own request, when it comes up and while the device is silent.
    """

    def __init__(
        self,
        specs: Sequence[PortSpec],
        now_ns: Callable[[], int],
        *,
        wait_for_ports: bool = False,
        open_port: OpenPort = open_port,
    ) -> None:
        """Open all ports.

        Args:
            specs: The ports, with distinct names.
            now_ns: The host's monotonic clock [ns].
            wait_for_ports: True to retry ports that cannot be opened; False to raise an error.
            open_port: Function that opens a port.

        Raises:
            BridgeError: A port cannot be opened, or two links have the same name or device.
        """
        check_distinct(specs)
        self._now_ns = now_ns
        self._opener = Opener(open_port)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._opener.fileno(), selectors.EVENT_READ)
        self._links = {spec.name: LinkState(spec, now_ns()) for spec in specs}
        self._by_fd: dict[int, LinkState] = {}
        self._notices: list[LinkNotice] = []
        for link in self._links.values():
            try:
                self._take(link, open_port(link.spec))
            except Exception as error:
                if not wait_for_ports:
                    self.close()
                    raise (
                        error
                        if isinstance(error, BridgeError)
                        else BridgeError(f"{link.spec.name}: {reason_of(error)}")
                    ) from error
                self._failed(link, error)

    def wait(self, timeout: float) -> list[Chunk]:
        """Wait for bytes, a loss or a reopened port, and return the received bytes.

        Args:
            timeout: Longest wait [s]; the call may return earlier without bytes.

        Returns:
            At most one chunk per link, stamped right after it was read.
        """
        self._retry()
        for each in self._links.values():
            if each.spec.request and self._now_ns() - each.asked_ns >= ASK_AGAIN:
                self._request(each)
        chunks, opened = [], False
        for key, events in self._selector.select(self._patience(timeout)):
            link = self._by_fd.get(key.fd)
            if link is None:
                opened |= key.fd == self._opener.fileno()
                continue
            if events & selectors.EVENT_READ:
                chunk = self._read(link)
                if chunk is not None:
                    chunks.append(chunk)
            if events & selectors.EVENT_WRITE:
                self._guarded(link, self._flush)
        if opened:
            self._take_opened()
        return chunks

    def send(self, name: str, data: bytes) -> bool:
        """Send a message at once or not at all.

        Returns:
            False if the link is down or earlier bytes are still pending; `data` is then discarded.
        """
        link = self._links[name]
        if link.port is None:
            return False
        port = link.port
        try:
            taken = port.write(data)
        except Exception as error:
            self._lose(link, error)
            return False
        self._guarded(link, self._flush)
        return taken

    def watch(self, fd: int) -> None:
        """Make `wait` return when `fd`, which the caller owns, is readable."""
        self._selector.register(fd, selectors.EVENT_READ)

    def unwatch(self, fd: int) -> None:
        """Undo `watch`; to be called before `fd` is closed."""
        self._selector.unregister(fd)

    def is_up(self, name: str) -> bool:
        """Return whether the port is open."""
        return self._links[name].port is not None

    def since_ns(self, name: str) -> int:
        """Return the time at which the link came up or went down [ns]."""
        return self._links[name].since_ns

    def reason(self, name: str) -> str:
        """Return the reason why the link is down; empty while it is up."""
        return self._links[name].reason

    def drain_notices(self) -> list[LinkNotice]:
        """Return the links that came up or went down since the last call, in order."""
        notices, self._notices = self._notices, []
        return notices

    def close(self) -> None:
        """Close all ports after at most `LINGER` for written bytes. May be called again."""
        self._opener.close()
        for link in self._links.values():
            if link.port is not None:
                self._release(link, LINGER)
                link.reason = "closed"
            link.retry_ns = None
        self._selector.close()

    def __enter__(self) -> Links:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _patience(self, timeout: float) -> float:
        due = [link.retry_ns for link in self._links.values() if link.retry_ns is not None]
        if due:
            timeout = min(timeout, (min(due) - self._now_ns()) / 1e9)
        return max(0.0, timeout)

    def _read(self, link: LinkState) -> Chunk | None:
        assert link.port is not None
        try:
            data = link.port.read()
            t_ns = self._now_ns()
        except Exception as error:
            self._lose(link, error)
            return None
        if data:
            link.asked_ns = t_ns
        return Chunk(link.spec.name, t_ns, data) if data else None

    def _flush(self, link: LinkState) -> None:
        """Continue to send a partly sent message, and poll for buffer space while there is one."""
        assert link.port is not None
        waits = not link.port.flush()
        if waits != link.waits_to_write:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if waits else 0)
            self._selector.modify(link.fd, events)
            link.waits_to_write = waits

    def _guarded(self, link: LinkState, act: Callable[[LinkState], None]) -> None:
        if link.port is None:
            return
        try:
            act(link)
        except Exception as error:
            self._lose(link, error)

    def _retry(self) -> None:
        now = self._now_ns()
        for link in self._links.values():
            if link.retry_ns is not None and now >= link.retry_ns:
                link.retry_ns = None
                try:
                    self._opener.ask(link.spec)
                except RuntimeError as error:  # no thread available
                    self._failed(link, error)

    def _request(self, link: LinkState) -> None:
        """Send the request of a device that measures on request."""
        if link.spec.request and link.port is not None:
            link.asked_ns = self._now_ns()
            self.send(link.spec.name, link.spec.request)

    def _take_opened(self) -> None:
        for name, result in self._opener.done():
            link = self._links[name]
            if isinstance(result, Exception):
                self._failed(link, result)
                continue
            try:
                self._take(link, result)
            except Exception as error:
                self._failed(link, error)

    def _take(self, link: LinkState, port: Port) -> None:
        """Register an opened port."""
        try:
            fd = port.fileno()
            self._selector.register(fd, selectors.EVENT_READ)
        except Exception as error:
            with contextlib.suppress(Exception):
                port.close()
            raise lost_by(error) from error
        link.port, link.fd, link.waits_to_write = port, fd, False
        link.reason, link.since_ns, link.retry_ns = "", self._now_ns(), None
        self._by_fd[fd] = link
        self._notices.append(LinkNotice(link.spec.name, link.since_ns, up=True))
        self._request(link)

    def _lose(self, link: LinkState, error: Exception) -> None:
        """Handle the failure of an open port."""
        now = self._now_ns()
        link.forgive(now)
        self._release(link, 0.0)
        link.reason, link.since_ns = reason_of(error), now
        self._notices.append(LinkNotice(link.spec.name, now, up=False, reason=link.reason))
        link.back_off(now)

    def _failed(self, link: LinkState, error: Exception) -> None:
        """Handle a failed attempt to open a port; each reason is reported once."""
        now = self._now_ns()
        reason = reason_of(error).removeprefix(f"{link.spec.name}: ")
        if reason != link.reason:
            self._notices.append(LinkNotice(link.spec.name, now, up=False, reason=reason))
            link.reason = reason
        link.back_off(now)

    def _release(self, link: LinkState, linger: float) -> None:
        assert link.port is not None
        with contextlib.suppress(Exception):
            self._selector.unregister(link.fd)
        self._by_fd.pop(link.fd, None)
        with contextlib.suppress(Exception):
            link.port.close(linger)
        link.port, link.fd = None, -1
