"""A bench described in a file, and opened from it."""

from hardware.station.opening import OpenStation, open_station
from hardware.station.settings import (
    AmplifierSettings,
    ClockSettings,
    InterferometerSettings,
    OutputSettings,
    StationSettings,
    read_settings,
    settings_from,
)

__all__ = [
    "AmplifierSettings",
    "ClockSettings",
    "InterferometerSettings",
    "OpenStation",
    "OutputSettings",
    "StationSettings",
    "open_station",
    "read_settings",
    "settings_from",
]
