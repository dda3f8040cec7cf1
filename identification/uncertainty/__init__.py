"""What data determine and what they do not, in numbers and in words."""

from __future__ import annotations

from identification.uncertainty.combinations import Combination, FlatBlock, flat_blocks
from identification.uncertainty.coverage import Case, Coverage, coverage, wilson
from identification.uncertainty.extra_sensor import SensorGain, helpful_sensors
from identification.uncertainty.finding import Finding
from identification.uncertainty.fitted import FitView, fitted, from_estimation
from identification.uncertainty.information import Information, Sensitivities, information
from identification.uncertainty.postflight import postflight, practical_of
from identification.uncertainty.practical import Limits, Practical, practical
from identification.uncertainty.preflight import preflight
from identification.uncertainty.profile import Profile, profile, threshold_of
from identification.uncertainty.profiles import profile_one, profiles
from identification.uncertainty.sampling import Sample, sample, split_rhat
from identification.uncertainty.statements import Statement
from identification.uncertainty.structural import StructuralIdentifiability, identifiability
from identification.uncertainty.words import report

__all__ = [
    "Case",
    "Combination",
    "Coverage",
    "Finding",
    "FitView",
    "FlatBlock",
    "Information",
    "Limits",
    "Practical",
    "Profile",
    "Sample",
    "Sensitivities",
    "SensorGain",
    "Statement",
    "StructuralIdentifiability",
    "coverage",
    "fitted",
    "flat_blocks",
    "from_estimation",
    "helpful_sensors",
    "identifiability",
    "information",
    "postflight",
    "practical",
    "practical_of",
    "preflight",
    "profile",
    "profile_one",
    "profiles",
    "report",
    "sample",
    "split_rhat",
    "threshold_of",
    "wilson",
]
