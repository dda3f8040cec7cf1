"""Wiener-Hammerstein circuit with a plain resistor where its diode network sits."""

from __future__ import annotations

import numpy as np

from bondgraph import BondGraph, C, I, MSe, One, R, Reading, Se
from bondgraph.graph.modulation import effort
from tests.proof.real.case import Published, RealCase, Truth
from tests.proof.real.preparing import at_boundary

__all__ = ["CASES", "two_linear_filters"]

LEVEL = 1e3
"""ohm; the impedance of a buffered section cannot be seen from outside."""
BEFORE, AFTER = 12_000, 8_000
"""Samples kept on both sides of the published boundary."""
TURN = 2.0 * np.pi


def two_linear_filters() -> BondGraph:
    """Return two third-order filters with a resistive divider between them: ``u`` to ``y`` (V).

    A Chebyshev low-pass (0.5 dB, 4.4 kHz), then an inverse Chebyshev (40 dB from 5 kHz) whose
    zero is a tap of its coil: J. Schoukens, J. Suykens, L. Ljung, Wiener-Hammerstein benchmark,
    SYSID 2009. Start values are the poles and the zero of the ideal filters; sections are
    separated by buffers, sources without back action.
    """
    with BondGraph("two_linear_filters") as g:
        tap = g.parameter("tap", (1684.9 / 5773.5) ** 2)
        first = One("first")
        Se("u", unit="V") >> first
        _rc(first, "1", 2756.4)
        second = One("second")
        MSe("buffer_1", value=effort("C_1"), unit="V") >> second
        _rlc(second, "2", 4702.9, 1378.2)
        divider = One("divider")
        MSe("buffer_2", value=effort("C_2"), unit="V") >> divider
        divider >> R("R_s", LEVEL, unit="ohm", fixed=True)
        divider >> R("R_d", LEVEL, unit="ohm")
        third = One("third")
        MSe("buffer_3", value=effort("R_d"), unit="V") >> third
        _rc(third, "3", 1761.5)
        fourth = One("fourth")
        MSe("buffer_4", value=effort("C_3"), unit="V") >> fourth
        _rlc(fourth, "4", 1684.9, 805.7)
        Reading("y", effort("C_4") + tap * effort("L_4"), unit="V")
    return g


def _rc(node: One, number: str, corner: float) -> None:
    node >> R(f"R_{number}", LEVEL, unit="ohm", fixed=True)
    node >> C(f"C_{number}", 1.0 / (TURN * corner * LEVEL), unit="F")


def _rlc(node: One, number: str, modulus: float, damping: float) -> None:
    """Add a loop with a pair of poles, Hz; damping is the negative real part."""
    coil = LEVEL / (2.0 * TURN * damping)
    node >> R(f"R_{number}", LEVEL, unit="ohm", fixed=True)
    node >> I(f"L_{number}", coil, unit="H")
    node >> C(f"C_{number}", 1.0 / (coil * (TURN * modulus) ** 2), unit="F")


_BETWEEN = ("R_d", "R_s", "buffer_2", "buffer_3")
_WHY = "a diode and resistors between the two filters clip one side"

CASES = (
    RealCase(
        name="wiener_hammerstein",
        dataset="wiener_hammerstein",
        parts=("train/noise", "test/noise"),
        prepare=at_boundary(
            "wiener_hammerstein",
            f"{BEFORE} samples before and {AFTER} after the published boundary, without a gap",
            f"the published boundary; {BEFORE} samples before it train, {AFTER} after it judge",
            before=BEFORE, after=AFTER,
        ),
        model=two_linear_filters,
        truth=(
            Truth("diode", _BETWEEN, _WHY),
            Truth("nonlinear_resistance", _BETWEEN, _WHY),
            Truth("saturation", _BETWEEN, _WHY),
        ),
        kinds=("dissipative", "command"),
        official=True,
        published=Published(
            0.241, "mV", "DT-SUBNET, Beintema 2021; linear models 43.4 mV",
            "same boundary, but over all 78 800 test samples",
        ),
        comment="anything before the first or behind the second filter is the wrong place",
    ),
)  # fmt: skip
