"""What is held out is divided: some for choices, some for the result alone."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bondgraph.signals.split import LEAST_KEPT, Split, interleaved, kept_back, stretches


def samples(part: slice | tuple[slice, ...], n: int) -> set[int]:
    return {int(i) for p in stretches(part) for i in np.arange(n)[p]}


@given(st.integers(30, 3000), st.integers(3, 90))
def test_both_parts_together_are_what_was_held_out(n: int, blocks: int) -> None:
    split = interleaved(0, n, blocks)
    seen, unseen = kept_back(split)
    held = samples(split.test, n)
    if seen is split:
        assert unseen is split
        assert 0.25 * len(held) < LEAST_KEPT
        return
    one, other = samples(seen.test, n), samples(unseen.test, n)
    assert one | other == held
    assert not one & other
    assert len(other) >= LEAST_KEPT
    assert 0.2 * len(held) < len(other) < 0.6 * len(held)
    assert seen.train == unseen.train == split.train
    assert samples(unseen.looked_at, n) == one
    assert seen.rule == split.rule != unseen.rule


def test_of_one_stretch_the_end_is_kept_back() -> None:
    seen, unseen = kept_back(Split(slice(0, 700), slice(700, 1000), "the last samples"))
    assert seen.test == (slice(700, 880),)
    assert unseen.test == (slice(880, 1000),)


def test_a_short_record_keeps_nothing_back() -> None:
    split = Split(slice(0, 100), slice(100, 160), "the last samples")
    assert kept_back(split) == (split, split)
