"""A bench described in a file, and opened from it."""

from hardware.station.opening import OpenStation as OpenStation
from hardware.station.opening import open_station as open_station
from hardware.station.settings import AmplifierSettings as AmplifierSettings
from hardware.station.settings import ClockSettings as ClockSettings
from hardware.station.settings import InterferometerSettings as InterferometerSettings
from hardware.station.settings import OutputSettings as OutputSettings
from hardware.station.settings import StationSettings as StationSettings
from hardware.station.settings import read_settings as read_settings
from hardware.station.settings import settings_from as settings_from
