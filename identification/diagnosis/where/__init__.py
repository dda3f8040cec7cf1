"""Where in the recording a model fails: ranked stretches of time, frequency, state and history."""

from identification.diagnosis.where.axes import Axis as Axis
from identification.diagnosis.where.axes import axes_of as axes_of
from identification.diagnosis.where.ranking import distinct as distinct
from identification.diagnosis.where.ranking import where as where
from identification.diagnosis.where.region import Region as Region
from identification.diagnosis.where.region import words as words
