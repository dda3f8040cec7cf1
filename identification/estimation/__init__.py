"""Fit any model to any recordings: `Study` says what, `estimate` does it."""

from __future__ import annotations

from identification.estimation.estimate import estimate
from identification.estimation.guess import Guess, explained_guess, guess
from identification.estimation.result import Estimation
from identification.estimation.specification import (
    NO_NUISANCES,
    LogNormal,
    Normal,
    Nuisances,
    Prior,
    Vary,
)
from identification.estimation.study import Setting, Study
from identification.fit import Estimate
from identification.levenberg_marquardt import Status

__all__ = [
    "NO_NUISANCES",
    "Estimate",
    "Estimation",
    "Guess",
    "LogNormal",
    "Normal",
    "Nuisances",
    "Prior",
    "Setting",
    "Status",
    "Study",
    "Vary",
    "estimate",
    "explained_guess",
    "guess",
]
