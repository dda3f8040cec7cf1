"""Plants of the virtual bench, and what disturbs them."""

from hardware.simulators.plants.disturbance import AirPath as AirPath
from hardware.simulators.plants.disturbance import Disturbance as Disturbance
from hardware.simulators.plants.disturbance import Disturbed as Disturbed
from hardware.simulators.plants.disturbance import Press as Press
from hardware.simulators.plants.disturbance import SensorNoise as SensorNoise
from hardware.simulators.plants.disturbance import Vibration as Vibration
from hardware.simulators.plants.generated import GeneratedPlant as GeneratedPlant
from hardware.simulators.plants.memory import Creeping as Creeping
from hardware.simulators.plants.memory import HystereticPlant as HystereticPlant
from hardware.simulators.plants.plate import PlatePlant as PlatePlant
from hardware.simulators.plants.stack import ConcealedStack as ConcealedStack
from hardware.simulators.plants.stack import conceal as conceal
from hardware.simulators.plants.stack import plain_stack as plain_stack
from hardware.simulators.plants.ultrasonic import UltrasonicPlant as UltrasonicPlant
