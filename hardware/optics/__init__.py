"""Optics of a displacement interferometer: air, fringes, quadrature; functions of arrays."""

from hardware.optics.beam import BeamState as BeamState
from hardware.optics.beam import BeamWatch as BeamWatch
from hardware.optics.beam import watch_beam as watch_beam
from hardware.optics.counting import displacement_per_fringe as displacement_per_fringe
from hardware.optics.counting import wavelength_in_air as wavelength_in_air
from hardware.optics.ellipse import SHORTEST_ARC as SHORTEST_ARC
from hardware.optics.ellipse import Ellipse as Ellipse
from hardware.optics.ellipse import EllipseFit as EllipseFit
from hardware.optics.ellipse import fit_ellipse as fit_ellipse
from hardware.optics.fringes import Jump as Jump
from hardware.optics.fringes import Miscounts as Miscounts
from hardware.optics.fringes import Repair as Repair
from hardware.optics.fringes import find_miscounts as find_miscounts
from hardware.optics.fringes import largest_amplitude as largest_amplitude
from hardware.optics.fringes import repaired as repaired
from hardware.optics.quadrature import Demodulated as Demodulated
from hardware.optics.quadrature import Demodulator as Demodulator
from hardware.optics.quadrature import displacement_of_phase as displacement_of_phase
from hardware.optics.quadrature import quadrature_displacement as quadrature_displacement
from hardware.optics.refraction import FORMULA_DOMAIN as FORMULA_DOMAIN
from hardware.optics.refraction import HELIUM_NEON as HELIUM_NEON
from hardware.optics.refraction import SENSOR_DOMAIN as SENSOR_DOMAIN
from hardware.optics.refraction import ValidRange as ValidRange
from hardware.optics.refraction import ciddor_index as ciddor_index
from hardware.optics.refraction import saturation_vapour_pressure as saturation_vapour_pressure
