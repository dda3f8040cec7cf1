# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # What do my data determine?
#
# A fit always returns numbers. Whether the data have anything to do with them is another question,
# and it can be answered: before the measurement from the structure of the model, before the fit
# from the start values, after the fit from the misfit around the optimum. Each answer is shown here
# on a piezo stack in the small-signal range, with simulated recordings, so that the truth is known.

# %%
from dataclasses import replace
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np
from threadpoolctl import threadpool_limits

from actuators import stack_bond_graph
from bondgraph import Recording, simulate
from bondgraph.signals.drive_limits import DriveLimits
from identification.estimation import LogNormal, Nuisances, Study, Vary, estimate
from identification.experiments.design.candidates import rank_signals
from identification.experiments.design.limits import fitted
from identification.experiments.design.multisine import multisine
from identification.experiments.design.optimal import optimal_multisine
from identification.experiments.design.sweep import sweep
from identification.uncertainty.cases import case_of
from identification.uncertainty.coverage import coverage
from identification.uncertainty.extra_sensor import helpful_sensors
from identification.uncertainty.figures import correlation_figure, profile_figure, sample_figure
from identification.uncertainty.fitted import from_estimation
from identification.uncertainty.postflight import practical_of
from identification.uncertainty.preflight import preflight
from identification.uncertainty.profiles import profiles
from identification.uncertainty.sampling import sample
from identification.uncertainty.structural import identifiability

threadpool_limits(1)  # small matrices: threads would only wait for each other
# %matplotlib inline
# %config InlineBackend.figure_formats = ['png']
plt.rcParams.update({"figure.dpi": 90})
ALL = ("T", "R_e", "C_nl", "k", "m", "R_nl")
NOISE = {"x": 0.3e-9, "i": 0.3e-3}  # m, A
truth = {"T": 0.0345, "R_e": 6.2, "C_nl": 2.21e-10, "k": 58e6, "m": 6.1e-3, "R_nl": 95.0}
alone = stack_bond_graph(sensors=("x",))
both = stack_bond_graph(sensors=("x", "i"))


def say(*texts):
    """Print with long lines folded."""
    lines = (line for text in texts for line in str(text).splitlines())
    print("\n".join(fill(line, 100, subsequent_indent="      ") for line in lines))


def record(name, signal, values, noise=NOISE, seed=1):
    """Play a signal on the device and add the noise of the instruments."""
    time, volt = signal.time, signal.values
    run = simulate(both, time, {"V_in": volt}, values, accuracy=1e-7, x0="rest", hold="linear")
    rng = np.random.default_rng(seed)
    read = {s: run[s] + level * rng.standard_normal(time.size) for s, level in noise.items()}
    return Recording(name, time, {"V_in": volt, **read}, {"V_in": "V", "x": "m", "i": "A"})


def rising(signal):
    """The same signal, faded in: a recording that begins at rest."""
    n = signal.values.size // 10
    fade = np.ones(signal.values.size)
    fade[:n] = np.sin(0.5 * np.pi * np.arange(n) / n) ** 2
    return replace(signal, values=signal.values * fade, period=0, lines=())


# %% [markdown]
# ## Before the measurement: structure
#
# The stack has six constants; the sensor is a displacement. From the graph alone:

# %%
answer = identifiability(alone)
say(answer)
for gain in helpful_sensors(alone):
    print("further sensor:", gain)
assert answer.missing == 2
assert str(answer.groups[0].determined[0]) == "T*C_nl"
assert identifiability(both).missing == 0

# %% [markdown]
# Displacement alone leaves two numbers open, however long and precise the recording. What is seen
# of `T` is its product with `C_nl`: metres per volt. A current sensor (`Df` at `loop`) closes both
# gaps.
#
# ## A fit that looks fine
#
# A multisine up to 40 kHz, displacement only, all six constants free within a factor of a million, three
# different starts:

# %%
tone = multisine(
    200e3, 1000, band=(400, 40e3), peak=1.5, phases="low_crest", periods=2, seed=1, name="V_in"
)
fast = record("fast", rising(tone), truth)
declared = {name: alone.parameters[name].value for name in ALL}
ANY = tuple(Vary(n, lower=v / 1e6, upper=v * 1e6) for n, v in declared.items())
blind = Study(alone, fast, free=ANY, initial="rest")
fits = [
    estimate(blind.starting(s)) for s in ({}, {"T": 0.02, "C_nl": 4e-10}, {"T": 0.05, "k": 8e7})
]
for f in fits:
    v = f.values
    print(
        f"misfit {f.cost:.4f}, held out {1e9 * f.rmse('test')['x']:.3f} nm:"
        f"  T {1e3 * v['T']:.1f} mm/C,"
        f"  k {1e-6 * v['k']:.1f} N/um,  m {1e3 * v['m']:.2f} g,  T C_nl {v['T'] * v['C_nl']:.5g}"
    )
costs = np.array([f.cost for f in fits])
products = np.array([f.values["T"] * f.values["C_nl"] for f in fits])
assert np.ptp(costs) < 1e-3
assert np.ptp([f.values["T"] for f in fits]) > 0.1 * truth["T"]
assert np.allclose(products, truth["T"] * truth["C_nl"], rtol=3e-3)

# %% [markdown]
# Each one converges, each one is at the noise on held-out samples, and they disagree by tens of
# per cent. Only the product is right, three times. (The bounds are wide on purpose: with those of a
# data sheet `T` would seem to have an interval, only because others stop at their bounds.) After
# the fit it is said in words:

# %%
fit_alone = from_estimation(fits[0])
verdict = practical_of(fit_alone)
say(verdict)
assert verdict.flat
assert not verdict.pinned

# %% [markdown]
# The *profile* asks every value of a parameter: how good can the fit be with this one held and all
# others refitted? Flat for `T`, a clean valley for the product.

# %%
walked = profiles(fit_alone, ("T", "T*C_nl"), most=8)
for p in walked:
    say(p)
profile_figure(walked)

# %%
flat, valley = walked
assert flat.shape == "flat"
assert valley.shape == "two-sided"
assert valley.interval[0] < truth["T"] * truth["C_nl"] < valley.interval[1]

# %% [markdown]
# ## The same with the current
#
# Nothing else is changed: the same voltage, the same noise of the displacement.

# %%
seeing = estimate(Study(both, fast, free=ANY, initial="rest"))
fit_both = from_estimation(seeing)
say(practical_of(fit_both))
walked = profiles(fit_both)
for p in walked:
    say(p)
    assert p.shape == "two-sided"
    low, high = p.interval
    room = 0.5 * (high - low)
    assert low - room < truth[p.name] < high + room
profile_figure(walked)

# %%
correlation_figure(fit_both.plain)

# %% [markdown]
# All six have an interval. Three errors still go together: spring, mass and damper are known far
# better relative to each other than in newtons. Fine for a prediction; a load cell would be the
# way to the newtons.
#
# ## An experiment that says nothing, and one that says half
#
# A load is mounted: mass and damping are unknown again, the rest is known by now. Two quick tests
# at 50 kHz: up to 50 Hz, and up to 400 Hz. The resonance is near 15 kHz. What can be said before
# the fit?

# %%
loaded = truth | {"m": 9.3e-3, "R_nl": 140.0}
known = {name: truth[name] for name in ("T", "R_e", "C_nl", "k")}
load = (
    Vary("m", start=6e-3, lower=1e-7, upper=10.0),
    Vary("R_nl", start=95.0, lower=1e-3, upper=1e6),
)


def study(recording):
    """What is asked of a recording of the loaded stack."""
    return Study(both, recording, free=load, fixed=known, initial="rest")


tests = {}
for top in (50, 400):
    tone = multisine(
        50e3, 2000, band=(25, top), peak=1.5, phases="low_crest", periods=2, seed=1, name="V_in"
    )
    tests[top] = record(f"up to {top} Hz", rising(tone), loaded, seed=2)
for recording in tests.values():
    for finding in preflight(study(recording)):
        say(f"{recording.name} - {finding}")

# %% [markdown]
# Afterwards, with the fits:

# %%
slow = {top: from_estimation(estimate(study(r))) for top, r in tests.items()}
for top, fit in slow.items():
    say(f"up to {top} Hz", practical_of(fit))
masses = [profiles(fit, ("m",))[0] for fit in slow.values()]
for p in masses:
    say(p)
assert any(s.kind == "dead" and "m" in s.names for s in practical_of(slow[50]).statements)

# %% [markdown]
# Up to 50 Hz the mass is *dead*: the readings would not notice ten times as much. Up to 400 Hz the
# data give one half of an answer, an upper bound: more mass would show, less would not. The damper
# stays dead in both: what it does to a slow displacement, a late clock of the sensor would do as
# well, and the fit allows for that.

# %% [markdown]
# ## Which experiment would?
#
# Design turns the question round: which input tells most about mass and damper, within 1.5 V and
# 60 mA? For a linear model the best power of every line is a convex problem. The averages are taken
# over what is believed: mass within 20 %, damper within 30 %.

# %%
room = DriveLimits(low=-1.5, high=1.5, current=0.06, capacitance=0.69e-6)
guess = known | {"m": 8e-3, "R_nl": 120.0}
common = {"rate": 200e3, "period": 2000, "periods": 2}
proposal = optimal_multisine(
    both, "V_in", NOISE, band=(200.0, 40e3), chosen=("m", "R_nl"), nuisances=(), values=guess,
    prior={"m": 0.2, "R_nl": 0.3}, envelope=room, unit="V", **common,
)  # fmt: skip
say(proposal)

# %% [markdown]
# Power belongs on both flanks of the resonance. Ready-made signals can be ranked the same way; this
# works for any model, hysteretic ones included:

# %%
slow_tone = multisine(
    band=(200, 2000), peak=1.5, phases="low_crest", name="V_in", unit="V", **common
)
wide_tone = multisine(
    band=(200, 40e3), peak=1.5, phases="low_crest", name="V_in", unit="V", **common
)
chirp = sweep(200e3, 200.0, 40e3, 0.02, amplitude=1.5, name="V_in")
candidates = [proposal.signal, *(fitted(s, room).signal for s in (slow_tone, wide_tone, chirp))]
ranking = rank_signals(
    both, candidates, NOISE, chosen=("m", "R_nl"), nuisances=(), values=guess,
    reference=candidates[1],
)  # fmt: skip
say(ranking)
assert ranking.best is proposal.signal

# %% [markdown]
# So it is measured, once, and fitted:

# %%
designed = record("designed", rising(proposal.signal), loaded, seed=4)
result = estimate(study(designed))
fit_designed = from_estimation(result)
say(practical_of(fit_designed))
on_time = estimate(study(designed).changed(nuisances=Nuisances(lags=False)))
for free, exact, row in zip(
    result.estimates, on_time.estimates, proposal.expected.rows, strict=True
):
    wide, narrow = (0.5 * (e.ci95[1] - e.ci95[0]) for e in (free, exact))
    print(
        f"{free.name}: true {loaded[free.name]:.5g}, found {free.value:.5g} +- {wide:.2g}; sensors "
        f"on time {exact.value:.5g} +- {narrow:.2g}; designed +- {1.96 * row.sd:.2g} {free.unit}"
    )
    assert abs(free.value - loaded[free.name]) < 1.7 * wide
    assert 1.96 * row.sd < narrow < 4 * 1.96 * row.sd
masses.append(profiles(fit_designed, ("m",))[0])
for p in masses:
    say(p)
assert [p.shape for p in masses] == ["open below", "multimodal", "two-sided"]
assert masses[0].interval[0] == masses[1].interval[0] == 0.0
assert masses[0].interval[1] > 10 * masses[1].interval[1] > 10 * loaded["m"]
profile_figure(masses)

# %% [markdown]
# The mass from three experiments, from left to right: up to 50 Hz, up to 400 Hz, designed. Next to
# nothing, an upper bound (below it a second valley: less mass with next to no damping does nearly as
# well), a value. The damper is there as well.
# The interval is wider than designed, mostly because the fit allows each sensor a delay, of which
# the design knows nothing; the rest is the third that is held out and a resonance that is not quite
# where it was believed to be.
#
# ## One step further: samples
#
# Where the data give half an answer, prior knowledge counts. Say the load was weighed roughly, 8 g
# within a factor 2. A short test up to 400 Hz, fitted with this prior; beside the interval of the
# fit, which is symmetric in the logarithm, the profile and samples of the posterior.

# %%
tone = multisine(50e3, 1000, band=(50, 400), peak=1.5, phases="low_crest", seed=1, name="V_in")
short = record("short", rising(tone), loaded, seed=8)
weighed = Study(
    both,
    short,
    free=(Vary("m", start=6e-3, lower=1e-7, upper=10.0, prior=LogNormal(8e-3, 2.0)),),
    fixed=known | {"R_nl": loaded["R_nl"]},
    initial="rest",
    nuisances=Nuisances(lags=False),
)
posterior = from_estimation(estimate(weighed))
draws = sample(posterior, steps=1600, walkers=4, seed=1)
walk = profiles(posterior, ("m",))[0]
say(draws)
for label, (low, high) in (
    ("fit", posterior.plain.interval("m")),
    ("profile", walk.interval),
    ("samples", draws.quantiles()["m"][::2]),
):
    print(f"{label:8s} mass from {1e3 * low:5.2f} g to {1e3 * high:5.2f} g")
    assert low < loaded["m"] < high
assert draws.status == "converged"
sample_figure(draws)

# %% [markdown]
# Below some size a mass does not show any more, and there the prior alone decides. Profile and
# samples follow that; the symmetric interval reaches too far up.
#
# ## Do the intervals hold what they promise?
#
# "95 %" is a claim about repetitions, so it is repeated: the stack again and again with new noise,
# fitted from starts up to 10 % off. Once with white noise, once with noise that remembers (0.8 from
# sample to sample) and a fit that takes it for white.

# %%
case = case_of(both, samples=300, top=30e3)
white = coverage(case, 40, kinds=("fisher",))
print(white)
coloured = coverage(replace(case, colour=0.8), 40, kinds=("fisher", "sandwich"))
print(coloured)
assert all(count.holds for count in white.of("fisher"))
assert 0.91 < white.overall("fisher") < 0.985
assert coloured.overall("fisher") < 0.9
assert coloured.overall("sandwich") > coloured.overall("fisher")

# %% [markdown]
# With white noise the claim holds. Coloured noise taken for white makes the plain intervals too
# narrow; the *sandwich*, which looks at the residuals themselves, repairs most of it, and
# `noise="coloured"` models it.
#
# ## Bad input, in words
#
# The questions can be asked of any recording before a fit. Some common accidents:

# %%
x, volt = fast.channels["x"], fast.channels["V_in"]
stuck = x.copy()
stuck[700:1000] = stuck[700]
accidents = {
    "displacement in nanometres taken for micrometres": {"x": 1e-3 * x},
    "sensor not connected": {"x": 0 * x + 2e-6},
    "sensor stuck for a while": {"x": stuck},
    "amplifier off": {"V_in": 0 * volt},
    "drift": {"x": x + 2e-7 * fast.time / fast.time[-1]},
}
found = {}
for name, changed in accidents.items():
    recording = replace(fast, channels={**fast.channels, **changed})
    found[name] = preflight(Study(both, recording, free=ALL, initial="rest"))
    more = len(found[name]) - 1
    say(f"- {name}: {found[name][0]}" + (f" (and {more} more)" if more else ""))
assert all(found.values())
assert preflight(Study(both, fast, free=ALL, initial="rest")) == ()

# %% [markdown]
# Each sentence says what, where, why, and what to do. The good recording raised none.
