"""Published bond graphs with their results, and the judge of any tool's answers to them."""

from bondgraph.conformance.anchors import judge_bondgraphtools as judge_bondgraphtools
from bondgraph.conformance.anchors import peer_version as peer_version
from bondgraph.conformance.answer import Answer as Answer
from bondgraph.conformance.build import build as build
from bondgraph.conformance.case import Case as Case
from bondgraph.conformance.case import case as case
from bondgraph.conformance.case import cases as cases
from bondgraph.conformance.check import VERDICTS as VERDICTS
from bondgraph.conformance.check import Judgement as Judgement
from bondgraph.conformance.check import judge as judge
from bondgraph.conformance.ours import judge_bondsight as judge_bondsight
from bondgraph.conformance.reader import read_expression as read_expression
