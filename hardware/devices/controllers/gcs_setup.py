"""What has to be said about a GCS controller because it does not tell."""

from __future__ import annotations

from dataclasses import dataclass

from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True, slots=True)
class GcsSetup:
    """What the controller does not tell about itself.

    Parameters
    ----------
    axis : str
        Axis that carries the actuator.
    channel : str
        Output channel of this axis.
    generator, table : int
        Wave generator of the axis and a wave table that may be overwritten.
    scale : float
        Voltage per unit of the open-loop control value. On some models the control value is a
        voltage (1), on others a position; compare ``VOL?`` with ``SVA?`` once and set it.
    offset : float
        Voltage at control value zero (V).
    safe : float
        Where the output rests (V).
    gentle : float
        Rate of going there on power-up (V/s).
    watchdog : bool
        Whether this device goes to its safe value when the program is gone. The public documents
        of GCS know no such thing; true only where the maker confirms it.
    arguments : int
        Most arguments of one command.
    servo_time : float, optional
        Period of servo and wave generator (s); asked for (parameter 0x0E000200) if not given.
    """

    axis: str = "1"
    channel: str = "1"
    generator: int = 1
    table: int = 1
    scale: float = 1.0
    offset: float = 0.0
    safe: float = 0.0
    gentle: float = 100.0
    watchdog: bool = False
    arguments: int = 32
    servo_time: float | None = None

    def __post_init__(self) -> None:
        """Check."""
        if not (self.scale and self.gentle > 0.0 and self.arguments > 5):
            raise UnusableInput(
                f"controller axis {self.axis}: scale must not be 0, gentle must be positive and "
                "arguments more than 5"
            )
