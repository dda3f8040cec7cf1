"""A whole virtual bench: plant, devices before it, and the program's clock, in one place."""

from hardware.simulators.bench_server.config import AirConfig as AirConfig
from hardware.simulators.bench_server.config import BenchConfig as BenchConfig
from hardware.simulators.bench_server.config import PlantConfig as PlantConfig
from hardware.simulators.bench_server.config import load_config as load_config
from hardware.simulators.bench_server.plants import MACHINES as MACHINES
from hardware.simulators.bench_server.plants import Stand as Stand
from hardware.simulators.bench_server.plants import stand_of as stand_of
from hardware.simulators.bench_server.server import BenchServer as BenchServer
from hardware.simulators.bench_server.serving import serve as serve
from hardware.simulators.seal import SealedEnvelope as SealedEnvelope
