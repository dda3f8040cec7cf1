"""What the demo draws: seeds that stay, plants of development only, effects that show."""

from __future__ import annotations

import numpy as np
import pytest

from hardware.simulators.generator import showing
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.laws_withheld import WITHHELD_LAWS
from hardware.simulators.generator.making_exam import exam_record
from hardware.simulators.generator.parameters import ALL_PLANTS, WITHHELD_PLANTS
from hardware.simulators.generator.prepared import PREPARED, prepared
from hardware.simulators.generator.showing import (
    HIDES,
    NOTHING,
    SHOWN,
    SHOWS,
    draw_shown,
    effects_of,
    left_over,
    plants_of,
    shown,
)


def test_the_same_seed_is_the_same_recording() -> None:
    (one, truth), (other, same) = shown(8), shown(8)
    assert truth == same
    assert all(np.array_equal(one[k], other[k]) for k in one)
    assert draw_shown(8) != draw_shown(9)


def test_the_recording_made_beforehand_is_a_draw() -> None:
    (kept, truth), (made, same) = prepared(), shown(*PREPARED)
    assert (truth["effects"][0]["law"], truth["parameters"]) == ("turbulent", same["parameters"])
    assert kept.keys() == made.keys()
    for name, values in made.items():
        if isinstance(values, str):
            assert kept[name] == values
            continue
        near = np.asarray(kept[name], float)
        assert near == pytest.approx(values, rel=1e-6, abs=1e-6 * float(np.ptp(values)))


def test_plants_and_laws_of_sealed_trials_are_not_shown() -> None:
    assert set(SHOWN) == set(ALL_PLANTS) - set(WITHHELD_PLANTS)
    laws = {c.law for hides in HIDES.values() for at in hides.values() for c in at}
    assert not laws & set(WITHHELD_LAWS)
    assert all(at for hides in HIDES.values() for at in hides.values())


def test_a_wish_is_kept() -> None:
    for seed in range(20):
        case = draw_shown(seed, "tanks")
        assert case.plant == "tanks"
        assert {e.effect for e in case.effects} <= set(effects_of("tanks"))
        case = draw_shown(seed, effect="overflow")
        assert [e.effect for e in case.effects] == ["overflow"]
        assert case.plant in plants_of("overflow")
        assert draw_shown(seed, effect=NOTHING).effects == ()
    assert plants_of("overflow") == ("tanks",)
    assert plants_of() == plants_of(NOTHING) == tuple(SHOWN)


def test_draws_differ_and_some_conceal_nothing() -> None:
    cases = [draw_shown(seed) for seed in range(300)]
    assert {c.plant for c in cases} == set(SHOWN)
    assert 30 < sum(not c.effects for c in cases) < 90
    assert len({e.effect for c in cases for e in c.effects}) > 25


@pytest.mark.parametrize(
    ("seed", "plant"), [(1, None), (2, None), (8, None), (12, None), (3, "cylinder")]
)
def test_what_is_concealed_shows(seed: int, plant: str | None) -> None:
    """The last one is a clock that is off, told beside more samples than it gives."""
    channels, truth = shown(seed, plant)
    made = ALL_PLANTS[str(channels["plant"])]
    assert set(channels) >= {"time", made.source[0], *made.sensors}
    assert max(truth["moved"].values()) >= SHOWS
    assert left_over(draw_shown(seed, plant), truth) >= SHOWS


def test_a_wrong_gain_of_the_pressure_is_what_parameters_imitate() -> None:
    case = draw_shown(1, "cylinder", "sensor_gain")
    _, truth = exam_record(case)
    assert left_over(case, truth) < 0.05 * max(truth["moved"].values())
    assert left_over(case, truth) < SHOWS


def test_what_would_not_show_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[DrawnCase] = []

    def kept(case: DrawnCase) -> tuple[dict[str, str], dict[str, object]]:
        made.append(case)
        return {}, {"effects": [{}]}

    monkeypatch.setattr(showing, "exam_record", kept)
    monkeypatch.setattr(showing, "left_over", lambda *_: 0.5 if len(made) < 3 else 9.0)
    shown(8)
    assert len(made) == 3
    assert len({c.seed for c in made}) == 3
    assert len({(c.plant, c.effects[0].effect) for c in made}) == 1
