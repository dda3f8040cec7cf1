"""The program's side: a clock whose waiting makes the time of the bench pass."""

from __future__ import annotations

import contextlib
import socket
import threading
from typing import final

from hardware.simulators.control.lines import LONGEST_LINE
from hardware.simulators.noise import white
from hardware.simulators.rig import Rig

_FIRST = 2.0
"""Longest wait for the first answer (s): a bench that is there tells the time at once."""
_LONGEST_ANSWER = 64 * LONGEST_LINE


@final
class BenchClock:
    """Time of a program in front of a virtual bench.

    It may run at a rate of its own: a program that waits 1 s of its time lets ``1 + ppm / 1e6`` s
    of true time pass. A card that the program paces has the same error.

    Parameters
    ----------
    address : str
        ``host:port`` of the bench's control front.
    ppm : float
        Rate error (millionths).
    jitter : float
        Standard deviation of the end of a wait (s); waits become longer only.
    seed : int
        Of the jitter.
    timeout : float
        Longest real time (s) that an answer may take; raises TimeoutError behind it. The first
        question, put at once, has to be answered within 2 s.

    Raises
    ------
    ConnectionError
        If there is no bench, or it is gone, or something else answers there.
    """

    def __init__(
        self,
        address: str,
        *,
        ppm: float = 0.0,
        jitter: float = 0.0,
        seed: int = 0,
        timeout: float = 30.0,
    ) -> None:
        self._rate = 1.0 + 1e-6 * ppm
        self._jitter = jitter
        self._seed = seed
        self._waits = 0
        self._lock = threading.Lock()
        self._address = address
        self._waiting = b""
        self._interrupted = False
        patience = min(_FIRST, timeout)
        self._socket = _connected(address, patience)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self._greet(patience)
            self._socket.settimeout(timeout)
        except BaseException:
            self.close()
            raise

    def now(self) -> float:
        """Present time of the program (s)."""
        return float(self.ask("NOW")) / self._rate

    def sleep(self, seconds: float) -> None:
        """Let time pass (s of the program); nothing for zero and less."""
        if seconds <= 0.0:
            return
        true = seconds * self._rate
        if self._jitter:
            true += self._jitter * abs(float(white(self._seed, self._waits, 1)[0]))
        self._waits += 1
        self.ask(f"WAIT {true!r}")

    def edge(self) -> float:
        """Put an edge on the trigger line; returns its true instant (s)."""
        return float(self.ask("EDGE"))

    def ask(self, line: str) -> str:
        """Send one line and return its answer.

        Raises
        ------
        ValueError
            If the bench refuses it; the message is the bench's.
        ConnectionError
            If the bench is gone.
        TimeoutError
            If it does not answer; the connection is closed, because what would come later belongs
            to nothing.
        """
        word, _, rest = self._exchange(line).partition(" ")
        if word != "OK":
            raise ValueError(f"virtual bench: {rest}")
        return rest

    def _greet(self, patience: float) -> None:
        """Find out whether a bench is there."""
        where = f"no virtual bench at {self._address}"
        try:
            answer = self._question("NOW")
        except TimeoutError:
            raise ConnectionError(
                f"{where}: something listens there but does not answer NOW within {patience:g} s; "
                "give the address of control"
            ) from None
        except OSError as error:
            raise ConnectionError(f"{where}: {error}") from None
        word, _, rest = answer.partition(" ")
        try:
            float(rest)
        except ValueError:
            word = ""
        if word != "OK":
            raise ConnectionError(
                f"{where}: what listens there answers {answer[:60]!r} to NOW; give the address of "
                "control"
            )

    def _exchange(self, line: str) -> str:
        """Send one line and return the line that answers it."""
        with self._lock:
            try:
                return self._question(line)
            except TimeoutError:
                self.close()
                raise TimeoutError(
                    f"the virtual bench at {self._address} did not answer {line!r} in time"
                ) from None
            except OSError as error:
                self.close()
                raise ConnectionError(
                    f"the virtual bench at {self._address} is gone: {error}"
                ) from None

    def _question(self, line: str) -> str:
        if self._interrupted:
            self._resume()
        # stays set if Ctrl-C comes in between: the next answer is not that of its question
        self._interrupted = True
        self._socket.sendall(line.encode("ascii") + b"\n")
        answer = self._line()
        self._interrupted = False
        return answer

    def _resume(self) -> None:
        """Skip what still comes from before an interruption, up to the answer to a known line."""
        # the empty line ends a question that was sent in part
        self._socket.sendall(b"\nBYE\n")
        while self._line() != "OK bye":
            pass

    def _line(self) -> str:
        while b"\n" not in self._waiting:
            data = self._socket.recv(4096)
            if not data:
                raise ConnectionError("it closed the connection")
            self._waiting += data
            if len(self._waiting) > _LONGEST_ANSWER:
                raise ConnectionError("it answers without end")
        text, _, self._waiting = self._waiting.partition(b"\n")
        return text.decode("ascii", "replace").rstrip("\r")

    def close(self) -> None:
        """Leave; never raises."""
        with contextlib.suppress(OSError):
            self._socket.close()


@final
class LocalClock:
    """The same for a program in the process of the bench; no connection is made.

    Parameters
    ----------
    rig : Rig
        The bench, on virtual time.
    ppm : float
        Rate error (millionths), see `BenchClock`.
    """

    def __init__(self, rig: Rig, ppm: float = 0.0) -> None:
        self._rig = rig
        self._rate = 1.0 + 1e-6 * ppm

    def now(self) -> float:
        """Present time of the program (s)."""
        return self._rig.now / self._rate

    def sleep(self, seconds: float) -> None:
        """Let time pass (s of the program); nothing for zero and less."""
        if seconds > 0.0:
            self._rig.wait(seconds * self._rate)


def _connected(address: str, timeout: float) -> socket.socket:
    host, _, port = address.rpartition(":")
    try:
        number = int(port)
        if not 1 <= number <= 65535:
            raise ValueError(f"a port is a number from 1 to 65535, not {number}")
        return socket.create_connection((host, number), timeout=timeout)
    except (OSError, ValueError) as error:
        raise ConnectionError(f"no virtual bench at {address}: {error}") from None


def ask(address: str, line: str) -> str:
    """Ask a bench one line over a connection of its own; see `BenchClock.ask`."""
    clock = BenchClock(address, timeout=10.0)
    try:
        return clock.ask(line)
    finally:
        clock.close()
