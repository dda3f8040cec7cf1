"""Which equation is deficient: the one whose rate needs a random part.

A diffusion that is significantly different from zero says that the rate of its state moves in a
way the model does not know (Kristensen, Madsen and Jorgensen, Automatica 40 (2004) 225). Each
state's diffusion is fitted in turn against none. Zero is the edge of what a diffusion may be, so
twice the gained log-likelihood is chi-squared with one degree of freedom in half of all cases and
zero in the other half (Self and Liang, JASA 82 (1987) 605).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identification.estimation.prediction.fit import fit_filter
from identification.estimation.prediction.kalman import kalman_filter
from identification.estimation.result import Estimation
from identification.study.study import Study


@dataclass(frozen=True, eq=False, slots=True)
class Deficiency:
    """One place with its own process noise against none.

    Attributes
    ----------
    ratio : float
        Twice the gain of the log-likelihood.
    p_value : float
        Probability of such a gain if there were no process noise.
    """

    place: str
    sigma: float
    unit: str
    ratio: float
    p_value: float


@dataclass(frozen=True, eq=False, slots=True)
class DeficiencyReport:
    """All places, the most telling first.

    Attributes
    ----------
    count : int
        Readings that were scored.
    """

    count: int
    places: tuple[Deficiency, ...]

    @property
    def significant(self) -> tuple[Deficiency, ...]:
        """Places below 1 % after division by the number of places tried (Bonferroni)."""
        return tuple(d for d in self.places if d.p_value * len(self.places) < 0.01)

    def __str__(self) -> str:
        """Likelihood ratios and what they say."""
        lines = [f"process noise at one state at a time, against none ({self.count} readings)"]
        for d in self.places:
            lines.append(
                f"  {d.place}: sigma = {d.sigma:.4g} {d.unit}, likelihood ratio {d.ratio:.4g}, "
                f"p {'= ' + format(d.p_value, '.2g') if d.p_value > 0 else '< 1e-300'}"
            )
        return "\n".join([*lines, self._verdict()])

    def _verdict(self) -> str:
        telling = self.significant
        if not telling:
            return "no rate needs a random part: the equations suffice for these data"
        best = telling[0]
        said = (
            f"the equation of {best.place} is deficient: its rate moves by "
            f"{best.sigma:.4g} {best.unit} in a way the model does not know"
        )
        rivals = [d.place for d in telling[1:] if best.ratio - d.ratio < 10.0]
        if rivals:
            return f"{said}; {', '.join(rivals)} would explain the data nearly as well"
        if len(telling) > 1:
            return f"{said}; noise elsewhere helps too, but less: look here first"
        return said


def boundary_p_value(ratio: float) -> float:
    """p-value of a likelihood ratio for a variance that may not be negative.

    Examples
    --------
    >>> round(boundary_p_value(2.7055), 3), boundary_p_value(0.0)
    (0.05, 1.0)
    """
    from scipy.stats import chi2

    return 1.0 if ratio <= 0.0 else 0.5 * float(chi2.sf(ratio, 1))


def deficient_equations(
    study: Study | Estimation, places: Sequence[str] | None = None
) -> DeficiencyReport:
    """Fit each place's diffusion in turn and compare with no process noise.

    Parameters
    ----------
    study : Study or Estimation
        A fit: from where it ended.
    places : sequence of str, optional
        States, elements or sources; all states when not given.
    """
    if isinstance(study, Estimation):
        whole, point = kalman_filter(study.study, study.setting), study.point
    else:
        whole, point = kalman_filter(study), None
    plain = replace(whole, sigma={})
    without = fit_filter(plain, start=plain.start(point))
    found = []
    for place in whole.first.engine.state_names if places is None else places:
        one = replace(whole, sigma={place: None})
        (d,) = one.diffusions()
        assert d is not None
        usual, old = one.start(point), plain.slots
        begin = usual.copy()
        begin[one.slots.joint] = without.theta[old.joint]
        begin[one.slots.noise.stop :] = without.theta[old.noise.stop :]
        tried = [fit_filter(one, start=t) for t in (begin, usual)]
        fit = max(tried, key=lambda f: f.at.log_likelihood)
        ratio = max(0.0, 2.0 * (fit.at.log_likelihood - without.at.log_likelihood))
        found.append(Deficiency(place, fit.sigma[place], d.unit, ratio, boundary_p_value(ratio)))
    found.sort(key=lambda d: -d.ratio)
    return DeficiencyReport(without.at.count, tuple(found))
