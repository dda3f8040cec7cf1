"""Pictures of a judgement; the noise floor is drawn wherever it has a meaning."""

from identification.judgement.figures.comparison import comparison_figure as comparison_figure
from identification.judgement.figures.correlations import correlation_figure as correlation_figure
from identification.judgement.figures.distortion import distortion_figure as distortion_figure
from identification.judgement.figures.parameters import parameter_figure as parameter_figure
from identification.judgement.figures.picture import Picture as Picture
from identification.judgement.figures.residuals import residual_figure as residual_figure
from identification.judgement.figures.traces import trace_figure as trace_figure
from identification.judgement.figures.waterfall import waterfall_figure as waterfall_figure
