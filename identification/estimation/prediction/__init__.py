"""Prediction errors: a Kalman filter takes up what the equations do not know."""

from identification.estimation.prediction.deficiency import Deficiency as Deficiency
from identification.estimation.prediction.deficiency import DeficiencyReport as DeficiencyReport
from identification.estimation.prediction.deficiency import (
    deficient_equations as deficient_equations,
)
