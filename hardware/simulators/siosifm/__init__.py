"""A simulated SIOS interferometer: the vendor's C interface as a stub, the device behind it.

`build` compiles the stub library, which is loaded exactly as the vendor's; `InterferometerFront`
is the device, standing before a `Rig`, that the stub asks over TCP.
"""

from hardware.simulators.siosifm.build import build
from hardware.simulators.siosifm.faults import Faults
from hardware.simulators.siosifm.front import InterferometerFront
from hardware.simulators.siosifm.optics import AirAround, Quadrature, index_of_air

__all__ = [
    "AirAround",
    "Faults",
    "InterferometerFront",
    "Quadrature",
    "build",
    "index_of_air",
]
