"""What data determine and what they do not, in numbers and in words."""

from __future__ import annotations

from identification.uncertainty.combinations import Combination as Combination
from identification.uncertainty.combinations import FlatBlock as FlatBlock
from identification.uncertainty.combinations import flat_blocks as flat_blocks
from identification.uncertainty.coverage import Case as Case
from identification.uncertainty.coverage import Coverage as Coverage
from identification.uncertainty.coverage import coverage as coverage
from identification.uncertainty.coverage import wilson as wilson
from identification.uncertainty.extra_sensor import SensorGain as SensorGain
from identification.uncertainty.extra_sensor import helpful_sensors as helpful_sensors
from identification.uncertainty.finding import Finding as Finding
from identification.uncertainty.fitted import FitView as FitView
from identification.uncertainty.fitted import fitted as fitted
from identification.uncertainty.fitted import from_estimation as from_estimation
from identification.uncertainty.information import Information as Information
from identification.uncertainty.information import Sensitivities as Sensitivities
from identification.uncertainty.information import information as information
from identification.uncertainty.postflight import postflight as postflight
from identification.uncertainty.postflight import practical_of as practical_of
from identification.uncertainty.practical import Limits as Limits
from identification.uncertainty.practical import Practical as Practical
from identification.uncertainty.practical import practical as practical
from identification.uncertainty.preflight import preflight as preflight
from identification.uncertainty.profile import Profile as Profile
from identification.uncertainty.profile import profile as profile
from identification.uncertainty.profile import threshold_of as threshold_of
from identification.uncertainty.profiles import profile_one as profile_one
from identification.uncertainty.profiles import profiles as profiles
from identification.uncertainty.sampling import Sample as Sample
from identification.uncertainty.sampling import sample as sample
from identification.uncertainty.sampling import split_rhat as split_rhat
from identification.uncertainty.statements import Statement as Statement
from identification.uncertainty.structural import (
    StructuralIdentifiability as StructuralIdentifiability,
)
from identification.uncertainty.structural import identifiability as identifiability
from identification.uncertainty.words import report as report
