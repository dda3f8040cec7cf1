"""Published bond graphs with their results, and the judge of any tool's answers to them."""

from tests.proof.conformance.anchors import judge_bondgraphtools as judge_bondgraphtools
from tests.proof.conformance.anchors import peer_version as peer_version
from tests.proof.conformance.answer import Answer as Answer
from tests.proof.conformance.build import build as build
from tests.proof.conformance.case import Case as Case
from tests.proof.conformance.case import case as case
from tests.proof.conformance.case import cases as cases
from tests.proof.conformance.check import VERDICTS as VERDICTS
from tests.proof.conformance.check import Judgement as Judgement
from tests.proof.conformance.check import judge as judge
from tests.proof.conformance.ours import judge_bondsight as judge_bondsight
from tests.proof.conformance.reader import read_expression as read_expression
