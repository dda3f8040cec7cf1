"""Inputs worth measuring with: signals, what an amplifier stands, and what tells most."""

from identification.experiments.design.candidates import Ranking as Ranking
from identification.experiments.design.candidates import flat_like as flat_like
from identification.experiments.design.candidates import rank_signals as rank_signals
from identification.experiments.design.candidates import record_information as record_information
from identification.experiments.design.expected import Expected as Expected
from identification.experiments.design.expected import ExpectedTable as ExpectedTable
from identification.experiments.design.limits import Check as Check
from identification.experiments.design.limits import FittedSignal as FittedSignal
from identification.experiments.design.limits import extremes as extremes
from identification.experiments.design.limits import fitted as fitted
from identification.experiments.design.limits import within as within
from identification.experiments.design.loops import demagnetise as demagnetise
from identification.experiments.design.loops import reversal_curves as reversal_curves
from identification.experiments.design.loops import through as through
from identification.experiments.design.multisine import multisine as multisine
from identification.experiments.design.multisine import (
    orthogonal_multisines as orthogonal_multisines,
)
from identification.experiments.design.optimal import Proposal as Proposal
from identification.experiments.design.optimal import information_of_signal as information_of_signal
from identification.experiments.design.optimal import optimal_multisine as optimal_multisine
from identification.experiments.design.signal import Signal as Signal
from identification.experiments.design.steps import prbs as prbs
from identification.experiments.design.steps import staircase as staircase
from identification.experiments.design.sweep import sweep as sweep
from identification.experiments.design.weights import Weights as Weights
from identification.experiments.design.weights import optimal_weights as optimal_weights
