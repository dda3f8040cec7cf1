"""Where in the recording a model fails: ranked stretches of time, frequency, state and history."""

from identification.diagnosis.localisation.recording.axes import MisfitAxis as MisfitAxis
from identification.diagnosis.localisation.recording.axes import axes_of as axes_of
from identification.diagnosis.localisation.recording.ranking import distinct as distinct
from identification.diagnosis.localisation.recording.ranking import where as where
from identification.diagnosis.localisation.recording.region import Region as Region
from identification.diagnosis.localisation.recording.region import words as words
