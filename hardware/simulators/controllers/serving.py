"""Serving one client at a time, in a thread, over TCP or a pseudo-terminal, with faults."""

from __future__ import annotations

import os
import select
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Protocol, final

from hardware.simulators.controllers.faults import Fault, FaultQueue


class AnsweringDevice(Protocol):
    """What answers."""

    @property
    def terminator(self) -> bytes:
        """End of an answer."""
        ...

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take bytes and give the answers to the commands that they complete."""
        ...


@final
class ClientLine:
    """One connected client, by the descriptors of its link; the first one is talked over."""

    def __init__(self, *ends: int) -> None:
        self._ends = ends

    def fileno(self) -> int:
        """Descriptor."""
        return self._ends[0]

    def receive(self) -> bytes:
        """Bytes that are there."""
        return os.read(self._ends[0], 1 << 16)

    def send(self, data: bytes) -> None:
        """Send all."""
        while data:
            data = data[os.write(self._ends[0], data) :]

    def close(self) -> None:
        """Cut it."""
        for end in self._ends:
            os.close(end)


class Doorway(Protocol):
    """Where clients come in."""

    def open(self) -> str:
        """Open it; return the address."""
        ...

    def wait(self, wake: int, refuse: Callable[[], bool]) -> ClientLine | None:
        """Wait for a client, for a moment or until the descriptor `wake` can be read."""
        ...

    def close(self) -> None:
        """Let nobody in any more."""
        ...


class Serving:
    """A simulated device and the thread that answers for it.

    Parameters
    ----------
    device : AnsweringDevice
        What answers.
    doorway : Doorway
        Where clients come in.
    """

    def __init__(self, device: AnsweringDevice, doorway: Doorway) -> None:
        self._answering = device
        self._doorway = doorway
        self.faults = FaultQueue()
        """What happens to the answers."""
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._wake = (-1, -1)

    def start(self) -> str:
        """Open the doorway, answer from now on and return the address."""
        address = self._doorway.open()
        self._stop.clear()
        self._wake = os.pipe()
        self._thread = threading.Thread(target=self._run, name=f"simulator {address}", daemon=True)
        self._thread.start()
        return address

    def stop(self) -> None:
        """Cut the link and end the thread."""
        self._stop.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            os.write(self._wake[1], b"!")
            thread.join(timeout=5.0)
            for end in self._wake:
                os.close(end)
        self._doorway.close()

    def _run(self) -> None:
        while not self._stop.is_set():
            line = self._doorway.wait(self._wake[0], lambda: self.faults.refuse)
            if line is None:
                continue
            try:
                self._serve(line)
            except OSError:
                pass  # the client is gone; the next one may come
            finally:
                line.close()

    def _serve(self, line: ClientLine) -> None:
        while not self._stop.is_set():
            ready, _, _ = select.select([line.fileno(), self._wake[0]], [], [])
            if line.fileno() not in ready:
                continue
            data = line.receive()
            if not data:
                return
            for answer in self._answering.feed(data):
                if not self._answer(line, answer):
                    return

    def _answer(self, line: ClientLine, answer: bytes) -> bool:
        """Send an answer as its fault will have it; False if the link was cut."""
        fault = self.faults.take()
        if fault.delay and self._stop.wait(fault.delay):
            return False
        if fault.silent:
            return True
        data = fault.garbage + _ended(answer, self._answering.terminator, fault)
        cut = fault.drop_after is not None and fault.drop_after < len(data)
        data = data[: fault.drop_after] if cut else data
        size = fault.chunk or max(len(data), 1)
        for k in range(0, len(data), size):
            if k and fault.pause and self._stop.wait(fault.pause):
                return False
            line.send(data[k : k + size])
        return not cut


_LOOK = 0.02
"""How often the doorway looks whether it is to refuse (s)."""


def _ended(answer: bytes, terminator: bytes, fault: Fault) -> bytes:
    if fault.terminator is None or not answer.endswith(terminator):
        return answer
    return answer[: len(answer) - len(terminator)] + fault.terminator


@final
class TcpDoorway:
    """A port on the loopback; one client at a time, as the controllers have it."""

    def __init__(self) -> None:
        self._place = ("127.0.0.1", 0)
        self._listener: socket.socket | None = None

    def open(self) -> str:
        """Listen; return host:port."""
        self._listener = socket.create_server(self._place, backlog=1)
        self._place = self._listener.getsockname()[:2]
        return f"{self._place[0]}:{self._place[1]}"

    def wait(self, wake: int, refuse: Callable[[], bool]) -> ClientLine | None:
        """Wait for a client."""
        if refuse():
            self.close()
            select.select([wake], [], [], _LOOK)
            return None
        if self._listener is None:
            self.open()
            return None
        door = self._listener.fileno()
        ready, _, _ = select.select([door, wake], [], [], _LOOK)
        if door not in ready:
            return None
        link, _ = self._listener.accept()
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return ClientLine(link.detach())

    def close(self) -> None:
        """Listen no more."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None


@final
class PtyDoorway:
    """A pseudo-terminal; whoever opens its other end is the client."""

    def __init__(self) -> None:
        self._ends: tuple[int, int] | None = None
        self._taken = False

    def open(self) -> str:
        """Make it; return the path of the other end."""
        import tty

        near, far = os.openpty()
        # raw, so that nothing is echoed or translated before the client sets it up
        tty.setraw(far)
        self._ends = (near, far)
        self._taken = False
        return os.ttyname(far)

    def wait(self, wake: int, refuse: Callable[[], bool]) -> ClientLine | None:
        """Return the line once; a cut pseudo-terminal does not come back."""
        if self._ends is None or self._taken:
            select.select([wake], [], [])
            return None
        self._taken = True
        return ClientLine(*self._ends)

    def close(self) -> None:
        """Forget it; the line closes both ends."""
        if self._ends is not None and not self._taken:
            for end in self._ends:
                os.close(end)
        self._ends = None
