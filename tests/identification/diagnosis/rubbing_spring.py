"""A spring whose damper rubs, diagnosed once for all tests that look at a part of the answer."""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd

from bondgraph.laws import Coulomb
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate
from tests.spring import spring

T = np.asarray(0.01 * np.arange(1200), np.float64)
U = 4 * np.sin(2 * np.pi * 0.7 * T) + 3 * np.sin(2 * np.pi * 2.3 * T)
FORCE = 0.3


@cache
def frame() -> pd.DataFrame:
    """Return what was recorded; the force is told by its unit only."""
    x = simulate(spring().with_element("d", law=Coulomb(FORCE)), T, {"F": U})["x"]
    x = x + 1e-5 * np.random.default_rng(1).standard_normal(T.size)
    return pd.DataFrame({"t[s]": T, "push[N]": U, "x[m]": x})


@cache
def diagnosed() -> Diagnosis:
    """Return the diagnosis with the whole catalogue; it is only read."""
    return diagnose(spring(), frame(), options=DiagnosisOptions(jobs=1, effects=1, keep=4, more=2))
