from identification.datasets import load as load
from identification.diagnosis.catalogue.effect import Effect as Effect
from identification.diagnosis.diagnose import Diagnosis as Diagnosis
from identification.diagnosis.diagnose import diagnose as diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions as DiagnosisOptions
from identification.diagnosis.studio.page import write_report as write_report
from identification.diagnosis.verdict.document import verdict as verdict
from identification.diagnosis.verdict.folder import write_verdict as write_verdict
from identification.estimation.archive import open_fit as open_fit
from identification.estimation.archive import save_fit as save_fit
from identification.estimation.estimate import estimate as estimate
from identification.estimation.estimates import Estimate as Estimate
from identification.estimation.guess import guess as guess
from identification.estimation.result import Estimation as Estimation
from identification.estimation.starts import Starts as Starts
from identification.estimation.starts import many_starts as many_starts
from identification.experiments.design import Signal as Signal
from identification.experiments.design import multisine as multisine
from identification.experiments.design import optimal_multisine as optimal_multisine
from identification.experiments.design import sweep as sweep
from identification.experiments.frequency import FrequencyResponse as FrequencyResponse
from identification.experiments.frequency import (
    best_linear_approximation as best_linear_approximation,
)
from identification.experiments.frequency import distortions as distortions
from identification.study.calibration import Known as Known
from identification.study.priors import LogNormal as LogNormal
from identification.study.priors import Normal as Normal
from identification.study.priors import Prior as Prior
from identification.study.specification import Nuisances as Nuisances
from identification.study.specification import Vary as Vary
from identification.study.study import Study as Study
from identification.uncertainty.coverage import Coverage as Coverage
from identification.uncertainty.coverage import coverage as coverage
from identification.uncertainty.fitted import from_estimation as from_estimation
from identification.uncertainty.profile import Profile as Profile
from identification.uncertainty.profiles import profiles as profiles
from identification.uncertainty.structural import (
    StructuralIdentifiability as StructuralIdentifiability,
)
from identification.uncertainty.structural import identifiability as identifiability
from identification.validation.compare import Comparison as Comparison
from identification.validation.compare import compare as compare
from identification.validation.judge import Judgement as Judgement
from identification.validation.judge import judge as judge
