"""What is judged: readings beside simulations, floors, inputs and the fitted numbers, as arrays.

The judgement knows no model and no solver. Whatever makes a fit hands over this material; see
`identification.validation.source` for the fits of this project.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.estimation.estimates import Estimate
from identification.statistics.autoregression import innovations
from identification.uncertainty.tied import Tied

FREE_RUN = "free run: one initial state for the record, then the inputs alone"


@dataclass(frozen=True, eq=False)
class ValidationRecord:
    """One recording beside its simulation.

    Attributes
    ----------
    name : str
    time : ndarray, shape (N,), s
    names, units : tuple of str
        Of the readings.
    measured, simulated : ndarray, shape (N, n_y), SI
        `simulated` may hold NaN where nothing was simulated.
    floor : ndarray, shape (n_y,), SI
        Standard deviation of the noise of each reading.
    train, test : ndarray of bool, shape (N,)
        Samples that were fitted, samples that were held out.
    inputs : mapping of str to ndarray, shape (N,), SI
    sha256 : str
        Of the file it came from; empty if there is none.
    whitening : tuple of ndarray
        Autoregressive polynomial of the noise of each reading, 1 first; empty for white noise.
    """

    name: str
    time: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    measured: Array
    simulated: Array
    floor: Array
    train: Array
    test: Array
    inputs: Mapping[str, Array] = field(default_factory=dict)
    sha256: str = ""
    whitening: tuple[Array, ...] = ()

    def __post_init__(self) -> None:
        """Check the shapes."""
        n, y = self.time.size, len(self.names)
        wanted = {"measured": (n, y), "simulated": (n, y), "floor": (y,), "train": (n,)}
        wanted |= {"test": (n,)}
        for what, shape in wanted.items():
            found = np.shape(getattr(self, what))
            if found != shape:
                raise UnusableInput(
                    f"{self.name}: {what} has shape {found}; give {shape} for {n} samples of "
                    f"{y} readings"
                )
        for what, values in self.inputs.items():
            if np.shape(values) != (n,):
                raise UnusableInput(
                    f"{self.name}: input {what} has shape {np.shape(values)}; give ({n},)"
                )
        if n < 2 or len(self.units) != y:
            raise UnusableInput(f"{self.name}: give two samples or more, and a unit a reading")
        if not (np.isfinite(self.floor).all() and (self.floor > 0).all()):
            raise UnusableInput(
                f"{self.name}: the noise floor {self.floor} must be positive; state it per reading"
            )

    @property
    def dt(self) -> float:
        """Time between samples, s."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    @property
    def residual(self) -> Array:
        """Measured less simulated, shape (N, n_y), SI."""
        return np.asarray(self.measured - self.simulated)

    def innovations(self, column: int) -> Array:
        """Residual of one reading through the filter that whitens its noise, shape (N,), SI.

        The residual itself where the noise is white; NaN at the run-in of the filter.
        """
        r = self.residual[:, column]
        if not self.order(column):
            return np.asarray(r)
        heard = innovations(r, self.whitening[column])
        return np.concatenate([np.full(self.order(column), np.nan), heard])

    def order(self, column: int) -> int:
        """Order of the noise model of one reading; 0 for white noise."""
        return int(self.whitening[column].size - 1) if self.whitening else 0

    def part(self, name: str) -> Array:
        """Mask of ``train`` or ``test``."""
        return np.asarray(self.train if name == "train" else self.test, bool)


@dataclass(frozen=True)
class Number(Estimate):
    """A fitted number beside what was declared, and what is said of it.

    Attributes
    ----------
    nominal : float
        What was declared before the fit; NaN if nothing.
    kind : str
        What the data say about it, in a word; empty if nobody asked.
    only : str
        Stands instead of an interval where it is told only together with others.
    """

    nominal: float = float("nan")
    kind: str = ""
    only: str = ""


@dataclass(frozen=True, eq=False)
class ValidationData:
    """Everything a judgement looks at.

    Attributes
    ----------
    model : str
        Name of the model.
    records : tuple of ValidationRecord
    numbers : tuple of Number
        Fitted parameters; nuisances apart.
    n_free : int
        Numbers fitted in all, nuisances and initial states included.
    status : str
        How the fit ended, in words.
    run : str
        What the simulation was given, in words.
    starts : tuple of float
        Final costs of many starts, for the waterfall; empty if there was one.
    correlation : ndarray, shape (n, n)
        Of `numbers`; empty if unknown.
    notes : tuple of str
        What the fit itself wants known.
    tied : tuple of Tied
        Parameters that the recordings tell only together.
    states : int
        Initial states among the numbers fitted.
    """

    model: str
    records: tuple[ValidationRecord, ...]
    numbers: tuple[Number, ...] = ()
    n_free: int = 0
    status: str = ""
    run: str = FREE_RUN
    starts: tuple[float, ...] = ()
    nuisances: tuple[Number, ...] = ()
    correlation: Array = field(default_factory=lambda: np.zeros((0, 0)))
    notes: tuple[str, ...] = ()
    tied: tuple[Tied, ...] = ()
    states: int = 0

    def label(self, channel: str, record: str) -> str:
        """Return the name of a reading, with its record where there are several."""
        return f"{channel} of {record}" if len(self.records) > 1 else channel

    def __post_init__(self) -> None:
        """Refuse an empty judgement."""
        if not self.records:
            raise UnusableInput(f"{self.model}: there is no record to judge the fit on")
        names = [r.name for r in self.records]
        if len(set(names)) != len(names):
            raise UnusableInput(
                f"{self.model}: two records are called {max(names, key=names.count)!r}; "
                "rename one, or the tables cannot tell them apart"
            )
