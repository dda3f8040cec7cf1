"""The five functions of the stack actuator thesis (Appendix A), on today's library.

The thesis used the maker's older library `siosusb`, whose block calls are not public; these
methods mean the same on `siosifm`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Chunk, Clock
from hardware.devices.interferometer.block import Block
from hardware.devices.interferometer.device import Interferometer
from hardware.devices.interferometer.environment import AirCorrection
from hardware.devices.interferometer.library import VendorLibrary
from hardware.devices.interferometer.streaming import Streaming
from hardware.errors import HardwareError, Overrun, ProtocolFault, TimedOut


@dataclass(frozen=True, slots=True, eq=False)
class Superfast:
    """One block.

    Parameters
    ----------
    x : (n,) array
        Displacement, corrected for air by the device (m).
    flags : (n,) array
        Sums of `hardware.contracts.Flag`.
    rate : float
        As the device has really set it (Hz).
    environment : AirCorrection
        Air that the correction rests on.
    """

    x: NDArray[np.float64]
    flags: NDArray[np.uint16]
    rate: float
    environment: AirCorrection


@final
class ThesisInterface:
    """The interferometer as the thesis' scripts used it.

    Parameters
    ----------
    address : str
        As of `Interferometer`.
    library : VendorLibrary or path, optional
        The vendor's library.
    clock : Clock, optional
        Time of the program.
    """

    def __init__(
        self,
        address: str = "usb",
        *,
        library: VendorLibrary | str | Path | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._address, self._library, self._clock = address, library, clock
        self._device: Interferometer | None = None
        self._normal: Streaming | None = None
        self._settings: tuple[float, int, bool] = (1000.0, 1, False)

    @property
    def device(self) -> Interferometer:
        """The device.

        Raises
        ------
        ProtocolFault
            Before `config_sios_usb_device`.
        """
        if self._device is None:
            raise ProtocolFault("interferometer: not configured; call config_sios_usb_device()")
        return self._device

    def config_sios_usb_device(
        self,
        rate: float = 1000.0,
        *,
        average: int = 1,
        filtered: bool = False,
        dead_path: float = 0.0,
    ) -> None:
        """Open, set to zero and start the normal mode (``configSIOS_USB_device``).

        Parameters
        ----------
        rate : float
            Values a second (Hz).
        average : int
            Primary values averaged for each.
        filtered : bool
            Use the device's default filter.
        dead_path : float
            m, whole millimetres.
        """
        self.unconfig_sios_usb_device()
        self._device = Interferometer(
            self._address, library=self._library, clock=self._clock, dead_path=dead_path
        )
        self._settings = rate, average, filtered
        try:
            self._device.zero()
            self._start()
        except HardwareError:
            self.unconfig_sios_usb_device()
            raise

    def get_length_value(self) -> float:
        """Return the last displacement (m) of the normal mode (``getLengthValue``).

        Values between two calls are dropped.
        """
        device, stream = self.device, self._normal
        if stream is None:
            raise ProtocolFault("interferometer: no normal mode; call config_sios_usb_device()")
        end = device.clock.now() + 2.0 + 2.0 / stream.rate
        last: Chunk | None = None
        while True:
            try:
                chunks = stream.poll()
            except Overrun:
                continue  # the buffer held old values only; the next ones are new
            if chunks:
                last = chunks[-1]
            elif last is not None:
                return float(last.channels["x"][-1])
            elif device.clock.now() > end:
                raise TimedOut("interferometer: no value in normal mode; is its trigger off?")
            else:
                device.clock.sleep(min(0.5 / stream.rate, 0.05))

    def superfast_sample(
        self, rate: float, length: int, trigger: bool = False, patience: float = 2.0
    ) -> Superfast:
        """Sample one block and wait for it (``superfast_sample``).

        The normal mode rests meanwhile.

        Parameters
        ----------
        rate : float
            Hz, at most 1 MHz.
        length : int
            At most 32,768.
        trigger : bool
            Start at an edge on the trigger input.
        patience : float
            Longest wait for the trigger (s).
        """
        device = self.device
        block = Block(device, length, rate, start=trigger, patience=patience)
        if self._normal is not None:
            self._normal.abort()
        try:
            block.kickoff()
            chunks: list[Chunk] = []
            while not block.done:
                chunks += block.poll()
                if not block.done:
                    device.clock.sleep(min(max(length / rate / 4.0, 1e-3), 0.05))
            environment = self.get_envir_data()
            return Superfast(
                np.concatenate([c.channels["x"] for c in chunks]),
                np.concatenate([c.flags for c in chunks]),
                block.rate,
                environment,
            )
        finally:
            block.abort()
            self._resume()

    def get_envir_data(self) -> AirCorrection:
        """Return the air that displacements are corrected with (``getEnvirData``)."""
        return self.device.environment()

    def unconfig_sios_usb_device(self) -> None:
        """Stop the normal mode and close (``unconfigSIOS_USB_device``); never raises."""
        if self._normal is not None:
            self._normal.abort()
        if self._device is not None:
            self._device.close()
        self._normal = self._device = None

    def _start(self) -> None:
        rate, average, filtered = self._settings
        self._normal = Streaming(self.device, rate, average=average, filtered=filtered)
        self._normal.kickoff()

    def _resume(self) -> None:
        """Start the normal mode again if that is possible; the error under way is worth more."""
        self._normal = None
        try:
            self._start()
        except HardwareError:
            self._normal = None
