"""Optics of a displacement interferometer: air, fringes, quadrature; functions of arrays."""

from hardware.optics.air_track import STALE_AFTER, AirCorrected, AirTrack, correct_record
from hardware.optics.beam import BeamState, BeamWatch, watch_beam
from hardware.optics.counting import (
    block_duration,
    displacement_per_fringe,
    increments_of_bits,
    largest_rate,
    largest_speed,
    smallest_step,
    wavelength_in_air,
)
from hardware.optics.ellipse import SHORTEST_ARC, Ellipse, EllipseFit, fit_ellipse
from hardware.optics.fringes import (
    Jump,
    Miscounts,
    Repair,
    find_miscounts,
    largest_amplitude,
    repaired,
)
from hardware.optics.geometry import abbe_error, cosine_corrected, cosine_error, dead_path_error
from hardware.optics.index_uncertainty import (
    IndexUncertainty,
    Sensitivity,
    SensorUncertainty,
    index_uncertainty,
    sensitivity,
)
from hardware.optics.quadrature import (
    Demodulated,
    Demodulator,
    displacement_of_phase,
    quadrature_displacement,
)
from hardware.optics.refraction import (
    FORMULA_DOMAIN,
    HELIUM_NEON,
    SENSOR_DOMAIN,
    ValidRange,
    ciddor_index,
    edlen_index,
    saturation_vapour_pressure,
)

__all__ = [
    "FORMULA_DOMAIN",
    "HELIUM_NEON",
    "SENSOR_DOMAIN",
    "SHORTEST_ARC",
    "STALE_AFTER",
    "AirCorrected",
    "AirTrack",
    "BeamState",
    "BeamWatch",
    "Demodulated",
    "Demodulator",
    "Ellipse",
    "EllipseFit",
    "IndexUncertainty",
    "Jump",
    "Miscounts",
    "Repair",
    "Sensitivity",
    "SensorUncertainty",
    "ValidRange",
    "abbe_error",
    "block_duration",
    "ciddor_index",
    "correct_record",
    "cosine_corrected",
    "cosine_error",
    "dead_path_error",
    "displacement_of_phase",
    "displacement_per_fringe",
    "edlen_index",
    "find_miscounts",
    "fit_ellipse",
    "increments_of_bits",
    "index_uncertainty",
    "largest_amplitude",
    "largest_rate",
    "largest_speed",
    "quadrature_displacement",
    "repaired",
    "saturation_vapour_pressure",
    "sensitivity",
    "smallest_step",
    "watch_beam",
    "wavelength_in_air",
]
