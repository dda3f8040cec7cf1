"""Impoverished textbook models: where a diagnosis starts."""

from __future__ import annotations

from bondgraph import TF, BondGraph, C, De, Dq, I, One, R, Se, Zero


def mass_with_viscous_friction(mass: float = 50.0, damping: float = 300.0) -> BondGraph:
    """Return a driven carriage: ``M x'' + F_v x' = F``; reads the position ``x``.

    Parameters
    ----------
    mass : float
        kg.
    damping : float
        N s/m.

    Examples
    --------
    >>> equations(mass_with_viscous_friction()).states
    ('p_M', 'q_x')
    """
    with BondGraph("mass_with_viscous_friction") as g:
        carriage = One("carriage")
        Se("F", unit="N") >> carriage
        carriage >> I("M", mass, unit="kg")
        carriage >> R("F_v", damping, unit="N*s/m")
        carriage >> Dq("x", unit="m")
    return g


def resonator(mass: float = 4e-6, damping: float = 2e-4, stiffness: float = 0.8) -> BondGraph:
    """Return a mass on a spring: ``m y'' + d y' + k y = u``; command and reading may be voltages.

    The electronic resonators of benchmarks have arbitrary units; only the ratios matter.

    Examples
    --------
    >>> round(float(equations(resonator()).eigenvalues().imag.max() / (2 * np.pi)), 2)  # Hz
    71.06
    """
    with BondGraph("resonator") as g:
        body = One("body")
        Se("u", unit="V") >> body
        body >> I("m", mass, unit="V*s2/V")
        body >> R("d", damping, unit="V*s/V")
        body >> C("k", stiffness=stiffness, unit="V/V")
        body >> Dq("y", unit="V")
    return g


def thermal_lag(gain: float = 1.0, resistance: float = 1.0, capacity: float = 0.3) -> BondGraph:
    """First-order heating: a heater warms a capacity through a resistance; ``y`` is above ambient.

    The heater command `u` (V) makes a temperature through the gain ``K``; only ``K`` and the
    time constant ``R_th C_th`` show in the reading, so the capacity is a gauge. With no heat the
    reading goes to zero: what a thermometer shows of the surroundings is its offset.

    Examples
    --------
    >>> warmed = simulate(thermal_lag(), t, {"u": 1.0 + 0 * t})
    >>> round(float(warmed["y"][-1]), 3)
    1.0
    """
    with BondGraph("thermal_lag") as g:
        heater, air = One("heater"), Zero("air")
        Se("u", unit="V") >> TF("K", ratio=1.0 / gain) >> heater
        # temperatures count in volts of the thermometer, so neither value has a thermal unit
        heater >> R("R_th", resistance)
        heater >> air >> C("C_th", capacity, fixed=True)
        air >> De("y", unit="V")
    return g
