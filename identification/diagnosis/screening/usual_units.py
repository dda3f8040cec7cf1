"""Units that instruments write, and which one numbers look like that are read in another."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bondgraph.signals.units import Unit, parse_unit, read_unit

USUAL = (
    "V mV uV kV A mA uA ohm mohm kohm C mC uC W mW kW T mT Wb mWb "
    "rad deg mrad urad rev rad/s deg/s rpm rev/s rad/s^2 deg/s^2 1 % ppm "
    "m mm um nm cm inch m/s mm/s um/s cm/s km/h m/s^2 mm/s^2 g0 "
    "N mN kN lbf N*m mN*m kN*m N*mm Pa kPa MPa bar mbar psi "
    "m^3 l ml m^3/s l/s l/min ml/s ml/min m^3/h l/h kg g kg/s g/s kg/h K mK J kJ Wh s ms us min h"
).split()
"""In the words that a header takes; SI among them, for numbers that are in it after all."""
SAME = 0.01
"""Relative difference of two factors that are one."""


@lru_cache(maxsize=256)
def alike(unit: str) -> tuple[Unit, ...]:
    """Return the usual units of what a unit measures.

    Angles are told from pure numbers, and energies from torques, which have their dimensions.
    """
    known = read_unit(unit)
    if known is None:
        return ()
    quantity = _quantity(known)
    return tuple(
        u for u in map(parse_unit, USUAL) if u.dims == known.dims and _quantity(u) == quantity
    )  # fmt: skip


def _quantity(unit: Unit) -> str:
    symbols = {symbol for symbol, _ in unit.factors}
    return "angle" if "rad" in symbols else "energy" if "J" in symbols else ""


def conversions(unit: str) -> tuple[float, ...]:
    """Return how many times too large numbers are that are in another usual unit.

    Examples
    --------
    >>> [round(f, 3) for f in conversions("rad/s")]
    [57.296, 9.549, 0.159]
    """
    return tuple(factor for factor, _ in _factors(unit))


def named(unit: str, factor: float) -> str:
    """Return the usual unit whose numbers are so many times too large; empty if there is none.

    Examples
    --------
    >>> named("rad/s", 9.5493), named("V", 1e-3), named("V", 17.0)
    ('rpm', 'kV', '')
    """
    near = (name for f, name in _factors(unit) if factor > 0 and abs(np.log(factor / f)) < SAME)
    return next(near, "")


def _factors(unit: str) -> tuple[tuple[float, str], ...]:
    known = read_unit(unit)
    if known is None:
        return ()
    every = ((known.scale / u.scale, str(u)) for u in alike(unit))
    return tuple((f, name) for f, name in every if abs(np.log(f)) > SAME)
