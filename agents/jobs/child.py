"""What processes that others have begun owe them: they end with them, even if these are killed."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from multiprocessing.connection import wait


def follow_parent() -> None:
    """End this process when the one that began it is gone; leave interrupts to that one.

    To be called first in the process. It would else go on for long, and write into what another
    process has taken up again.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


def end_with_parent() -> None:
    """As `follow_parent`; interrupts come here, too."""
    threading.Thread(target=_wait, daemon=True).start()


def _wait() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
