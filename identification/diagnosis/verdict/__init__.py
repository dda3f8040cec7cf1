"""The verdict of a diagnosis: a document, read back strictly, and its words."""

from identification.diagnosis.verdict.document import KINDS as KINDS
from identification.diagnosis.verdict.document import effect_parameters as effect_parameters
from identification.diagnosis.verdict.document import normalised_error as normalised_error
from identification.diagnosis.verdict.document import unresolved_place as unresolved_place
from identification.diagnosis.verdict.document import verdict as verdict
from identification.diagnosis.verdict.folder import NEXT as NEXT
from identification.diagnosis.verdict.folder import next_input as next_input
from identification.diagnosis.verdict.folder import write_verdict as write_verdict
from identification.diagnosis.verdict.reading import parse_verdict as parse_verdict
from identification.diagnosis.verdict.reading import read_verdict as read_verdict
from identification.diagnosis.verdict.said_again import retold as retold
from identification.diagnosis.verdict.text import answered as answered
from identification.diagnosis.verdict.text import headline as headline
from identification.diagnosis.verdict.text import in_words as in_words
from identification.diagnosis.verdict.text import sentence as sentence
