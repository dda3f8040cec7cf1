"""Inputs worth measuring with: signals, what an amplifier stands, and what tells most."""

from __future__ import annotations

from identification.design.candidates import Ranking, flat_like, rank_signals, record_information
from identification.design.expected import Expected, Table
from identification.design.limits import Check, Envelope, Fitted, extremes, fitted, within
from identification.design.loops import demagnetise, reversal_curves, through
from identification.design.multisine import multisine, orthogonal_multisines
from identification.design.optimal import Proposal, information_of_signal, optimal_multisine
from identification.design.signal import Signal, join
from identification.design.steps import prbs, staircase
from identification.design.sweep import sweep
from identification.design.verification import Coverage, verify
from identification.design.weights import Weights, optimal_weights

__all__ = [
    "Check",
    "Coverage",
    "Envelope",
    "Expected",
    "Fitted",
    "Proposal",
    "Ranking",
    "Signal",
    "Table",
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
