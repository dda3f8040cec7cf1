"""Inputs worth measuring with: signals, what an amplifier stands, and what tells most."""

from __future__ import annotations

from identification.experiments.design.candidates import (
    Ranking,
    flat_like,
    rank_signals,
    record_information,
)
from identification.experiments.design.expected import Expected, ExpectedTable
from identification.experiments.design.limits import Check, FittedSignal, extremes, fitted, within
from identification.experiments.design.loops import demagnetise, reversal_curves, through
from identification.experiments.design.multisine import multisine, orthogonal_multisines
from identification.experiments.design.optimal import (
    Proposal,
    information_of_signal,
    optimal_multisine,
)
from identification.experiments.design.signal import Signal, join
from identification.experiments.design.steps import prbs, staircase
from identification.experiments.design.sweep import sweep
from identification.experiments.design.verification import VerifiedIntervals, verify
from identification.experiments.design.weights import Weights, optimal_weights

__all__ = [
    "Check",
    "Expected",
    "ExpectedTable",
    "FittedSignal",
    "Proposal",
    "Ranking",
    "Signal",
    "SignalLimits",
    "VerifiedIntervals",
    "Weights",
    "demagnetise",
    "extremes",
    "fitted",
    "flat_like",
    "information_of_signal",
    "join",
    "multisine",
    "optimal_multisine",
    "optimal_weights",
    "orthogonal_multisines",
    "prbs",
    "rank_signals",
    "record_information",
    "reversal_curves",
    "staircase",
    "sweep",
    "through",
    "verify",
    "within",
]
