"""Fit any model to any recordings: `Study` says what, `estimate` does it."""

from __future__ import annotations

from identification.estimation.estimate import estimate
from identification.estimation.guess import Guess, explained_guess, guess
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.result import Estimation
from identification.estimation.single_record import Estimate
from identification.study.specification import (
    NO_NUISANCES,
    LogNormal,
    Normal,
    Nuisances,
    Prior,
    Vary,
)
from identification.study.study import SettledSetting, Study

__all__ = [
    "NO_NUISANCES",
    "Estimate",
    "Estimation",
    "FitStatus",
    "Guess",
    "LogNormal",
    "Normal",
    "Nuisances",
    "Prior",
    "SettledSetting",
    "Study",
    "Vary",
    "estimate",
    "explained_guess",
    "guess",
]
