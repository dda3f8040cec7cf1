"""A simulated SIOS interferometer: the vendor's C interface as a stub, the device behind it.

`build` compiles the stub library, which is loaded exactly as the vendor's; `InterferometerFront`
is the device, standing before a `Rig`, that the stub asks over TCP.
"""

from hardware.simulators.siosifm.build import build as build
from hardware.simulators.siosifm.faults import Faults as Faults
from hardware.simulators.siosifm.front import InterferometerFront as InterferometerFront
from hardware.simulators.siosifm.optics import AirAround as AirAround
from hardware.simulators.siosifm.optics import Quadrature as Quadrature
from hardware.simulators.siosifm.optics import index_of_air as index_of_air
