"""The Silverbox: an electronic oscillator with a hardening spring."""

from __future__ import annotations

from bondgraph import BondGraph, C, Dq, I, MSe, MSf, One, R, Se
from bondgraph.graph.modulation import displacement, effort
from bondgraph.laws import Polynomial

AHEAD = 2e-5  # s; far below the sampling interval, so that its value does not matter
RANGE = 0.25  # V; the coefficients are what each term adds at this displacement


def silverbox(mass: float = 5.4e-6, damping: float = 2.2e-4, stiffness: float = 1.0) -> BondGraph:
    """Return ``m y'' + d y' + k y + N(y) + tau N(y)' = u``; command and reading are voltages.

    N is quadratic and cubic. The feedback of N has damping of its own, in proportion to N's rate
    as in a spring of a lossy material: ``tau N' = tau (2 a_2 y + 3 a_3 y^2) y'``, that is damping
    that grows with the square of the displacement. The multiplier that forms N is a resistor with
    N as its law, whose flow is the displacement; the rate of N is the effort of an inertia behind
    a resistor, with a time constant of 20 us.

    T. Wigren, J. Schoukens, Three free data sets for development and benchmarking in nonlinear
    system identification, European Control Conference 2013.

    Parameters
    ----------
    mass, damping, stiffness : float
        Start values; per volt, in seconds.
    """
    with BondGraph("silverbox") as g:
        tau = g.parameter("tau", 5e-5, "s", positive=False, scale=5e-5)
        body = One("body")
        Se("u", unit="V") >> body
        body >> I("m", mass, unit="V*s2/V")
        body >> R("d", damping, unit="V*s/V")
        body >> C("k", stiffness=stiffness, unit="V/V")
        body >> Dq("y", unit="V")
        multiplier = One("multiplier")
        MSf("seen", value=displacement("k")) >> multiplier
        law = Polynomial(half=RANGE, size=0.2 * RANGE, orders=(2, 3), unit="V")
        multiplier >> R("N", 1.0, law=law, fixed=True)
        bent = effort("N") - displacement("k")  # the resistor's own 1 ohm taken off
        rate = One("rate")
        MSe("copy", value=bent) >> rate
        rate >> R("R_r", 1.0, fixed=True)
        rate >> I("I_r", AHEAD, fixed=True)
        body >> MSe("feedback", value=bent + tau / AHEAD * effort("I_r"), unit="V")
    return g
