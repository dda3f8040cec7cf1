"""A line of the comparison: printed, what the printed set gives, what a corrected one gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

SHOWN_IN: Mapping[str, float] = {
    "": 1.0,
    "%": 1e2,
    "nm": 1e9,
    "um": 1e6,
    "V": 1.0,
    "N/V": 1.0,
    "m/C": 1.0,
    "kHz": 1e-3,
    "uF": 1e6,
    "nF": 1e9,
    "uC": 1e6,
    "us": 1e6,
    "N/um": 1e-6,
    "uA/(Hz um)": 1.0,
}
"""Units of display and the factor from SI."""


@final
@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One quantity three times, SI; None where there is no such number.

    Parameters
    ----------
    quantity : str
        What it is, with the model.
    unit : str
        To show it in, a key of `SHOWN_IN`.
    printed : float or None
        As the thesis prints it.
    given : float or None
        Computed from the printed parameters.
    corrected : float or None
        Computed from the corrected or refitted set.
    remark : str
        What was corrected, or why nothing was.
    """

    quantity: str
    unit: str
    printed: float | None
    given: float | None
    corrected: float | None
    remark: str = ""

    def shown(self, value: float | None) -> str:
        """Return a value in the unit of display, ``-`` for None; five digits, four below 100.

        Examples
        --------
        >>> ComparisonRow("top", "nm", 4.9e-6, None, None).shown(4.9147e-6)
        '4914.7'
        """
        if value is None:
            return "-"
        number = value * SHOWN_IN[self.unit]
        return f"{number:.5g}" if abs(number) >= 100 else f"{number:.4g}"
