"""Virtual benches and plants that conceal effects.

Independent of the tool on purpose: own equations, own integrator, own step; only numpy, scipy and
the standard library are imported.
"""

from hardware.simulators.bench import record as record
from hardware.simulators.draw import Truth as Truth
from hardware.simulators.draw import draw_truth as draw_truth
from hardware.simulators.effects import effects as effects
