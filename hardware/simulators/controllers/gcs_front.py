"""The simulated GCS controller on the loopback."""

from __future__ import annotations

from typing import Literal, final

from hardware.simulators.controllers.gcs_device import GcsDevice
from hardware.simulators.controllers.gcs_model import GcsModel
from hardware.simulators.controllers.serving import PtyDoorway, Serving, TcpDoorway
from hardware.simulators.rig import DeviceClock, Rig


@final
class GcsFront(Serving):
    """A digital controller that speaks GCS 2 over TCP or a pseudo-terminal.

    The first line of its digital outputs leads to the trigger line of the bench. Time is that of
    the bench; only the faults of the wire are in real time.

    Parameters
    ----------
    rig : Rig
        The bench.
    clock : DeviceClock, optional
        The controller's own clock.
    model : GcsModel, optional
        What it is.
    over : {"tcp", "pty"}
        What carries its bytes.
    """

    def __init__(
        self,
        rig: Rig,
        clock: DeviceClock | None = None,
        model: GcsModel | None = None,
        over: Literal["tcp", "pty"] = "tcp",
    ) -> None:
        self.device = GcsDevice(rig, clock or DeviceClock(), model or GcsModel())
        doorway = TcpDoorway() if over == "tcp" else PtyDoorway()
        super().__init__(self.device, doorway)
