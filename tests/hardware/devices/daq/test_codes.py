"""Volts and codes."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hardware.devices.daq.codes import STEP, dac_codes, dac_volts, input_volts


@given(st.lists(st.integers(0, 0x3FFF), min_size=1, max_size=50))
def test_every_output_code_survives_the_way_through_volts(codes: list[int]) -> None:
    assert dac_codes(dac_volts(np.array(codes))).tolist() == codes


@given(st.floats(-10.0, 10.0))
def test_a_voltage_is_met_within_half_a_step_but_at_the_very_top(volts: float) -> None:
    code = dac_codes(np.array([volts]))
    miss = abs(float(dac_volts(code)[0]) - volts)
    assert miss <= STEP * (1.0 if volts > 10.0 - STEP else 0.5) + 1e-12


@given(st.integers(-0x2000, 0x1FFF), st.sampled_from([0x0000, 0xC000]))
def test_input_words_are_twos_complement_whatever_stands_above_them(code: int, above: int) -> None:
    assert input_volts(np.array([(code & 0x3FFF) | above]))[0] == code * STEP


def test_the_named_points() -> None:
    assert dac_codes(np.array([-10.0, 0.0, 10.0])).tolist() == [0, 0x2000, 0x3FFF]
    assert dac_volts(np.array([0x2000]))[0] == 0.0
