"""The open device: link, identity, and what a lost link costs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, TypeVar

from hardware.contracts import Clock, Identity
from hardware.devices.interferometer.constants import Info
from hardware.devices.interferometer.library import VendorLibrary
from hardware.devices.interferometer.opening import open_handle
from hardware.devices.interferometer.quietly import quietly
from hardware.devices.interferometer.readouts import identity_of
from hardware.errors import HardwareError, LinkLost, TimedOut

Told = TypeVar("Told")


class Connection:
    """A device of the library, open from the beginning; base of `Interferometer`.

    Parameters
    ----------
    library : VendorLibrary
        The vendor's library.
    address : str
        See `hardware.devices.interferometer.opening`.
    clock : Clock
        Time of the program.
    """

    identity: Identity
    handle: int

    def __init__(self, library: VendorLibrary, address: str, clock: Clock) -> None:
        self.library = library
        self.address = address
        self.clock = clock
        self.busy: object | None = None
        self._zeroed = False
        self._open = self._entered = False
        self._connect()

    def _connect(self) -> None:
        self.library.enter()
        self._entered = True
        try:
            self.handle = open_handle(self.library, self.address)
            self._open = True
            self._await_information()
            self.identity = identity_of(self.library, self.handle)
        except BaseException:
            self.close()
            raise

    def _await_information(self, patience: float = 3.0) -> None:
        end = self.clock.now() + patience
        while not self.library.call("IfmDeviceInfo", self.handle, Info.AVAILABLE):
            if self.clock.now() >= end:
                raise TimedOut(
                    f"interferometer: {self.address} tells nothing about itself for "
                    f"{patience:g} s; switch it off and on"
                )
            self.clock.sleep(0.02)

    def reopen(self) -> None:
        """Close and open again; `zero` is needed then."""
        self.close()
        self._connect()

    def close(self) -> None:
        """Stop and release the device; never raises, never hangs, any number of times."""
        opened, self._open, self._zeroed, self.busy = self._open, False, False, None
        if opened:
            quietly(lambda: self.library.call("IfmStop", self.handle))
            quietly(lambda: self.library.call("IfmCloseDevice", self.handle))
        entered, self._entered = self._entered, False
        if entered:
            quietly(self.library.leave)

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    @property
    def present(self) -> bool:
        """Whether the library still knows the device."""
        return self._open and int(self.library.function("IfmDeviceValid")(self.handle)) > 0

    def gone(self, fault: HardwareError | None = None) -> LinkLost:
        """Note that the link is lost and make (not raise) the error that says so."""
        self._zeroed = False
        if isinstance(fault, LinkLost):
            return fault
        return LinkLost(
            f"interferometer {self.identity.serial}: the device is gone; check cable and supply, "
            "reopen(), and zero() again"
        )

    def _call(self, name: str, *arguments: Any) -> Any:
        return self._guarded(lambda: self.library.call(name, *arguments))

    def _guarded(self, action: Callable[[], Told]) -> Told:
        """Do something with the open device; a lost link costs the zero."""
        if not self._open:
            raise LinkLost(f"interferometer {self.identity.serial}: closed; reopen() it")
        try:
            return action()
        except LinkLost as fault:
            raise self.gone(fault) from None
