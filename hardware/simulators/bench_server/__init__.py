"""A whole virtual bench: plant, devices before it, and the program's clock, in one place."""

from hardware.simulators.bench_server.config import (
    AirConfig,
    BenchConfig,
    PlantConfig,
    load_config,
)
from hardware.simulators.bench_server.plants import Stand, stand_of
from hardware.simulators.bench_server.sealing import SealedEnvelope
from hardware.simulators.bench_server.server import BenchServer
from hardware.simulators.bench_server.serving import serve

__all__ = [
    "AirConfig",
    "BenchConfig",
    "BenchServer",
    "PlantConfig",
    "SealedEnvelope",
    "Stand",
    "load_config",
    "serve",
    "stand_of",
]
