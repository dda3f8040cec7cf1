"""The inner loops of the stack models from what is measured: eq. (6.5) and (6.6) of the thesis.

Voltage and displacement of a free stack that moves slowly give charge and hysteresis voltage of the
lumped model, dipole and field of the general bond graph. The terms in x', x'' and x''' are left
out: they would be derivatives of noise, and below a hundredth of the resonance they are smaller
than a ten-thousandth of k x.
"""

from __future__ import annotations

from dataclasses import dataclass

from actuators.stack.conversions import Lumped, Polarised, pure_from_lumped
from bondgraph.hysteresis import BadInput, MaxwellResistiveCapacitor, NotInvertible
from bondgraph.hysteresis.fitting import fit_loading_curve, fit_maxwell, loading_samples
from bondgraph.hysteresis.fitting.held_out import WORTHWHILE
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.laws import Hysteretic
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

AVERAGED = 800
"""Samples that a record is averaged to, as noise of x goes into charge and voltage."""
ADVICE = "T = k dx/dV of the same record fits them together"
SEGMENTS = 15
"""Of the loading curve in table 6.4."""


def charge_curve(
    volt: FloatArray, x: FloatArray, constants: Lumped
) -> tuple[FloatArray, FloatArray]:
    """Return q (C) and V_h (V): ``V_t = k x / T``, ``q = T x + C V_t``, ``V_h = V_in - V_t``.

    Eq. (6.6) without inertia and damping.
    """
    transduced = constants.volts_per_metre * x
    return constants.charge_per_metre * x, volt - transduced


def dipole_curve(
    volt: FloatArray, x: FloatArray, constants: Polarised
) -> tuple[FloatArray, FloatArray]:
    """Return p (C m) and E_C (V/m): ``p = l x / T``, ``E_C = V_in / l``.

    Eq. (6.5) without inertia, damping and the current in R_e.
    """
    return x * constants.length / constants.transducer, volt / constants.length


@dataclass(frozen=True, slots=True)
class CapacitorFit:
    """Maxwell elements by one way of fitting, and the rms of the displacement they give (m)."""

    way: str
    capacitor: MaxwellResistiveCapacitor
    rms: float
    held_out: float


def fit_capacitor(records: LoopRecords, constants: Lumped) -> tuple[CapacitorFit, ...]:
    """Fit the Maxwell capacitor to V and x of the first record, by its rise and by all of it.

    The first way is the thesis': a polygon through the first rise from rest, eq. (5.11) and (5.12).
    The second takes every sample of the first record that is not held out, at the same slip
    points. Later records only tell the errors.

    Parameters
    ----------
    records : LoopRecords
        V to m; the first one virgin, the last one (or the last third) held out.
    constants : Lumped
        C, T, k.

    Raises
    ------
    UnusableInput
        If neither way gives elements that, with these constants, make an operator.
    """
    train, test = records.split()
    rows = train.scored[0]
    u, x = _averaged(train.inputs[0][rows], train.outputs[0][rows], AVERAGED)
    q, v = charge_curve(u, x, constants)
    rising = loading_samples(u)
    found = []
    try:
        polygon = fit_loading_curve(q[rising], v[rising], SEGMENTS)
        whole = fit_maxwell(q, v, tuple(float(e) for e in polygon.ends))
    except BadInput as error:
        raise UnusableInput(f"Maxwell elements: {error} ({ADVICE})") from error
    for way, capacitor in (("loading curve", polygon.operator), ("first record", whole.operator)):
        try:
            pure = pure_from_lumped(Hysteretic(capacitor), constants)
        except NotInvertible:
            continue
        found.append(CapacitorFit(way, capacitor, train.misfit(pure), test.misfit(pure)))
    if not found:
        raise UnusableInput(
            f"Maxwell elements: with these C, T and k none follow the record; {ADVICE}"
        )
    return tuple(found)


def _averaged(u: FloatArray, x: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return means of neighbours: noise moves charge and voltage against each other."""
    n = max(1, u.size // count)
    cut = u.size - u.size % n
    return u[:cut].reshape(-1, n).mean(axis=1), x[:cut].reshape(-1, n).mean(axis=1)


def best_capacitor(fits: tuple[CapacitorFit, ...]) -> CapacitorFit:
    """Return the fit with the least held-out error, the earlier one where nearly equal."""
    least = min(f.held_out for f in fits)
    return next(f for f in fits if f.held_out <= (1.0 + WORTHWHILE) * least)
