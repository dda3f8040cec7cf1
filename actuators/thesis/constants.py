"""Single numbers that follow from the printed constants, and what they should have been."""

from __future__ import annotations

import math
from itertools import accumulate

from actuators.stack.conversions import Lumped, Polarised
from actuators.stack.excitation import printed_demagnetisation
from actuators.thesis.operators import (
    FIELD_SCALE,
    N_PRINTED_WEIGHTS,
    ang_inverse_scaled,
    ang_recovered_scaled,
)
from actuators.thesis.refits import lumped_constants, lumped_operator, refit_lumped, stand_in
from actuators.thesis.rows import ComparisonRow
from actuators.thesis.steady import HIGH, sine, steady_loop
from actuators.thesis.tables import MEASURED_LOOP, TABLE_3_1, TABLE_6_1, TABLE_6_2
from actuators.thesis.values import named
from bondgraph.hysteresis import MaxwellResistiveCapacitor


def breakaways_as_printed(elements: MaxwellResistiveCapacitor) -> tuple[float, ...]:
    """Return the breakaway voltages that (5.11) as printed gives, ``f_i = k_i x_i``, x_1 = 0.

    Element i slips at the end of its segment, so the right form is ``f_i = k_i x_(i+1)``.
    """
    ends = elements.thresholds
    return tuple(k * x for k, x in zip(elements.stiffnesses, (0.0, *ends[:-1]), strict=True))


def _resonance(stiffness: float, mass: float) -> float:
    return math.sqrt(stiffness / mass) / (2.0 * math.pi)


def constant_rows() -> tuple[ComparisonRow, ...]:
    """Return the rows on Maxwell elements, operators, electrical and mechanical constants."""
    return (*_maxwell(), *_operators(), *_bond_graph(), *_mechanical())


def _at_top(constants: Lumped) -> tuple[float, float]:
    """Charge and hysteretic voltage at the top of the loop of tables 6.1 and 6.4."""
    x = steady_loop(lumped_operator(constants.transducer)).top
    return constants.charge_per_metre * x, HIGH - constants.volts_per_metre * x


def _maxwell() -> tuple[ComparisonRow, ...]:
    elements = MaxwellResistiveCapacitor.stack_2hz()
    lumped, refitted = lumped_constants(), lumped_constants(refit_lumped())

    (q, v), (q_new, v_new) = _at_top(lumped), _at_top(refitted)
    clamped = lumped.capacitance - lumped.transducer**2 / lumped.stiffness
    return (
        ComparisonRow(
            "sum of v_i, by (5.11)", "V", None, sum(breakaways_as_printed(elements)),
            sum(elements.breakaways), "(5.11) is one index off: f_i = k_i x_(i+1)",
        ),
        ComparisonRow("charge at 100 V, lumped", "uC", None, q, q_new, "corrected: T refitted"),
        ComparisonRow("V_h at 100 V, lumped", "V", None, v, v_new, ""),
        ComparisonRow(
            "V_h that gives the printed top", "V", None,
            HIGH - lumped.volts_per_metre * named(MEASURED_LOOP, "top"), None,
            "with table 6.1; table 6.4 gives the line above",
        ),
        ComparisonRow(
            "capacitance of the lumped model", "uF", named(TABLE_6_1, "C"), None, clamped,
            "the data sheet's is free; clamped is C - T^2/k",
        ),
    )  # fmt: skip


def _operators() -> tuple[ComparisonRow, ...]:
    alj = stand_in()
    last = alj.count * float(alj.sigma)
    slope = float(alj.as_prandtl_ishlinskii().slope_full)
    field = ang_recovered_scaled().play.thresholds[-1] / FIELD_SCALE
    n_inverse = len(ang_inverse_scaled().play.weights)
    _, memory = alj.run(sine())
    _, memory = alj.run(printed_demagnetisation().volt, memory)
    remanent = float(alj.run([0.0], memory)[0][0])
    return (
        ComparisonRow(
            "T as k times the end slope of (6.2)", "N/V", named(TABLE_6_1, "T"),
            named(TABLE_6_1, "k") * slope, None, "agrees; the slope itself is m/V",
        ),
        ComparisonRow(
            "last threshold of (6.2)", "V", None, last, last / float(alj.c),
            "sigma_r is in units of eta; divided by c it is in volts",
        ),
        ComparisonRow(
            "half range behind sec 6.5", "V", 0.5 * HIGH, field * named(TABLE_6_2, "l"), None,
            "r_12 of the recovered forward operator, times l",
        ),
        ComparisonRow(
            "number of weights of (6.3)", "", float(N_PRINTED_WEIGHTS), None, float(n_inverse),
            "the inverse of sec 6.5 has them all",
        ),
        ComparisonRow(
            "remanence after the signal (6.1)", "nm", None, remanent, None,
            "said to be cleared; plays of (6.2) wider than the first peak keep their state",
        ),
    )  # fmt: skip


def _bond_graph() -> tuple[ComparisonRow, ...]:
    k, m, r = (named(TABLE_6_2, s) for s in ("k", "m", "R_e"))
    top = named(MEASURED_LOOP, "top")

    def electrical(t: float) -> tuple[float, ...]:
        charge = top / t
        capacitance = charge / HIGH
        soft = k / (1.0 + k * t**2 * capacitance)
        return charge, capacitance, r * capacitance, soft, _resonance(soft, m)

    names = (
        ("charge at 100 V, bond graph", "uC"),
        ("secant capacitance", "nF"),
        ("time constant R_e C", "us"),
        ("short-circuit stiffness", "N/um"),
        ("resonance driven by voltage, 16 g", "kHz"),
    )
    given = electrical(named(TABLE_6_2, "T"))
    right = electrical(Polarised().transducer)
    remark = f"3.52 is used as m/C; x/q asks for {Polarised().transducer} m/C"
    return tuple(
        ComparisonRow(name, unit, None, a, b, "" if i else remark)
        for i, ((name, unit), a, b) in enumerate(zip(names, given, right, strict=True))
    )


def _mechanical() -> tuple[ComparisonRow, ...]:
    k, m = named(TABLE_6_1, "k"), named(TABLE_6_1, "m")
    docc = named(TABLE_3_1, "C") * named(TABLE_3_1, "V_max") / named(TABLE_3_1, "x_max")
    return (
        ComparisonRow(
            "resonance", "kHz", named(TABLE_3_1, "f_0"), _resonance(k, m), _resonance(k, m / 3.0),
            "a third of the mass moves",
        ),
        ComparisonRow(
            "current per frequency and stroke", "uA/(Hz um)", named(TABLE_3_1, "DOCC"), docc, None,
            "C V_max / x_max of table 3.1",
        ),
    )  # fmt: skip


def slip_points() -> tuple[float, ...]:
    """Return the slip points ``q_i = C_i v_i`` of table 6.4, C."""
    return tuple(float(q) for q in MaxwellResistiveCapacitor.stack_2hz().thresholds)


def threshold_gaps() -> tuple[float, ...]:
    """Return ``(r'_i - r'_(i-1)) S'_(i-1)`` of the printed inverse of sec 6.5.

    For an inverse of equidistant plays they are all equal, to the digits that are printed.
    """
    play = ang_inverse_scaled().play
    sums = accumulate(float(w) for w in play.weights)
    r = [float(v) for v in play.thresholds]
    return tuple((b - a) * s for a, b, s in zip(r, r[1:], sums, strict=False))
