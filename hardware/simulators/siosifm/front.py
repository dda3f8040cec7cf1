"""The simulated interferometer on a TCP socket, for the stub library to ask."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from typing import final

from hardware.simulators.rig import DeviceClock, Rig
from hardware.simulators.siosifm.counter import Counter
from hardware.simulators.siosifm.device import SimulatedInterferometer
from hardware.simulators.siosifm.faults import Faults
from hardware.simulators.siosifm.optics import AirAround, Quadrature
from hardware.simulators.siosifm.run import Edges

__all__ = ["InterferometerFront"]


@final
class InterferometerFront:
    """A device before a rig, served from threads of its own.

    ``address = InterferometerFront(rig).start()`` gives ``"host:port"``. Programs load the stub
    library and open the network at that address, or set ``BONDSIGHT_BENCH_SIOS`` to it and open
    USB device 0, a COM port or the demo device.

    Parameters
    ----------
    rig : Rig
        The bench.
    clock : DeviceClock
        The device's own clock.
    faults : Faults, optional
        Change its fields at any time; also as attribute `faults`.
    air : AirAround
        The air in the beam.
    quadrature : Quadrature
        Amplitude and errors of the detectors.
    dead_path : float
        True dead path (m).
    noise : float
        Standard deviation of one reading (m).
    resolution : float
        Step of the counter (m).
    serial : int
        Number of the device.
    stream_limit : float
        Largest rate of streaming (Hz); more is refused with -18.
    block_limit : float
        Largest rate of blocks (Hz).
    starts, clocks : callable, optional
        ``starts(first)`` gives the true instants (s) of the edges on the start input but for the
        first so many; `clocks` the same for the clock or event input. Both default to the trigger
        line of the rig.
    seed : int
        Of the noise.
    """

    def __init__(
        self,
        rig: Rig,
        clock: DeviceClock | None = None,
        faults: Faults | None = None,
        *,
        air: AirAround | None = None,
        quadrature: Quadrature | None = None,
        dead_path: float = 0.0,
        noise: float = 0.0,
        resolution: float = 0.1e-9,
        serial: int = 1234,
        stream_limit: float = 16_000.0,
        block_limit: float = 1e6,
        starts: Edges | None = None,
        clocks: Edges | None = None,
        seed: int = 1,
    ) -> None:
        self.faults = Faults() if faults is None else faults
        self._rig = rig
        counter = Counter(
            rig,
            self.faults,
            AirAround() if air is None else air,
            Quadrature() if quadrature is None else quadrature,
            dead_path=dead_path,
            noise=noise,
            resolution=resolution,
            seed=seed,
        )
        self.device = SimulatedInterferometer(
            rig,
            DeviceClock() if clock is None else clock,
            counter,
            serial=serial,
            stream_limit=stream_limit,
            block_limit=block_limit,
            starts=rig.trigger_edges_from if starts is None else starts,
            clocks=rig.trigger_edges_from if clocks is None else clocks,
        )
        self._listener: socket.socket | None = None
        self._links: set[socket.socket] = set()
        self._threads: list[threading.Thread] = []
        self._ending = threading.Event()
        self._guard = threading.Lock()

    @property
    def requests(self) -> tuple[str, ...]:
        """The last requests of the library but for those that only look."""
        return tuple(self.device.requests)

    def start(self, host: str = "127.0.0.1", port: int = 0) -> str:
        """Serve; return ``"host:port"``."""
        self._ending.clear()
        self._listener = socket.create_server((host, port))
        self._run(self._accept, self._listener)
        return "{}:{}".format(*self._listener.getsockname()[:2])

    def stop(self) -> None:
        """End serving; any number of times."""
        self._ending.set()
        if self._listener is not None:
            with contextlib.suppress(OSError):
                self._listener.shutdown(socket.SHUT_RDWR)
            self._listener.close()
            self._listener = None
        self.cut()
        for thread in self._threads:
            thread.join(2.0)
        self._threads.clear()

    def cut(self) -> None:
        """Pull the cable: every open link is gone."""
        with self._guard:
            links = list(self._links)
        for link in links:
            with contextlib.suppress(OSError):
                link.shutdown(socket.SHUT_RDWR)

    def _run(self, work: object, *arguments: object) -> None:
        assert callable(work)
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self, listener: socket.socket) -> None:
        while not self._ending.is_set():
            try:
                link, _ = listener.accept()
            except OSError:
                return
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with self._guard:
                self._links.add(link)
            self._threads = [t for t in self._threads if t.is_alive()]
            self._run(self._serve, link)

    def _serve(self, link: socket.socket) -> None:
        try:
            with link, link.makefile("rb") as lines:
                for line in lines:
                    while self.faults.silent and not self._ending.wait(0.01):
                        pass
                    with self._rig.lock:
                        code, data = self.device.answer(line.decode("ascii").strip())
                    if not self._send(link, struct.pack("<iI", code, len(data)) + data):
                        return
        except OSError:
            return
        finally:
            with self._guard:
                self._links.discard(link)

    def _send(self, link: socket.socket, data: bytes) -> bool:
        """Send; False if the cable was pulled on the way."""
        room = self.faults.cut_after_bytes
        if room is None:
            link.sendall(data)
            return True
        link.sendall(data[:room])
        if room >= len(data):
            self.faults.cut_after_bytes = room - len(data)
            return True
        self.faults.cut_after_bytes = None
        link.shutdown(socket.SHUT_RDWR)
        return False
