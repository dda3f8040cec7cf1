"""Fits by prediction errors: a Kalman filter takes up what the equations do not know."""

from identification.prediction.deficiency import Deficiency as Deficiency
from identification.prediction.deficiency import DeficiencyReport as DeficiencyReport
from identification.prediction.deficiency import deficient_equations as deficient_equations
from identification.prediction.likelihood import Evaluation as Evaluation
from identification.prediction.likelihood import evaluate as evaluate
from identification.prediction.model import PredictionModel as PredictionModel
from identification.prediction.result import Predicted as Predicted
from identification.prediction.result import PredictionFit as PredictionFit
from identification.prediction.result import fit_prediction as fit_prediction
