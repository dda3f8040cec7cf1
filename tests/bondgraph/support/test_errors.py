"""Errors carry what to try as data, so that a caller can leave out what it does not have."""

from __future__ import annotations

import pickle

from bondgraph.support.errors import UnusableInput, unknown_name
from bondsight.cli.arguments import EVEN, fitting

ODD = UnusableInput("t.csv: odd", remedies=["cut it", "keep some (rows=(3, 9))", "see map="])


def test_remedies_end_the_line_and_travel() -> None:
    assert str(ODD) == "t.csv: odd; cut it, or keep some (rows=(3, 9)), or see map="
    assert pickle.loads(pickle.dumps(ODD)).remedies == ODD.remedies
    assert str(UnusableInput("odd")) == "odd"
    assert unknown_name("channel", "y", "run", ["x"]).remedies == ()


def test_a_verb_tells_the_remedies_that_it_has() -> None:
    assert fitting(ODD, "--rows", "--map") is ODD
    assert str(fitting(ODD, "--map")) == "t.csv: odd; cut it, or see map="
    assert fitting(ODD).remedies == ("cut it",)
    alone = UnusableInput("odd; as --rows says", remedies=["keep some (rows=(3, 9))"])
    assert str(fitting(alone)) == f"odd; as --rows says; {EVEN}"
