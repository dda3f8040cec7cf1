"""Fits by prediction errors: a Kalman filter takes up what the equations do not know."""

from identification.estimation.prediction.deficiency import Deficiency as Deficiency
from identification.estimation.prediction.deficiency import DeficiencyReport as DeficiencyReport
from identification.estimation.prediction.deficiency import (
    deficient_equations as deficient_equations,
)
from identification.estimation.prediction.likelihood import (
    LikelihoodEvaluation as LikelihoodEvaluation,
)
from identification.estimation.prediction.likelihood import evaluate as evaluate
from identification.estimation.prediction.model import PredictionModel as PredictionModel
from identification.estimation.prediction.result import Predicted as Predicted
from identification.estimation.prediction.result import PredictionFit as PredictionFit
from identification.estimation.prediction.result import fit_prediction as fit_prediction
