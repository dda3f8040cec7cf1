"""The simulated interferometer on a TCP socket, for the stub library to ask."""

from __future__ import annotations

import socket
import struct
from typing import final

from hardware.simulators.loopback import LoopbackServer
from hardware.simulators.rig import DeviceClock, Rig
from hardware.simulators.siosifm.counter import Counter
from hardware.simulators.siosifm.device import SimulatedInterferometer
from hardware.simulators.siosifm.faults import Faults
from hardware.simulators.siosifm.optics import AirAround, Quadrature
from hardware.simulators.siosifm.run import Edges


@final
class InterferometerFront(LoopbackServer):
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
    dead_path, noise, resolution, seed
        As of `Counter`.
    serial, stream_limit, block_limit, clocked_blocks, starts, clocks
        As of `SimulatedInterferometer`; edges default to the trigger line of the rig.
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
        clocked_blocks: bool = True,
        starts: Edges | None = None,
        clocks: Edges | None = None,
        seed: int = 1,
    ) -> None:
        super().__init__()
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
            clocked_blocks=clocked_blocks,
            starts=rig.trigger_edges_from if starts is None else starts,
            clocks=rig.trigger_edges_from if clocks is None else clocks,
        )

    @property
    def requests(self) -> tuple[str, ...]:
        """The last requests of the library but for those that only look."""
        return tuple(self.device.requests)

    def _talk(self, link: socket.socket) -> None:
        with link.makefile("rb") as lines:
            for line in lines:
                while self.faults.silent and not self._stopped.wait(0.01):
                    pass
                with self._rig.lock:
                    code, data = self.device.answer(line.decode("ascii").strip())
                if not self._send(link, struct.pack("<iI", code, len(data)) + data):
                    return

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
