"""A simulated ASCII controller on a pseudo-terminal."""

from __future__ import annotations

from typing import final

from hardware.simulators.controllers.ascii_devices import ASCII_DEVICES, AsciiDevice
from hardware.simulators.controllers.serving import PtyDoorway, Serving
from hardware.simulators.rig import Rig


@final
class AsciiFront(Serving):
    """A controller that speaks its ASCII dialect over a pseudo-terminal.

    Parameters
    ----------
    rig : Rig
        The bench.
    device : str or AsciiDevice
        Name in `ASCII_DEVICES`, or a device in front of the same bench.
    """

    def __init__(self, rig: Rig, device: str | AsciiDevice = "nv200") -> None:
        self.device = ASCII_DEVICES[device](rig) if isinstance(device, str) else device
        super().__init__(self.device, PtyDoorway())
