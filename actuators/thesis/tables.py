"""The tables of constants and of model errors of the stack actuator thesis, SI."""

from __future__ import annotations

from actuators.thesis.values import Printed

TABLE_3_1 = (
    Printed(
        "x_max", 15e-6, "m", "table 3.1", "the measured stack moved a third of it, 4.9 um (sec 6.6)"
    ),
    Printed("V_max", 100.0, "V", "table 3.1"),
    Printed("F_push", 1000.0, "N", "table 3.1"),
    Printed("F_pull", 50.0, "N", "table 3.1"),
    Printed("k", 57e6, "N/m", "table 3.1"),
    Printed("C", 1.5e-6, "F", "table 3.1", "measured free: the clamped one is C - T^2/k"),
    Printed("DOCC", 12.5, "A/(Hz*m)", "table 3.1", "C V_max / x_max of the same table is 10"),
    Printed("f_0", 18e3, "Hz", "table 3.1", "fixed at one end: a third of the mass moves"),
    Printed("L", 32e-3, "m", "table 3.1", "of the casing; the ceramics are 18 mm long"),
)
"""Data sheet of the P-840.1."""

_MASS = "the moved mass of a rod fixed at one end is a third of it"

TABLE_6_1 = (
    Printed("k", 65e6, "N/m", "table 6.1", "in this model the short-circuit stiffness"),
    Printed("m", 16e-3, "kg", "table 6.1", _MASS),
    Printed("b", 80.0, "N*s/m", "table 6.1", "called unreliable by its author"),
    Printed("C", 1.5e-6, "F", "table 6.1", "the free one; the model means the clamped C - T^2/k"),
    Printed("T", 3.52, "N/V", "table 6.1", "with table 6.4 the loop asks for about 3.82"),
)
"""Constants of the nonlinear lumped-parameter model."""

TABLE_6_2 = (
    Printed("k", 65e6, "N/m", "table 6.2", "in this model the open-circuit stiffness"),
    Printed("m", 16e-3, "kg", "table 6.2", _MASS),
    Printed("T", 3.52, "m/C", "table 6.2", "printed as N/V; E_2 = F T/l needs V/N = m/C"),
    Printed("l", 18e-3, "m", "table 6.2", "scales dipole and field only"),
    Printed("A", 1.13e-4, "m^2", "table 6.2", "a circle as wide as the casing; in no equation"),
    Printed("R_e", 5.0, "ohm", "table 6.2", "chosen at will"),
)
"""Constants of the general bond graph model."""

MEASURED_LOOP = (
    Printed("bottom", 500e-9, "m", "figure 6.3", "read from the figure"),
    Printed("top", 4.9e-6, "m", "sec 6.6"),
    Printed("thickness", 770e-9, "m", "sec 6.3", "about"),
    Printed("ratio", 0.16, "1", "sec 6.3", "nearly"),
)
"""The measured steady loop at 2 Hz, 0 to 100 V; its samples are not public."""


def _errors(where: str, model: str, numbers: tuple[float, ...]) -> tuple[Printed, ...]:
    names = ("max sine", "max triangle", "rms sine", "rms triangle")
    note = "against the measured samples, which are not public"
    return tuple(
        Printed(f"{model}: {name}", round(1e-9 * x, 14), "m", where, note)
        for name, x in zip(names, numbers, strict=True)
    )


ERRORS = (
    *_errors("table 6.3", "al_janaideh", (86.17, 76.79, 33.88, 39.21)),
    *_errors("table 6.3", "ang", (72.50, 86.92, 28.63, 34.05)),
    *_errors("table 6.5", "bond_graph", (95.51, 105.35, 29.59, 35.44)),
    *_errors("table 6.5", "lumped", (167.31, 163.3, 87.36, 83.69)),
)
"""Tables 6.3 and 6.5, symbols ``<model>: max|rms sine|triangle``."""
