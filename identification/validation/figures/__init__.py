"""Pictures of a judgement; the noise floor is drawn wherever it has a meaning."""

from identification.report.picture import Picture as Picture
from identification.validation.figures.comparison import comparison_figure as comparison_figure
from identification.validation.figures.correlations import correlation_figure as correlation_figure
from identification.validation.figures.distortion import distortion_figure as distortion_figure
from identification.validation.figures.parameters import parameter_figure as parameter_figure
from identification.validation.figures.residuals import residual_figure as residual_figure
from identification.validation.figures.traces import trace_figure as trace_figure
from identification.validation.figures.waterfall import waterfall_figure as waterfall_figure
