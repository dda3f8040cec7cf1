"""A server of one-line questions and one-line answers on the loopback interface."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable
from typing import final

__all__ = ["LONGEST_LINE", "LineServer"]

LONGEST_LINE = 1024
"""Bytes of a question; a longer one ends the connection."""

_MOST_CLIENTS = 32


@final
class LineServer:
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
        self._answer = answer
        self._left = left
        self._program = program
        self._programs: set[socket.socket] = set()
        self._port = port
        self._listener: socket.socket | None = None
        self._clients: set[socket.socket] = set()
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()

    @property
    def programs(self) -> int:
        """Programs connected now."""
        with self._lock:
            return len(self._programs)

    def start(self) -> str:
        """Listen; returns ``host:port``."""
        listener = socket.create_server(("127.0.0.1", self._port))
        self._listener = listener
        self._run(self._accept, listener)
        host, port = listener.getsockname()[:2]
        return f"{host}:{port}"

    def stop(self) -> None:
        """End all connections; any number of times."""
        listener, self._listener = self._listener, None
        if listener is not None:
            with contextlib.suppress(OSError):
                listener.shutdown(socket.SHUT_RDWR)
            listener.close()
        with self._lock:
            clients = list(self._clients)
        for client in clients:
            with contextlib.suppress(OSError):
                client.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(2.0)
        self._threads.clear()

    def _run(self, work: Callable[[socket.socket], None], argument: socket.socket) -> None:
        thread = threading.Thread(target=work, args=(argument,), daemon=True)
        self._threads = [t for t in self._threads if t.is_alive()] + [thread]
        thread.start()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            with self._lock:
                welcome = len(self._clients) < _MOST_CLIENTS and self._listener is not None
                if welcome:
                    self._clients.add(client)
            if welcome:
                self._run(self._serve, client)
            else:
                client.close()

    def _serve(self, client: socket.socket) -> None:
        with contextlib.suppress(OSError):
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._talk(client)
        with self._lock:
            self._clients.discard(client)
            counted = client in self._programs
            self._programs.discard(client)
            rest, open_ = len(self._programs), self._listener is not None
        client.close()
        if self._left is not None and open_ and counted:
            self._left(rest)

    def _talk(self, client: socket.socket) -> None:
        waiting = b""
        while data := client.recv(4096):
            waiting += data
            while (end := waiting.find(b"\n")) >= 0:
                line, waiting = waiting[:end], waiting[end + 1 :]
                if len(line) > LONGEST_LINE:
                    break
                text = line.decode("ascii", "replace").strip()
                if self._program(text):
                    with self._lock:
                        self._programs.add(client)
                client.sendall(self._answer(text).encode("ascii", "replace") + b"\n")
            else:
                if len(waiting) <= LONGEST_LINE:
                    continue
            client.sendall(b"ERR line of more than %d bytes\n" % LONGEST_LINE)
            return
