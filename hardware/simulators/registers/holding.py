"""Which connection drives a simulated card: the first one that does, until it is gone."""

from __future__ import annotations

import select
import socket
import threading
from collections.abc import Iterable
from typing import final

_PATIENCE, _LOOK = 0.3, 0.02
_READ16, _READ32 = 0, 2
_DATA_BAR, _LINES_IN = 2, 0x10


def drives(accesses: Iterable[tuple[int, int, int, int]]) -> bool:
    """Tell whether any access changes something: a write, a conversion, a value from the queue."""
    for kind, bar, offset, _ in accesses:
        harmless = kind == _READ32 or (
            kind == _READ16 and (bar != _DATA_BAR or offset == _LINES_IN)
        )
        if not harmless:
            return True
    return False


@final
class Holder:
    """Lets one connection at a time drive the card.

    A real card does not care who writes; there the programs lock its files. A connection that was
    just closed counts until its end has arrived here and what it had asked for is done, so that no
    write of before comes behind those of the next one; a second one is given a moment.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._link: socket.socket | None = None
        self._busy = False
        self._past: set[socket.socket] = set()

    def claim(self, link: socket.socket) -> int | None:
        """Take the card for `link`, until `done` says that what it asked for is done.

        Returns the port of the holder if that is another one.
        """
        with self._changed:
            looks = round(_PATIENCE / _LOOK)
            # what it asked for came too late: another one has gone on from there
            while looks > 0 and link not in self._past:
                gone = self._link is None or self._link is link or _gone(self._link)
                if gone and not self._busy:
                    if self._link is not None and self._link is not link:
                        self._past.add(self._link)
                    self._link, self._busy = link, True
                    return None
                # who has hung up is waited for: what it sent last may still be carried out
                looks -= not gone
                self._changed.wait(_LOOK)
            return _port(self._link)

    def done(self, link: socket.socket) -> None:
        """Say that what `link` asked for is done; nothing if it does not hold the card."""
        with self._changed:
            if self._link is link:
                self._busy = False
                self._changed.notify_all()

    def release(self, link: socket.socket) -> None:
        """Let go of the card if `link` holds it."""
        with self._changed:
            self._past.discard(link)
            if self._link is link:
                self._link, self._busy = None, False
                self._changed.notify_all()


def _gone(link: socket.socket) -> bool:
    """Tell whether the other side has hung up and nothing it sent is left to read."""
    try:
        ready, _, _ = select.select([link], [], [], 0.0)
        return bool(ready) and not link.recv(1, socket.MSG_PEEK)
    except (OSError, ValueError):
        return True


def _port(link: socket.socket | None) -> int:
    try:
        return int(link.getpeername()[1]) if link is not None else 0
    except OSError:
        return 0
