"""The gates of the sealed trial, those of its design: what is limited, what the count certifies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tests.proof.trial.rates import Rate

LEVEL = 0.05
"""Probability below which a gate is certified."""

ERRORS: Mapping[str, float] = {
    "false alarms, of the controls": 0.02,
    "misfit above 3 times the noise, of those called explained": 0.0,
    "called explained, of those where an effect shows": 0.0,
    "wrong names, of the names given": 0.02,
    "wrong places, of the places given": 0.03,
    "outside the catalogue named exactly": 0.05,
}
"""Rates that must stay below a limit for sure; where it is 0 none may be seen."""

SHARPNESS: Mapping[str, float] = {
    "sharp where an oracle separates names: right name and place": 0.80,
    "sharp where an oracle separates kinds: right place, and right name or kind": 0.95,
    "truth in the set of names, of those told": 0.97,
    "truth in the set of places, of those told": 0.97,
}
"""Rates that must reach a limit."""

MISNAMED = "another name than the true one, of the withheld laws"
WITHHELD: Mapping[str, float] = {MISNAMED: 0.05}
"""What is limited where the true law is not in the catalogue."""


@dataclass(frozen=True, slots=True)
class Gate:
    """One demand on the trial.

    Attributes
    ----------
    most : bool
        The rate must stay below the limit; otherwise it must reach it.
    """

    name: str
    counted: Rate
    limit: float
    most: bool = True

    @property
    def p(self) -> float:
        """Probability of a count as good as this if the true rate were the limit."""
        r = self.counted
        return r.p_at_most(self.limit) if self.most else r.p_at_least(self.limit)

    @property
    def bound(self) -> float:
        """One-sided 95 % bound: the upper one of an error, the lower one of what is wanted."""
        return self.counted.upper if self.most else self.counted.lower

    @property
    def state(self) -> str:
        """``empty``, ``certified``, ``none seen``, ``met, not certified`` or ``missed``.

        A count that keeps the limit too narrowly, or among too few, is met, not certified.
        """
        r = self.counted
        if not r.total:
            return "empty"
        if self.most and not self.limit:
            return "missed" if r.hits else "none seen"
        if self.p < LEVEL:
            return "certified"
        kept = r.value <= self.limit if self.most else r.value >= self.limit
        return "met, not certified" if kept else "missed"

    @property
    def passed(self) -> bool:
        """Whether the demand is met; a proof that counted nothing proves nothing."""
        return self.state not in ("empty", "missed")

    @property
    def certified(self) -> bool:
        """Whether it is met for sure, or none was seen where none may be."""
        return self.state in ("certified", "none seen")

    @property
    def words(self) -> str:
        """The demand, its count and its bound in one line."""
        side = "upper" if self.most else "lower"
        return (
            f"{self.state:18s} {self.name}: {self.counted}, {side} bound {100 * self.bound:.1f} %, "
            f"asked {self.asked}"
        )

    @property
    def asked(self) -> str:
        """The limit in words."""
        if self.most and not self.limit:
            return "none"
        return f"{'<=' if self.most else '>='} {100 * self.limit:g} %, p {self.p:.2g}"


def gates(rates: Mapping[str, Rate]) -> tuple[Gate, ...]:
    """Hold every rate that is limited against its limit."""
    return (
        *(Gate(name, rates[name], limit) for name, limit in ERRORS.items()),
        *(Gate(name, rates[name], limit, most=False) for name, limit in SHARPNESS.items()),
    )


def withheld_gates(rates: Mapping[str, Rate]) -> tuple[Gate, ...]:
    """Hold what was said without the true law against its limit."""
    return tuple(Gate(name, rates[name], limit) for name, limit in WITHHELD.items())
