"""Names that the models and scripts of this proof use; the only place that knows import paths.

Where a name moves or changes, write ``from its.new.place import NewName as OldName`` here.
"""

from __future__ import annotations

from bondgraph import TF, BondGraph, C, De, Df, Dq, I, One, R, Recording, Se, Sf, Zero, simulate
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Coulomb, Hysteretic
from identification import DiagnosisOptions as Options
from identification import (
    LogNormal,
    Study,
    Vary,
    diagnose,
    estimate,
    from_estimation,
    judge,
    profiles,
    verdict,
)

__all__ = [
    "TF",
    "BondGraph",
    "C",
    "Coulomb",
    "De",
    "Df",
    "Dq",
    "Hysteretic",
    "I",
    "LogNormal",
    "One",
    "Options",
    "PrandtlIshlinskii",
    "R",
    "Recording",
    "Se",
    "Sf",
    "Study",
    "Vary",
    "Zero",
    "diagnose",
    "estimate",
    "from_estimation",
    "judge",
    "profiles",
    "simulate",
    "verdict",
]
