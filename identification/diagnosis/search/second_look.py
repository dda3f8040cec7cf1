"""A fit that ended far above the noise, looked at as a diagnosis begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bondgraph.support.errors import BondsightError
from identification.diagnosis.screening.mixups import mixups
from identification.diagnosis.screening.undoing import Mixup
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.material import material_of
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.threads import calm
from identification.study.study import Study


@dataclass(frozen=True)
class SecondLook:
    """What a second look at a fit has found.

    Attributes
    ----------
    mistakes : tuple of Mixup
        What looks wrong with the recording itself, the likeliest first.
    values : mapping of str to float, SI
        Start values from another way down; none beside a mistake, or where there is no other way.
    """

    mistakes: tuple[Mixup, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)


def second_look(study: Study, jobs: int = 1) -> SecondLook:
    """Fit the model once more through short windows and other starts, and look for mix-ups.

    Parameters
    ----------
    study : Study
        One that `diagnose` takes; of others nothing is said.
    jobs : int
        Processes.
    """
    try:
        asked = asked_of(study, None, None, None, {})
        material = material_of(asked)
        if material.reason:
            return SecondLook()
        problem = asked.problem(material.data)
        with calm():
            nominal = nominal_fit(asked.graph, material.data, asked.hold, problem)[1]
            mistakes = mixups(asked.graph, nominal, jobs)
    except (BondsightError, np.linalg.LinAlgError):
        return SecondLook()
    if any(m.kind != "dead" for m in mistakes):
        return SecondLook(mistakes)
    own = {n: v for n, v in nominal.values.items() if n in study.free_names and np.isfinite(v)}
    return SecondLook(values=own)
