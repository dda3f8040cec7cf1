"""Where an interferometer is, written as one word."""

from __future__ import annotations

import sys

from bondgraph.support.errors import UnusableInput
from hardware.devices.interferometer.library import VendorLibrary
from hardware.errors import LinkLost

_FORMS = "usb, usb:INDEX, usb:serial=NUMBER, com:PORT, net:HOST:PORT, demo or demo:CHANNELS"


def open_handle(library: VendorLibrary, address: str) -> int:
    """Open a device.

    Parameters
    ----------
    library : VendorLibrary
        The library, initialised.
    address : str
        ``usb`` (the first), ``usb:1``, ``usb:serial=1234``, ``com:/dev/ttyACM0`` or ``com:3``,
        ``net:192.168.0.7:2000``, ``demo``.

    Returns
    -------
    int
        Handle.

    Raises
    ------
    UnusableInput
        If the address cannot be read.
    LinkLost
        If nobody is there.
    """
    way, _, place = address.partition(":")
    try:
        match way:
            case "usb":
                return _usb(library, place)
            case "com":
                port: int | bytes = int(place) if sys.platform == "win32" else place.encode()
                return int(library.call("IfmOpenCOM", port))
            case "net":
                host, _, number = place.rpartition(":")
                if host:
                    return int(library.call("IfmOpenNetwork", host.encode(), int(number)))
            case "demo":
                return int(library.call("IfmOpenDemo", int(place or 1)))
    except ValueError as fault:
        if isinstance(fault, UnusableInput):
            raise
    raise UnusableInput(f"interferometer: address {address!r} cannot be read; write {_FORMS}")


def _usb(library: VendorLibrary, place: str) -> int:
    count = int(library.call("IfmSearchUSBDevices"))
    if count <= 0:
        raise LinkLost("interferometer: no device on USB; check cable, supply and driver")
    if not place.startswith("serial="):
        return int(library.call("IfmOpenUSB", int(place or 0)))
    wanted = int(place.removeprefix("serial="))
    serials = [int(library.call("IfmUSBDeviceSerial", k)) for k in range(count)]
    if wanted not in serials:
        found = ", ".join(map(str, serials))
        raise LinkLost(f"interferometer: no device with serial {wanted} on USB; found: {found}")
    return int(library.call("IfmOpenUSB", serials.index(wanted)))
