"""What a user says about a fit: which numbers vary, what is known of them, which nuisances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from bondgraph.support.errors import UnusableInput, real_number
from bondgraph.support.spelled import spelled
from identification.study.calibration import Known
from identification.study.priors import Prior


@spelled
@dataclass(frozen=True)
class Vary:
    """A free parameter.

    Parameters
    ----------
    name : str
        Name in the model.
    start, lower, upper : float, optional
        SI; the declared value and bounds where not given.
    prior : Normal or LogNormal, optional
        Without one a weak prior (a factor 20, or ten scales) only keeps what the data do not
        determine in place.
    scale : float, optional
        Typical size of a parameter that may be zero or negative.
    own : bool
        A value in every recording instead of a common one.

    Examples
    --------
    >>> Vary("k", lower=1e3, upper=4e3)
    Vary(name='k', start=None, lower=1000.0, upper=4000.0, prior=None, scale=None, own=False)
    """

    name: str
    start: float | None = None
    lower: float | None = None
    upper: float | None = None
    prior: Prior | None = None
    scale: float | None = None
    own: bool = False

    def __post_init__(self) -> None:
        """Refuse bounds that exclude each other or the start."""
        for what in ("start", "scale"):
            if (given := getattr(self, what)) is not None:
                real_number(f"{what} of {self.name}", given)
        if self.scale is not None and not self.scale > 0:
            raise UnusableInput(
                f"{self.name}: scale {self.scale:g}; give its typical size, above 0"
            )
        low = -math.inf if self.lower is None else self.lower
        high = math.inf if self.upper is None else self.upper
        if not low < high:
            raise UnusableInput(
                f"{self.name}: lower bound {low:g} is not below the upper bound {high:g}"
            )
        if self.start is not None and not low <= self.start <= high:
            raise UnusableInput(
                f"{self.name}: start {self.start:g} lies outside of its bounds {low:g} to {high:g}"
            )


@spelled
@dataclass(frozen=True)
class Nuisances:
    """What the measuring chain may add; fitted beside the parameters and never a finding.

    Parameters
    ----------
    offsets : bool
        A constant added to each sensor, one a recording.
    lags : bool
        A delay of each sensor of up to a quarter of a sample.
    commands : bool
        A constant added to each moving command, one a recording.
    clock : float
        Largest error of the sensors' clocks against the drive's, as a fraction (2e-4 is 200 ppm);
        0: the clocks are one.
    gains : mapping of str to Known
        Calibration of sensors and commands, by channel: the factor by which what is recorded is too
        large (a command: by which it acts too strongly), fitted within its bounds, one for all
        recordings. A factor that ends at a bound is said: it belongs into the model, or the
        calibration is wrong.

    Examples
    --------
    >>> from bondsight import Known
    >>> chain = Nuisances(lags=False, gains={"x": Known(1.0, 0.02)})
    >>> fitted = estimate(study.changed(nuisances=chain))
    >>> [e.name for e in fitted.nuisances]
    ['gain_x', 'offset x']
    """

    offsets: bool = True
    lags: bool = True
    commands: bool = False
    clock: float = 0.0
    gains: Mapping[str, Known] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        """Refuse clocks that are no clocks, gains that are none, and numbers for yes and no."""
        for what in ("offsets", "lags", "commands"):
            if type(given := getattr(self, what)).__name__ not in ("bool", "bool_"):
                raise UnusableInput(
                    f"{what} = {given!r}: say True or False; what is known of one sensor stands at "
                    "it in the graph, such as Dq(..., offset=...)"
                )
        if not isinstance(self.gains, Mapping):
            raise UnusableInput(
                f"gains = {self.gains!r}: give them by channel, such as {{'x': Known(1.0, 0.02)}}"
            )
        object.__setattr__(self, "gains", dict(self.gains))
        if not 0.0 <= self.clock < 0.1:
            raise UnusableInput(
                f"clock = {self.clock}: give the largest ratio error as a fraction, such as 2e-4"
            )


NO_NUISANCES = Nuisances(offsets=False, lags=False)
"""Readings are taken as they are."""
