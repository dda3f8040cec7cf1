"""Virtual benches that conceal one effect.

Independent of the tool on purpose: own equations, own integrator, own step; only numpy, scipy and
the standard library are imported.
"""

from hardware.simulators.stack_bench import (
    BenchRecording,
    SealedTruth,
    Truth,
    draw_truth,
    effects,
    record,
    seal,
)

__all__ = ["BenchRecording", "SealedTruth", "Truth", "draw_truth", "effects", "record", "seal"]
