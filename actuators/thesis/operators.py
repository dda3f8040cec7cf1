"""The printed operators: sets (6.2), (6.3), the inverse of sec 6.5, table 6.4.

The numbers of (6.2), (6.3) and table 6.4 live in the class methods ``stack_2hz`` of their
operators; here they are listed with their symbols. The set of sec 6.5 lives here.
"""

from __future__ import annotations

from actuators.stack.scaling import scaled
from actuators.thesis.tables import TABLE_6_2
from actuators.thesis.values import Printed, named
from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    AngInverse,
    DeadZones,
    MaxwellResistiveCapacitor,
    PrandtlIshlinskii,
)

N_PRINTED_WEIGHTS = 11
"""Weights in (6.3); 13 thresholds are announced, the last two weights are missing."""

DIPOLE_SCALE = 1e8
FIELD_SCALE = 1e-3
"""Dipole and field were multiplied by these before the fit (sec 6.5)."""

_INVERSE_THRESHOLDS = (
    0.0, 0.55, 1.82, 3.17, 4.62, 6.16, 7.79, 9.48, 11.23, 13.08, 15.01, 16.94, 18.89,
)  # fmt: skip
_INVERSE_WEIGHTS = (
    4.2e-1, -2.4e-1, -9.4e-3, -1.2e-2, -9.6e-3, -7.8e-3, -5.2e-3, -5.4e-3, -6.0e-3, -5.7e-3,
    -5.0e-4, -1.0e-4, -2.0e-6,
)  # fmt: skip


def ang_inverse_scaled() -> AngInverse:
    """Return the printed inverse of sec 6.5, scaled dipole to scaled field.

    Returns
    -------
    AngInverse
        Input ``1e8 p`` with p in C m, output ``1e-3 E`` with E in V/m.
    """
    return AngInverse(
        DeadZones((0.0, 2.51), (16.81, -12.32)),
        PrandtlIshlinskii(_INVERSE_THRESHOLDS, _INVERSE_WEIGHTS),
    )


def ang_recovered_scaled() -> Ang:
    """Return the forward operator behind `ang_inverse_scaled`, scaled field to scaled dipole.

    Inverting twice returns the parameters, so the fit that was made can be read off: 13 plays at
    0.23 i, which is the half range 50 V / 18 mm in twelve steps, as the text says.
    """
    return ang_inverse_scaled().inverse()


def polarisation_operator_printed() -> AngInverse:
    """Return the printed ``E = C_nl(p)`` of sec 6.5, C m to V/m."""
    return scaled(ang_inverse_scaled(), DIPOLE_SCALE, 1.0 / FIELD_SCALE)


def ang_with_spacing(step: float, *, first: int = 0) -> Ang:
    """Return the eleven printed weights of (6.3) on other thresholds, ``(i + first) step``.

    Parameters
    ----------
    step : float
        V, > 0.
    first : int
        0, or 1 if the weight of width 0 is taken to be the missing one.

    Returns
    -------
    Ang
        V to m.
    """
    printed = Ang.stack_2hz()
    weights = printed.play.weights[:N_PRINTED_WEIGHTS]
    thresholds = tuple((i + first) * step for i in range(N_PRINTED_WEIGHTS))
    if first:
        thresholds, weights = (0.0, *thresholds), (0.0, *weights)
    return Ang(PrandtlIshlinskii(thresholds, weights), printed.dead_zone)


def set_6_2() -> tuple[Printed, ...]:
    """Return (6.2), Al Janaideh's operator."""
    o, where = AlJanaideh.stack_2hz(), "eq (6.2)"
    gauge = "only four of the five count: hold c = 1"
    return (
        Printed("J", float(o.count), "1", where),
        Printed("alpha", o.alpha, "m", where, "per unit of eta"),
        Printed("q", o.q, "m", where, "per unit of eta"),
        Printed("sigma_r", o.sigma, "1", where, "in units of eta, in volts sigma_r / c"),
        Printed("beta", o.beta, "1", where, "per unit of eta"),
        Printed("c", o.c, "1/V", where, gauge),
    )


def set_6_3() -> tuple[Printed, ...]:
    """Return (6.3), Ang's operator, as it is printed: eleven weights."""
    o, where = Ang.stack_2hz(), "eq (6.3)"
    missing = "the weights of r_11 and r_12 are not printed; 0 gives the loop"
    backlash = tuple(
        Printed(f"wf_{i}", w, "m/V", where, missing)
        for i, w in enumerate(o.play.weights[:N_PRINTED_WEIGHTS])
    )
    bends = tuple(Printed(f"ws_{i}", w, "1", where) for i, w in enumerate(o.dead_zone.weights))
    units = "output unit of the backlash stage; no order between d and r"
    return (
        Printed("sigma_r", 4.17, "V", where, "50/12, rounded"),
        *(
            Printed(f"d_{i}", d, "m", where, units if i else "")
            for i, d in enumerate(o.dead_zone.thresholds)
        ),
        *bends,
        *backlash,
    )


def set_6_5() -> tuple[Printed, ...]:
    """Return the inverse of sec 6.5, in the scaled units it is printed in."""
    o, where = ang_inverse_scaled(), "sec 6.5"
    rows = (
        ("r", o.play.thresholds, "1e8 p, bent"),
        ("wf", o.play.weights, "1"),
        ("d", o.dead_zone.thresholds, "1e8 p"),
        ("ws", o.dead_zone.weights, "1"),
    )
    note = f"scaled: p x {DIPOLE_SCALE:.0e}, E x {FIELD_SCALE:.0e}"
    return tuple(
        Printed(f"{name}_{i}", v, unit, where, note)
        for name, values, unit in rows
        for i, v in enumerate(values)
    )


def table_6_4() -> tuple[Printed, ...]:
    """Return the capacitances and breakaway voltages of table 6.4."""
    o, where = MaxwellResistiveCapacitor.stack_2hz(), "table 6.4"
    note = f"with T = {named(TABLE_6_2, 'T')} of table 6.1 the loop comes out too small"
    pairs = zip(o.stiffnesses, o.breakaways, strict=True)
    return tuple(
        entry
        for i, (k, v) in enumerate(pairs, start=1)
        for entry in (
            Printed(f"C_{i}", 1.0 / k, "F", where, note),
            Printed(f"v_{i}", v, "V", where, note),
        )
    )
