"""Virtual benches that conceal one effect.

Independent of the tool on purpose: own equations, own integrator, own step; only numpy, scipy and
the standard library are imported.
"""

from hardware.simulators.stack_bench import BenchRecording as BenchRecording
from hardware.simulators.stack_bench import SealedTruth as SealedTruth
from hardware.simulators.stack_bench import Truth as Truth
from hardware.simulators.stack_bench import draw_truth as draw_truth
from hardware.simulators.stack_bench import effects as effects
from hardware.simulators.stack_bench import record as record
from hardware.simulators.stack_bench import seal as seal
