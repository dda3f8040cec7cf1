"""A server of the bench on a TCP socket: one thread listens, one more talks to each client."""

from __future__ import annotations

import contextlib
import socket
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable

_JOIN = 2.0


class LoopbackServer(ABC):
    """Listens, and talks to every client in a thread of its own; abstract.

    Parameters
    ----------
    port : int
        0 takes a free one.
    most : int, optional
        Clients at one time; one more is sent away at once.
    """

    def __init__(self, port: int = 0, most: int | None = None) -> None:
        self._port = port
        self._most = most
        self._listener: socket.socket | None = None
        self._links: set[socket.socket] = set()
        self._threads: list[threading.Thread] = []
        self._stopped = threading.Event()
        self._guard = threading.Lock()

    @abstractmethod
    def _talk(self, link: socket.socket) -> None:
        """Serve one client until it leaves; a link that breaks ends it too."""

    def _gone(self, link: socket.socket) -> None:
        """Tell that a client has left, whose link is closed; nobody is told here."""
        return

    def start(self) -> str:
        """Listen; return ``"host:port"``."""
        self._stopped.clear()
        listener = socket.create_server(("127.0.0.1", self._port))
        self._listener = listener
        self._run(lambda: self._accept(listener))
        return "{}:{}".format(*listener.getsockname()[:2])

    def stop(self) -> None:
        """End all connections; any number of times."""
        self._stopped.set()
        listener, self._listener = self._listener, None
        if listener is not None:
            # closing alone does not wake a thread that waits
            with contextlib.suppress(OSError):
                listener.shutdown(socket.SHUT_RDWR)
            listener.close()
        self.cut()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(_JOIN)
        self._threads.clear()

    def cut(self) -> None:
        """Pull the cable: every open link is gone."""
        with self._guard:
            links = list(self._links)
        for link in links:
            with contextlib.suppress(OSError):
                link.shutdown(socket.SHUT_RDWR)

    def _run(self, work: Callable[[], None]) -> None:
        thread = threading.Thread(target=work, daemon=True, name=type(self).__name__)
        self._threads = [t for t in self._threads if t.is_alive()] + [thread]
        thread.start()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                link, _ = listener.accept()
            except OSError:
                return
            with self._guard:
                room = self._most is None or len(self._links) < self._most
                welcome = room and not self._stopped.is_set()
                if welcome:
                    self._links.add(link)
            if welcome:
                self._run(lambda link=link: self._serve(link))  # type: ignore[misc]
            else:
                link.close()

    def _serve(self, link: socket.socket) -> None:
        try:
            with contextlib.suppress(OSError), link:
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._talk(link)
        finally:
            with self._guard:
                self._links.discard(link)
            self._gone(link)
