"""A server of one-line questions and one-line answers on the loopback interface."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import final

from hardware.simulators.loopback import LoopbackServer

LONGEST_LINE = 1024
"""Bytes of a question; a longer one ends the connection."""

_MOST_CLIENTS = 32


@final
class LineServer(LoopbackServer):
    """Answers every line of every client in a thread of its own.

    Parameters
    ----------
    answer : callable
        From a line to its answer, both without line ends.
    left : callable, optional
        Called after a program is gone, with the number of those still there.
    program : callable, optional
        Whether a line is one of a program; only clients that sent such a line count as programs.
    port : int
        0 takes a free one.
    """

    def __init__(
        self,
        answer: Callable[[str], str],
        left: Callable[[int], None] | None = None,
        program: Callable[[str], bool] = lambda line: True,
        port: int = 0,
    ) -> None:
        super().__init__(port, _MOST_CLIENTS)
        self._answer = answer
        self._left = left
        self._program = program
        self._programs: set[socket.socket] = set()

    @property
    def programs(self) -> int:
        """Programs connected now."""
        with self._guard:
            return len(self._programs)

    def _gone(self, link: socket.socket) -> None:
        with self._guard:
            counted = link in self._programs
            self._programs.discard(link)
            rest = len(self._programs)
        if self._left is not None and counted and not self._stopped.is_set():
            self._left(rest)

    def _talk(self, link: socket.socket) -> None:
        waiting = b""
        while data := link.recv(4096):
            waiting += data
            while (end := waiting.find(b"\n")) >= 0:
                line, waiting = waiting[:end], waiting[end + 1 :]
                if len(line) > LONGEST_LINE:
                    break
                text = line.decode("ascii", "replace").strip()
                if self._program(text):
                    with self._guard:
                        self._programs.add(link)
                link.sendall(self._answer(text).encode("ascii", "replace") + b"\n")
            else:
                if len(waiting) <= LONGEST_LINE:
                    continue
            link.sendall(b"ERR line of more than %d bytes\n" % LONGEST_LINE)
            return
