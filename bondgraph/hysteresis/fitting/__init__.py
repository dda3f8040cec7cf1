"""Fit the weights of operators to recordings: convex problems with checked answers.

>>> import numpy as np
>>> from bondgraph.hysteresis import PrandtlIshlinskii
>>> truth = PrandtlIshlinskii((0.0, 1.0, 3.0), (2.0, -1.0, 0.5))
>>> x = 5.0 * np.sin(np.linspace(0.0, 10.0, 300))
>>> fit = fit_weights(truth.thresholds, x, truth.run(x)[0])
>>> fit.weights.round(9).tolist(), fit.rms < 1e-12
([2.0, -1.0, 0.5], True)
"""

from bondgraph.hysteresis.fitting.excited import Unexcited as Unexcited
from bondgraph.hysteresis.fitting.kuhnen_joint import JointFit as JointFit
from bondgraph.hysteresis.fitting.kuhnen_joint import fit_kuhnen as fit_kuhnen
from bondgraph.hysteresis.fitting.least_squares import fit_linear_blocks as fit_linear_blocks
from bondgraph.hysteresis.fitting.loading_curve import LoadingCurveFit as LoadingCurveFit
from bondgraph.hysteresis.fitting.loading_curve import elements_from_slopes as elements_from_slopes
from bondgraph.hysteresis.fitting.loading_curve import fit_loading_curve as fit_loading_curve
from bondgraph.hysteresis.fitting.loading_curve import loading_samples as loading_samples
from bondgraph.hysteresis.fitting.maxwell import fit_maxwell as fit_maxwell
from bondgraph.hysteresis.fitting.prandtl_ishlinskii import fit_weights as fit_weights
from bondgraph.hysteresis.fitting.result import LinearFit as LinearFit
from bondgraph.hysteresis.fitting.result import OperatorFit as OperatorFit
