"""What Bluesky waits for: an action that ends by itself."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Self, final

from hardware.errors import TimedOut


@final
class ActionStatus:
    """A `bluesky.protocols.Status`.

    Parameters
    ----------
    what : str
        Name of the action, for messages.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._error: BaseException | None = None
        self._callbacks: list[Callable[[ActionStatus], None]] = []

    @classmethod
    def run(cls, what: str, action: Callable[[], object]) -> Self:
        """Start an action in a thread that does not keep the program alive."""
        status = cls(what)

        def work() -> None:
            try:
                action()
            except BaseException as error:
                status.finish(error)
            else:
                status.finish()

        threading.Thread(target=work, name=what, daemon=True).start()
        return status

    @classmethod
    def at_once(cls, what: str, action: Callable[[], object]) -> Self:
        """Do an action in the thread that calls: what is asked for behind it begins behind it."""
        status = cls(what)
        try:
            action()
        except Exception as error:
            status.finish(error)
        else:
            status.finish()
        return status

    @classmethod
    def finished(cls, what: str) -> Self:
        """Return the status of what is done already."""
        status = cls(what)
        status.finish()
        return status

    @property
    def done(self) -> bool:
        """Whether the action has ended, well or badly."""
        return self._ended.is_set()

    @property
    def success(self) -> bool:
        """Whether it has ended well."""
        return self.done and self._error is None

    def exception(self, timeout: float | None = 0.0) -> BaseException | None:
        """Return how it failed, None if it did not.

        Raises
        ------
        TimedOut
            Still running after `timeout` (s, real time; None waits for ever).
        """
        if not self._ended.wait(timeout):
            raise TimedOut(f"{self._what}: still running after {timeout} s")
        return self._error

    def wait(self, timeout: float | None = None) -> None:
        """Wait for the end (s, real time) and raise what went wrong."""
        error = self.exception(timeout)
        if error is not None:
            raise error

    def add_callback(self, callback: Callable[[ActionStatus], None]) -> None:
        """Call with this status at the end; at once if that is past."""
        with self._lock:
            if not self.done:
                self._callbacks.append(callback)
                return
        callback(self)

    def finish(self, error: BaseException | None = None) -> None:
        """End it; the first end counts."""
        with self._lock:
            if self.done:
                return
            self._error = error
            self._ended.set()
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback(self)

    def __repr__(self) -> str:
        """Return action and state."""
        state = "running" if not self.done else "done" if self.success else f"failed: {self._error}"
        return f"<{self._what}: {state}>"
