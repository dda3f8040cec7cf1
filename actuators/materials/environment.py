"""Temperature and age: how they change the constants of a ceramic, and so a model's parameters.

Every law gives a factor, 1 at its reference, for a constant such as d33 or eps33 (stack actuator
thesis, sec. 2.4; manufacturers state ageing in per cent per decade). The laws of temperature are
in `actuators.materials.temperature`, creep in `actuators.stack.creep`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike

from actuators.materials.poled_ceramic import StackConstants
from actuators.materials.temperature import TemperatureLaw
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.ops import FloatArray

CONSTANTS = ("d33", "eps33", "s33")
"""The constants of a slender stack: charge, permittivity at constant stress, compliance."""


@final
@dataclass(frozen=True, slots=True)
class CeramicAgeing:
    """``1 - a log10(t/t_0)``: a constant loses the part a in every decade of time since poling.

    Parameters
    ----------
    rate : float
        a per decade, such as 0.02 for 2 %; negative if the constant grows.
    reference : float
        ``t_0``, the age at which the factor is 1, s; default one day.

    Examples
    --------
    >>> float(CeramicAgeing(0.02).factor(100 * 86400.0))
    0.96
    """

    rate: float
    reference: float = 86400.0

    def __post_init__(self) -> None:
        """Refuse values out of their domain."""
        if not isfinite(self.rate) or not 0 < self.reference < inf:
            raise UnusableInput(
                f"ageing: rate = {self.rate:g} must be finite and reference = "
                f"{self.reference:g} s positive"
            )

    def factor(self, age: ArrayLike) -> FloatArray:
        """Return the factor at `age` (s since poling, any shape), same shape.

        Raises
        ------
        UnusableInput
            Younger than the reference, or so old that nothing would be left.
        """
        t = np.asarray(age, dtype=np.float64)
        if not ((t >= self.reference) & (t < inf)).all():
            raise UnusableInput(
                f"ageing: age {t.min():g} s is below the reference {self.reference:g} s, where "
                "the logarithm has no meaning; give the time since poling in s"
            )
        found = 1 - self.rate * np.log10(t / self.reference)
        if not (found > 0).all():
            raise UnusableInput(
                f"ageing: after {t.max():g} s the factor would be {found.min():g}; "
                f"the rate {self.rate:g} is a part of 1 per decade, not per cent"
            )
        return np.asarray(found)


@final
@dataclass(frozen=True)
class Environment:
    """How the constants of a ceramic depend on temperature and age; what is left out stays.

    Parameters
    ----------
    temperature : dict of str to TemperatureLaw
    ageing : dict of str to CeramicAgeing
        Keys from `CONSTANTS`.
    """

    temperature: Mapping[str, TemperatureLaw] = field(default_factory=dict)
    ageing: Mapping[str, CeramicAgeing] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse constants that a slender stack does not have."""
        require_known("constant", "the environment", CONSTANTS, *self.temperature, *self.ageing)

    def factors(
        self, temperature: float | None = None, age: float | None = None
    ) -> dict[str, float]:
        """Return the factor of every constant at a temperature (K) and an age (s).

        None leaves the constants at their reference.
        """
        found = dict.fromkeys(CONSTANTS, 1.0)
        for name in CONSTANTS:
            if temperature is not None and name in self.temperature:
                found[name] *= float(self.temperature[name].factor(temperature))
            if age is not None and name in self.ageing:
                found[name] *= float(self.ageing[name].factor(age))
        return found

    def stack(
        self, constants: StackConstants, temperature: float | None = None, age: float | None = None
    ) -> StackConstants:
        """Return the constants of a stack at a temperature (K) and an age (s)."""
        by = self.factors(temperature, age)
        k = constants.stiffness / by["s33"]
        transducer = k * constants.displacement_per_volt * by["d33"]
        return StackConstants.from_free(k, constants.free_capacitance * by["eps33"], transducer)


def parameters_at(
    constants: StackConstants,
    environment: Environment,
    *,
    temperature: float | None = None,
    age: float | None = None,
    model: Literal["stack_lumped", "stack_bond_graph"] = "stack_lumped",
) -> dict[str, Any]:
    """Return the parameters of a stack model, to be given to `simulate` as ``parameters=``.

    Parameters
    ----------
    constants : StackConstants
        At the references of the laws.
    environment : Environment
    temperature : float, optional
        K.
    age : float, optional
        Since poling, s.
    model : {"stack_lumped", "stack_bond_graph"}

    Raises
    ------
    UnusableInput
        Temperature or age is outside a law, or the constants would couple more than fully.
    """
    there = environment.stack(constants, temperature, age)
    makers = {"stack_lumped": there.as_lumped, "stack_bond_graph": there.as_bond_graph}
    require_known("model", "parameters_at", makers, model)
    return makers[model]()
