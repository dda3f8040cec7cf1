"""Front door of the virtual piezo stack bench."""

from hardware.simulators.bench import BenchRecording, record, visibility
from hardware.simulators.draw import ChannelNoise, Truth, draw_truth
from hardware.simulators.effects import CATALOGUE, RATIO_RANGES, STRENGTHS, HiddenEffect, effects
from hardware.simulators.plant import PlantParameters
from hardware.simulators.seal import SealBrokenError, SealedTruth, seal

__all__ = [
    "CATALOGUE",
    "RATIO_RANGES",
    "STRENGTHS",
    "BenchRecording",
    "ChannelNoise",
    "HiddenEffect",
    "PlantParameters",
    "SealBrokenError",
    "SealedTruth",
    "Truth",
    "draw_truth",
    "effects",
    "record",
    "seal",
    "visibility",
]
