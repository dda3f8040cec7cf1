"""Calls that must end: whatever a foreign library does."""

from __future__ import annotations

import threading
from collections.abc import Callable


def quietly(action: Callable[[], object], seconds: float = 3.0) -> bool:
    """Do something in a thread of its own; give up waiting after a real time (s).

    Errors are dropped: what is called here is the end of something that failed already.

    Returns
    -------
    bool
        Whether it came to its end, well or not.
    """

    def work() -> None:
        try:
            action()
        except Exception:
            pass

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    return not thread.is_alive()
