"""What a fringe is worth, by chapter 4 of the stack actuator thesis."""

from __future__ import annotations

import pytest

from bondgraph.support.errors import UnusableInput
from hardware.optics import (
    ciddor_index,
    displacement_per_fringe,
    wavelength_in_air,
)

LASER = 632.9908e-9


def test_wavelength_in_a_laboratory() -> None:
    n = float(ciddor_index(293.15, 101.3e3, 0.5))
    assert wavelength_in_air(LASER, n) == pytest.approx(632.819e-9, abs=0.5e-12)
    assert displacement_per_fringe(LASER, n) == pytest.approx(316.41e-9, abs=0.01e-9)
    assert displacement_per_fringe(LASER, n, 4) == pytest.approx(158.2e-9, abs=0.1e-9)


@pytest.mark.parametrize(
    "call",
    [
        lambda: displacement_per_fringe(LASER, factor=0),
        lambda: displacement_per_fringe(-1.0),
        lambda: wavelength_in_air(LASER, float("nan")),
    ],
)
def test_senseless_numbers_are_refused(call: object) -> None:
    with pytest.raises(UnusableInput):
        call()  # type: ignore[operator]
