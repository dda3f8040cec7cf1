"""What a reader who reproduces the stack actuator thesis has to know: place, print, finding.

The numbers of models and operators are computed elsewhere (`comparison`, `constants`); the texts
repeat them and the tests hold the two together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final


@final
@dataclass(frozen=True, slots=True)
class ThesisFinding:
    """One inconsistency.

    Parameters
    ----------
    where : str
        Table, equation or section.
    printed : str
        What stands there, in short.
    finding : str
        What is the matter and what to use instead.
    """

    where: str
    printed: str
    finding: str


_MODELS = (
    ThesisFinding(
        "eq (5.3)", "E_2 = +F T/l, F = k (x - x_1)",
        "This sign makes power out of nothing. With E_2 = -F T/l the balance closes; the flow "
        "x_1' = T i of the second transducer is missing as well.",
    ),
    ThesisFinding(
        "eq (5.4)", "m v' = -k x_1 - R_nl v",
        "F_e is left out, and x_1 means the stretch of the spring here but the transducer's "
        "displacement in (5.3).",
    ),
    ThesisFinding(
        "eq (5.2), (6.4)", "C_nl = p/E, then E_C = C_nl(p)",
        "The function in use is the inverse of the compliance that was defined.",
    ),
    ThesisFinding(
        "tables 6.1, 6.2", "T = 3.52 N/V in both",
        "Right for the lumped model. The bond graph needs V/N = m/C; the scale of the printed "
        "inverse shows that the number 3.52 was used as m/C.",
    ),
    ThesisFinding(
        "table 6.2", "follows from T = 3.52 m/C",
        "Charge 1.4 uC at 100 V, secant capacitance 13.9 nF, R_e C = 70 ns and 5.3 N/um at short "
        "circuit. With T = 0.0327 m/C: 150 uC, 1.5 uF, 7.5 us, 58.9 N/um.",
    ),
    ThesisFinding(
        "sec 6.2", "T from the loading slope, k in common",
        "A free slow stroke does not identify T of the bond graph: T only rescales dipole and "
        "C_nl. It takes a charge or a load. k is at short circuit in one model, at open in the "
        "other.",
    ),
    ThesisFinding(
        "sec 6.2", "the slope equals the electro-mechanical constant",
        "The slope is in m/V; T = k times the slope.",
    ),
    ThesisFinding(
        "table 6.1", "C = 1.5 uC/V",
        "That is the free capacitance; the model means the clamped one, C - T^2/k = 1.309 uF.",
    ),
    ThesisFinding(
        "tables 6.1, 6.2", "m = 16 g, A = 1.13 cm2",
        "A is the circle of a 12 mm casing, and the mass follows from it. A rod fixed at one end "
        "moves a third of its mass: 10.1 kHz becomes 17.6 kHz, the data sheet says 18.",
    ),
    ThesisFinding("table 6.1", "b = 80 N s/m", "Only an order of magnitude; its author says so."),
    ThesisFinding(
        "eq (6.5)", "p and E_C from measured x",
        "Right without damping and load, but it takes the third derivative of a measurement: fit "
        "forward instead.",
    ),
    ThesisFinding(
        "sec 6.6", "an algebraic loop",
        "q = (I + C H)^-1 [C V_in + T x] is explicit: plays have a closed inverse.",
    ),
)  # fmt: skip

_OPERATORS = (
    ThesisFinding(
        "eq (6.3)", "12 plays besides width 0, 11 weights",
        "13 weights are needed. The loop fits with the last two 0; the inverse of sec 6.5 has all "
        "13.",
    ),
    ThesisFinding(
        "sec 5.2.3", "0 = d_0 < r_J < d_1 < ...",
        "r is in volts and d in output units of the plays: there is no order between them.",
    ),
    ThesisFinding(
        "eq (5.6), (6.2)", "q, c, sigma_r, alpha, beta",
        "Four of the five count: q/L, c L, sigma_r L, alpha/L, beta/L gives the same output. Hold "
        "c = 1. The last threshold 52.8 is in units of the envelope, in volts 43.6.",
    ),
    ThesisFinding(
        "tables 6.1, 6.4, 6.5", "one model",
        "Together they give a top of 4512 nm and 531 nm of thickness, not 4900 and 770. T must be "
        "refitted (about 3.82 N/V); the loop stays too thin, only other elements mend that.",
    ),
    ThesisFinding(
        "eq (5.11)", "f_i = k_i x_i",
        "Off by one: element i slips at the end of its segment, f_i = k_i x_(i+1). As printed the "
        "sum is 11.8 V instead of 16.7 V. Nor is f_i the rise of the curve over its segment, as "
        "is said below it. Table 6.4 was made with the right form.",
    ),
    ThesisFinding(
        "sec 5.2.4", "F with sgn of the velocity",
        "A held sample of a slipping element would drop to zero force; clip the stretch instead.",
    ),
    ThesisFinding("table 6.4", "equal segments", "Only roughly: 1.9, 3.9, 8.4 ... 13.4 uC."),
    ThesisFinding(
        "eq (7.1)", "inverse of Al Janaideh's operator",
        "q' = 1/q and the inverse envelope are missing; without q' the error is larger than the "
        "stroke.",
    ),
    ThesisFinding(
        "eq (7.2)", "inverse of Ang's operator",
        "The initial states are missing: on an actuator with a past the voltage is off by volts "
        "until large swings have wiped it out.",
    ),
)  # fmt: skip

_MEASUREMENT = (
    ThesisFinding(
        "eq (6.1)", "a decaying 20 V sine clears the past",
        "Plays wider than its first peak keep their state: the remanence of (6.2) falls from "
        "507 nm to 132 nm only. The amplitude has to begin above the widest play.",
    ),
    ThesisFinding(
        "sec 6.3, 6.6", "the loop is twice as wide at 100 Hz",
        "Not shown by these data: two clocks 100 ppm apart add about 58 nm of thickness at 2 Hz "
        "over the 10.5 s record, and 2.9 um at 100 Hz.",
    ),
    ThesisFinding(
        "sec 4.2.2, 6.6", "no trigger for each value in superfast mode",
        "True of that device, so the wave and the length had two clocks. Its fast mode takes a "
        'value at every edge: clocked = "fast" in a station file, up to the rate of that mode; '
        '"block" is for a device whose blocks obey the edges too.',
    ),
    ThesisFinding(
        "eq (7.3)", "reference of the compensation",
        "Smooth to the first derivative only; the acceleration jumps at 0 s and at 0.5 s, and an "
        "inverse that needs it answers with steps.",
    ),
    ThesisFinding(
        "sec 4.3", "8 bit, 1 nm, 800 mm/s",
        "Half a wavelength over 256 is 1.24 nm, over 512 0.62 nm. At 1 MS/s a rule of half a "
        "fringe allows 158 mm/s, so fringes are counted faster than samples are stored.",
    ),
    ThesisFinding(
        "table 3.1", "12.5 uA/(Hz um)", "C V_max / x_max of the same table is 10 uA/(Hz um)."
    ),
    ThesisFinding(
        "table 2.1", "constants of three ceramics",
        "k_33 and k_31 of PIC255 are exchanged, g_33 of PIC140 does not follow from d_33, and the "
        "frequency constants of APC855 are permuted.",
    ),
    ThesisFinding(
        "sec 5", "E = V / l",
        "With l the length of the stack this is 5.6 kV/m at 100 V; in a layer it is about 2 MV/m. "
        "Lumped dipole and field are a choice of gauge, not values of the material.",
    ),
    ThesisFinding(
        "fig 5.5 and others", "12 sin(2 pi), T, q, k",
        "t is missing, and T, q and k each stand for two things.",
    ),
)  # fmt: skip

FINDINGS = (*_MODELS, *_OPERATORS, *_MEASUREMENT)
"""In the order models, operators, measurement."""

NOT_REPRODUCIBLE = (
    "What cannot be reproduced, and why. The measured samples are not public: the columns of "
    "tables 6.3 and 6.5 are errors against them, so only their size can be compared, with set "
    "(6.2) in place of the samples, and (6.2) itself cannot be judged that way. Tables 6.1, 6.4 "
    "and 6.5 belong to no single set of constants: with the printed T the top is 8 % too low, "
    "and with T refitted the errors are like those of table 6.5 but the loop is still a quarter "
    "too thin. The last two weights of (6.3) are not printed; 0 is an assumption that a steady "
    "loop to 100 V hardly tests. The inverse of sec 6.5 is printed with two digits and its dead "
    "zone begins where the loop ends; the digits leave more than the 3 % that the top is off. T "
    "of the bond graph does not show in a free stroke, so its printed value cannot be tested at "
    "all. Damping, mass and R_e do not show at 2 Hz. Loops at 10 and 100 Hz are out of reach: the "
    "models of the text are rate independent, numbers for a rate-dependent operator (there are "
    "some here) are not printed, and the two clocks of that measurement were not the same."
)
"""Closing paragraph of the comparison."""
