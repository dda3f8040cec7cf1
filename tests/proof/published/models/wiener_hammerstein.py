"""The Wiener-Hammerstein circuit: low-pass, diode network, low-pass with a zero."""

from __future__ import annotations

import numpy as np

from bondgraph import BondGraph, C, De, I, MSe, One, R, Se, Zero
from bondgraph.graph.modulation import effort
from tests.proof.published.models.diode_clamp import DiodeClamp

LEVEL = 1e3  # ohm; the impedance of a buffered section cannot be seen from outside


def wiener_hammerstein(
    *,
    real_poles: tuple[float, float] = (2756.4, 1761.5),
    pairs: tuple[tuple[float, float], tuple[float, float]] = (
        (4702.9, 1378.2),
        (1684.9, 805.7),
    ),
    zero: float = 5773.5,
    clamp: DiodeClamp | None = None,
) -> BondGraph:
    """Return the buffered chain of two third-order filters around a diode; reads ``y``.

    The first filter is a Chebyshev low-pass (0.5 dB, 4.4 kHz), the second an inverse Chebyshev
    (40 dB from 5 kHz) with a zero in its stop band: J. Schoukens, J. Suykens, L. Ljung,
    Wiener-Hammerstein benchmark, SYSID 2009. Each is an RC section and an RLC loop behind buffers
    (sources without back action); a tap of the second coil gives the zero. Defaults are the poles
    and the zero of the ideal filters.

    Parameters
    ----------
    real_poles : (float, float)
        Corner frequencies of the RC sections, Hz.
    pairs : ((float, float), (float, float))
        Modulus and damping (negative real part) of the RLC loops' poles, Hz.
    zero : float
        Transmission zero, Hz.
    clamp : DiodeClamp, optional
        Start values of the diode network.
    """
    turn = 2.0 * np.pi
    coils = [LEVEL / (2.0 * turn * damping) for _, damping in pairs]
    capacitors = [1.0 / (h * (turn * f) ** 2) for h, (f, _) in zip(coils, pairs, strict=True)]
    with BondGraph("wiener_hammerstein") as g:
        tap = g.parameter("tap", (pairs[1][0] / zero) ** 2)
        loss = g.parameter("tap_loss", 0.0, positive=False, scale=0.01)
        g.parameter("tau_y", 2e-7, "s", lower=1e-9, upper=1e-5)
        first = One("first")
        Se("u", unit="V") >> first
        _rc(first, "1", real_poles[0])
        second = One("second")
        MSe("buffer_1", value=effort("C_1"), unit="V") >> second
        _rlc(second, "2", coils[0], capacitors[0])
        network = One("network")
        MSe("buffer_2", value=effort("C_2"), unit="V") >> network
        network >> R("R_s", LEVEL, unit="ohm", fixed=True)
        network >> R("D", law=clamp or DiodeClamp(), unit="ohm")
        third = One("third")
        MSe("buffer_3", value=effort("D"), unit="V") >> third
        _rc(third, "3", real_poles[1])
        fourth = One("fourth")
        MSe("buffer_4", value=effort("C_3"), unit="V") >> fourth
        _rlc(fourth, "4", coils[1], capacitors[1])
        seen = effort("C_4") + tap * effort("L_4") + loss * effort("R_4")
        plug = Zero("plug")
        MSe("buffer_5", value=seen, unit="V") >> plug >> De("y", unit="V", lag="tau_y")
    return g


def _rc(node: One, number: str, corner: float) -> None:
    node >> R(f"R_{number}", LEVEL, unit="ohm", fixed=True)
    node >> C(f"C_{number}", 1.0 / (2.0 * np.pi * corner * LEVEL), unit="F")


def _rlc(node: One, number: str, coil: float, capacitor: float) -> None:
    node >> R(f"R_{number}", LEVEL, unit="ohm", fixed=True)
    node >> I(f"L_{number}", coil, unit="H")
    node >> C(f"C_{number}", capacitor, unit="F")
