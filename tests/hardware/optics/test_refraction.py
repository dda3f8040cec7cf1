"""Air against the tables that NIST and IAPWS print."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.optics import (
    FORMULA_DOMAIN,
    SENSOR_DOMAIN,
    ciddor_index,
    saturation_vapour_pressure,
)

# Stone and Zimmerman, NIST Engineering Metrology Toolbox, table 1, 450 ppm CO2:
# C, % RH, kPa, nm, index
NIST = (
    (20, 0, 101.325, 633, 1.000271800),
    (20, 0, 60, 633, 1.000160924),
    (20, 0, 120, 633, 1.000321916),
    (50, 0, 100, 633, 1.000243285),
    (5, 0, 100, 633, 1.000282756),
    (-40, 0, 100, 633, 1.000337580),
    (50, 100, 120, 633, 1.000287924),
    (40, 75, 120, 633, 1.000299418),
    (20, 100, 100, 633, 1.000267394),
    (40, 100, 110, 1700, 1.000270247),
    (20, 0, 101.325, 1700, 1.000268479),
    (40, 100, 110, 300, 1.000289000),
    (20, 0, 101.325, 300, 1.000286581),
    (-40, 0, 120, 300, 1.000427233),
)


@pytest.mark.parametrize("row", NIST)
def test_the_equation_gives_the_table_of_nist(row: tuple[float, ...]) -> None:
    t, rh, kpa, nm, ciddor = row
    air = (t + 273.15, 1e3 * kpa, 0.01 * rh, 1e-9 * nm)
    # the table has nine decimals
    assert abs(float(ciddor_index(*air, domain=FORMULA_DOMAIN)) - ciddor) < 0.6e-9


def test_ten_decimals_of_the_package_ref_index() -> None:
    # PyPI ref-index 1.0, which follows the same documentation
    for t, p, h, ciddor in (
        (20.0, 101325.0, 0.2, 1.0002716285340578),
        (10.0, 80000.0, 0.8, 1.000221805389423),
        (45.0, 115000.0, 0.6, 1.0002822647980902),
    ):
        assert float(ciddor_index(t + 273.15, p, h, 633e-9)) == pytest.approx(ciddor, abs=2e-12)


def test_vapour_pressure_gives_the_check_values_of_the_formulation() -> None:
    # IAPWS-IF97, table 35
    printed = [0.353658941e4, 0.263889776e7, 0.123443146e8]
    assert saturation_vapour_pressure([300.0, 500.0, 600.0]) == pytest.approx(printed, rel=1e-8)
    # the triple point from both sides, and ice below water
    assert float(saturation_vapour_pressure(273.16)) == pytest.approx(611.657, rel=2e-4)
    assert float(saturation_vapour_pressure(273.1499)) == pytest.approx(611.15, rel=2e-4)
    assert float(saturation_vapour_pressure(253.15)) == pytest.approx(103.26, rel=1e-3)


@pytest.mark.parametrize(
    ("air", "named"),
    [
        ((20.0, 101325.0, 0.5), "temperature"),
        ((277.0, 101325.0, 0.5), "temperature"),
        ((np.nan, 101325.0, 0.5), "temperature nan"),
        ((293.15, 1013.25, 0.5), "pressure"),
        ((293.15, 121e3, 0.5), "pressure"),
        ((293.15, 101325.0, 50.0), "humidity"),
        ((293.15, 101325.0, -0.1), "humidity"),
    ],
)
def test_wrong_air_is_refused_by_name(air: tuple[float, float, float], named: str) -> None:
    with pytest.raises(UnusableInput, match=named):
        ciddor_index(*air)
    assert not SENSOR_DOMAIN.contains(*air)


def test_wavelength_and_gas_are_checked() -> None:
    with pytest.raises(UnusableInput, match="wavelength"):
        ciddor_index(293.15, 1e5, 0.5, 633.0)
    with pytest.raises(UnusableInput, match="carbon dioxide"):
        ciddor_index(293.15, 1e5, 0.5, carbon_dioxide=450.0)
    with pytest.raises(UnusableInput, match="temperature"):
        saturation_vapour_pressure(20.0)


def test_ends_of_the_sensors_belong_to_them() -> None:
    assert SENSOR_DOMAIN.contains([4.0 + 273.15, 50.0 + 273.15], [70e3, 120e3], [0.0, 1.0])
    ciddor_index([277.15, 323.15], 70e3, 0.5)


def test_arrays_broadcast_and_equal_single_values() -> None:
    T = np.linspace(285.0, 305.0, 7)
    many = ciddor_index(T, 1e5, 0.4)
    assert many.shape == (7,)
    assert many[3] == float(ciddor_index(T[3], 1e5, 0.4))
    assert np.all(np.diff(many) < 0.0)
