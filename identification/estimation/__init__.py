"""Fit any model to any recordings: `Study` says what, `estimate` does it."""

from identification.estimation.estimate import estimate as estimate
from identification.estimation.estimates import Estimate as Estimate
from identification.estimation.guess import Guess as Guess
from identification.estimation.guess import explained_guess as explained_guess
from identification.estimation.guess import guess as guess
from identification.estimation.levenberg_marquardt import FitStatus as FitStatus
from identification.estimation.result import Estimation as Estimation
from identification.study.calibration import Known as Known
from identification.study.priors import LogNormal as LogNormal
from identification.study.priors import Normal as Normal
from identification.study.priors import Prior as Prior
from identification.study.specification import NO_NUISANCES as NO_NUISANCES
from identification.study.specification import Nuisances as Nuisances
from identification.study.specification import Vary as Vary
from identification.study.study import SettledSetting as SettledSetting
from identification.study.study import Study as Study
