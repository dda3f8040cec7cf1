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
# # A person's proof
#
# You hide an effect in a small machine; Bondsight gets a recording and a model that knows nothing
# of it. Change the next cell, run all, and watch. Or give a recording of your own.
#
# The machine is a carriage on a spring, pushed by a force, with a load on a second spring: two
# springs, three dampers and two sensors, so that *where* is a question as well as *what*. It is
# written below in plain equations and integrated by SciPy; nothing of Bondsight is in it.

# %%
EFFECT = "stiffening"  # a name of the menu below, "mine", or None to hide nothing
PLACE = "k_2"  # where: the menu says what is possible
STRENGTH = 1.0  # 1 is clearly visible, 0.01 hardly
NOISE = 1e-5  # m, of both sensors
SEED = 1


def mine(x, v, t):
    """Write a force (N) of your own: by stroke (m) or speed (m/s) of PLACE, and time (s)."""
    return 2.0 * v * abs(x) / 0.005


RECORDING = None  # or "path/to/recording.csv", with units in its header, as in F[N]
MODEL = None  # then also "path/to/model.py" with a function model(), see the README
MAP = {}  # and, where the names differ, {"x": "displacement_um"}

# %%
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import SVG, display
from scipy.integrate import solve_ivp
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from actuators.models.opening import load_model
from bondgraph import BondGraph, C, Dq, I, One, R, Recording, Se, Zero
from bondgraph.drawing.svg import svg
from identification.datasets.opening import open_recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.explanation.next_experiment import next_experiments
from identification.diagnosis.localisation.recording import where, words
from identification.diagnosis.report.found import confidence_of, found_of, places_of
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import sentence, verdict

threadpool_limits(1)  # small matrices: threads would only wait for each other
# %matplotlib inline
# %config InlineBackend.figure_formats = ['png']
plt.rcParams.update({"figure.dpi": 90, "axes.grid": True, "grid.alpha": 0.3})


def say(*texts):
    """Print with long lines folded."""
    lines = (line for text in texts for line in str(text).splitlines())
    print("\n".join(fill(line, 100, subsequent_indent="      ") for line in lines))


# %% [markdown]
# ## What you may hide
#
# Each entry: the name that a right answer would give, the places, and the law. An element of the
# machine gets the law in addition; a source or a sensor passes its signal through it.

# %%
REACH, SPEED, FORCE = 6e-3, 0.05, 20.0  # typical stroke m, speed m/s, force N
MENU = {
    "stiffening": ("nonlinear_stiffness", ("k_1", "k_2"),
                   lambda a, x, v, t: a * 8.0 * (x / REACH) ** 3),
    "stop": ("end_stop", ("k_1", "k_2"),
             lambda a, x, v, t: a * 2e4 * (max(x - 4e-3, 0.0) + min(x + 4e-3, 0.0))),
    "drag": ("quadratic_drag", ("d_1", "d_2", "d_3"),
             lambda a, x, v, t: a * 1.2 * v * abs(v) / SPEED**2 / 2),
    "dry friction": ("coulomb_friction", ("d_1", "d_3"),
                     lambda a, x, v, t: a * 1.0 * np.tanh(v / 2e-5)),
    "weak amplifier": ("saturation", ("F",),
                       lambda a, u: np.clip(u, -FORCE * (1 - 0.4 * a), FORCE * (1 - 0.4 * a))),
    "slow sensor": ("sensor_lag", ("x_1", "x_2"),
                    lambda a, y: lfilter([1 - 0.4 * a], [1, -0.4 * a], y)),
    "mine": ("?", ("k_1", "k_2", "d_1", "d_2", "d_3"),
             lambda a, x, v, t: a * mine(x, v, t)),
}  # fmt: skip
for name, (effect, places, _) in MENU.items():
    print(f"{name:15s} {effect:20s} at {', '.join(places)}")
assert EFFECT is None or (EFFECT in MENU and PLACE in MENU[EFFECT][1]), "not on the menu"

# %% [markdown]
# ## The machine
#
# Its constants are not those of the model below either: a wrong value must not pass for physics.

# %%
TRUE = {"m_1": 0.83, "m_2": 0.52, "d_1": 5.5, "d_2": 1.4, "d_3": 2.2, "k_1": 2900.0, "k_2": 1550.0}
TIME = np.arange(2000) * 4e-3


def measured(hide):
    """Two masses, three dampers, two springs, and what is hidden; by LSODA."""

    def passed(name, values):
        return MENU[hide][2](STRENGTH, values) if hide and PLACE == name else values

    def added(name, x, v, t):
        return MENU[hide][2](STRENGTH, x, v, t) if hide and PLACE == name else 0.0

    rng = np.random.default_rng(SEED)
    tones = np.arange(0.25, 12.0, 0.25)
    phases = rng.uniform(0, 2 * np.pi, tones.size)
    force = np.cos(2 * np.pi * np.outer(TIME, tones) + phases).sum(axis=1)
    force *= np.linspace(0.3, 1.0, TIME.size) * FORCE / np.abs(force).max()
    given = passed("F", force)

    def rates(t, state):
        x, v, y, w = state
        spring = TRUE["k_1"] * x + TRUE["d_1"] * v
        spring += added("k_1", x, v, t) + added("d_1", x, v, t)
        link = TRUE["k_2"] * (x - y) + TRUE["d_2"] * (v - w)
        link += added("k_2", x - y, v - w, t) + added("d_2", x - y, v - w, t)
        drag = TRUE["d_3"] * w + added("d_3", y, w, t)
        push = np.interp(t, TIME, given)
        return v, (push - spring - link) / TRUE["m_1"], w, (link - drag) / TRUE["m_2"]

    run = solve_ivp(
        rates, (0.0, TIME[-1]), np.zeros(4), "LSODA", TIME, rtol=1e-7, atol=1e-10, max_step=4e-3
    )
    read = {"x_1": passed("x_1", run.y[0]), "x_2": passed("x_2", run.y[2])}
    noisy = {n: y + NOISE * rng.standard_normal(TIME.size) for n, y in read.items()}
    return Recording("machine", TIME, {"F": force, **noisy}, {"F": "N", "x_1": "m", "x_2": "m"})


# %% [markdown]
# ## The model
#
# All that Bondsight is told: a linear graph with round numbers, and the recording.


# %%
def linear():
    """Return the same machine as a person would first write it down."""
    with BondGraph("carriage_with_load") as graph:
        carriage, load, link, rod = One("carriage"), One("load"), Zero("link"), One("rod")
        Se("F", unit="N") >> carriage >> I("m_1", 0.8, unit="kg")
        carriage >> R("d_1", 5.0, unit="N*s/m")
        carriage >> C("k_1", stiffness=3000.0, unit="N/m")
        carriage >> link >> load
        link >> rod >> C("k_2", stiffness=1500.0, unit="N/m")
        rod >> R("d_2", 1.5, unit="N*s/m")
        load >> I("m_2", 0.5, unit="kg")
        load >> R("d_3", 2.0, unit="N*s/m")
        carriage >> Dq("x_1", unit="m")
        load >> Dq("x_2", unit="m")
    return graph


if RECORDING is None:
    graph, recording, split = linear(), measured(EFFECT), None
else:
    graph = load_model(MODEL)
    recording, split, said = open_recording(RECORDING, graph, MAP)
    say(*said)

figure, rows = plt.subplots(len(recording.channels), 1, figsize=(9, 5), sharex=True)
for row, (name, values) in zip(rows, recording.channels.items(), strict=True):
    row.plot(recording.time, values, lw=0.7)
    row.set_ylabel(f"{name} / {recording.units[name]}")
rows[-1].set_xlabel("time / s")
figure.tight_layout()

# %% [markdown]
# ## The diagnosis

# %%
found = diagnose(graph, recording, split, options=DiagnosisOptions(jobs=1))
say(sentence(found), "")
for step in found.steps:
    for reason in step.reasons:
        say(f"- {reason}")
print(f"{found.seconds:.0f} s")

# %% [markdown]
# ### Step 1: every effect at every port, in one linear step
#
# Before anything is fitted, each effect says what it would add at each port. Sent through the
# linearised model to the sensors, it explains some part of the residual. That is cheap and only a
# first guess: the best ones are fitted in full (dots), and held-out data decide (cross).


# %%
def screening_picture(d, most=16):
    """Share of the misfit that one linear step removes, by effect and port."""
    names = list(dict.fromkeys(s.effect.name for s in d.ranking if s.hint is not None))[:most]
    elements = list(dict.fromkeys(s.element.name for s in d.ranking))
    elements = [n for n in d.graph.elements if n in elements]
    share = np.full((len(names), len(elements)), np.nan)
    for s in d.ranking:
        if s.effect.name in names and s.hint is not None:
            share[names.index(s.effect.name), elements.index(s.element.name)] = s.share
    figure, ax = plt.subplots(figsize=(8, 0.27 * len(names) + 1.2))
    drawn = ax.imshow(share, cmap="YlOrRd", vmin=0, vmax=1, aspect="auto")
    ax.set_xticks(range(len(elements)), elements)
    ax.set_yticks(range(len(names)), [n.replace("_", " ") for n in names])
    ax.grid(False)
    chosen = {(t.effect, t.element) for t in found_of(d)}
    for t in d.trials:
        if t.effect in names and t.element in elements:
            at = elements.index(t.element), names.index(t.effect)
            named = (t.effect, t.element) in chosen
            ax.plot(*at, "x" if named else ".", color="k", ms=11 if named else 5, mew=2.5)
    figure.colorbar(drawn, label="share of the misfit")
    figure.tight_layout()


if found.ranking:
    screening_picture(found)

# %% [markdown]
# ### Step 2: what the full fits leave on held-out samples

# %%
for t in found.trials[:8]:
    print(f"{t.label:38s} {np.sqrt(t.test):10.4g} times the noise")
if found.nominal is not None:
    print(f"{'the model as it is':38s} {np.sqrt(found.nominal.chi2('test')):10.4g}")

# %% [markdown]
# ### Before and after, on samples that no fit has seen


# %%
def held_out(d):
    """Held-out stretch on which the model as it is fails most, as a slice."""
    edge = np.flatnonzero(np.diff(np.r_[0, d.data.mask("test").astype(int), 0]))
    square = np.sum(((d.data.readings - d.nominal.simulated) / d.data.floor) ** 2, axis=1)
    begin, end = max(zip(edge[::2], edge[1::2], strict=True), key=lambda e: square[slice(*e)].sum())
    return slice(begin, min(end, begin + 600))


def fits_of(d):
    """Return what is compared, with a colour each."""
    after = d.repaired or (found_of(d)[-1].fit if found_of(d) else None)
    made = [("as it is", d.nominal, "tab:orange")]
    same = after is not None and after.problem.data.n == d.data.n
    return [*made, ("repaired" if d.repaired else "closest", after, "tab:blue")] if same else made


def before_and_after(d):
    """Readings and residuals on one held-out stretch."""
    part, t = held_out(d), d.data.time
    names = d.data.names
    figure, axes = plt.subplots(2, len(names), figsize=(10, 5), sharex=True, squeeze=False)
    for c, name in enumerate(names):
        top, low = axes[:, c]
        top.plot(t[part], d.data.readings[part, c], "k.", ms=2.5, label="measured")
        for label, fit, colour in fits_of(d):
            top.plot(t[part], fit.simulated[part, c], color=colour, lw=1.1, label=label)
            left = d.data.readings[part, c] - fit.simulated[part, c]
            low.plot(t[part], left, color=colour, lw=1.0)
        low.axhspan(-2 * d.data.floor[c], 2 * d.data.floor[c], color="0.6", alpha=0.6)
        top.set_title(name)
        low.set_xlabel("time / s")
    axes[0, 0].set_ylabel("reading, SI")
    axes[1, 0].set_ylabel("residual (grey: noise), SI")
    axes[0, 0].legend(fontsize=8)
    figure.tight_layout()


if found.nominal is not None:
    before_and_after(found)

# %% [markdown]
# ### Where in the recording
#
# The misfit, sorted by the variables of the ports: times, bands, strokes and speeds in which the
# model fails, the most concentrated first.

# %%
if found.nominal is not None:
    marked, also = places_of(found)
    stretches = where(found.nominal, found.scene.past if found.scene else None, tuple(marked))
    for r in stretches[:5]:
        say(f"- {words(r)}")


# %%
def misfit_by_stroke(d, place):
    """Root mean square of what is left over the noise, by the argument of the law at `place`."""
    argument = d.scene.past[place].argument
    figure, ax = plt.subplots(figsize=(7, 3.2))
    for label, fit, colour in fits_of(d):
        scored = d.data.mask("train") | d.data.mask("test")
        square = np.mean(((d.data.readings - fit.simulated) / d.data.floor) ** 2, axis=1)
        edges = np.quantile(argument[scored], np.linspace(0, 1, 21))
        bins = np.clip(np.searchsorted(edges, argument[scored]) - 1, 0, 19)
        mean = [np.sqrt(square[scored][bins == b].mean()) for b in range(20)]
        ax.step(0.5 * (edges[1:] + edges[:-1]), mean, where="mid", color=colour, label=label)
    ax.axhline(1.0, color="0.4", ls="--")
    ax.set(
        yscale="log", ylabel="left, times the noise", xlabel=f"argument of the law at {place}, SI"
    )
    ax.legend()
    figure.tight_layout()


place = next(iter(marked), "") if found.nominal is not None else ""
same_grid = found.scene is not None and found.scene.data.n == found.data.n
if same_grid and place in found.scene.past:
    misfit_by_stroke(found, place)

# %% [markdown]
# ### Where in the model
#
# The deeper the orange, the more plausible is the element as the place; the ring marks the answer.

# %%
if found.nominal is not None:
    display(SVG(svg(graph, marked=marked, also=also, shades=confidence_of(found))))

# %% [markdown]
# ### The law that was found

# %%
for finding in verdict(found)["findings"]:
    for e in finding["parameters"]:
        low, high = e["ci95"]
        print(f"{e['name']} = {e['value']:.4g} {e['unit']}, 95 %: {low:.4g} to {high:.4g}")

# %% [markdown]
# ### The next experiment
#
# If somebody doubted the name: what should be recorded to separate the answer from its closest
# rival? Candidate inputs and further sensors are simulated with both fitted models;
# the separation to expect is in standard errors.

# %%
best = found_of(found)[:1]
rivals = [t for t in found.trials if best and t.effect not in ("unknown", best[0].effect)][:1]
if rivals:
    named = next(t for t in found.trials if t.label == best[0].label)
    ask = next_experiments([named.fit, rivals[0].fit], [named.label, rivals[0].label], count=3)
    for e in ask:
        say(f"- {e.sentence}")
say(*(f"advice: {a}" for a in found.advice))

# %% [markdown]
# ## The seal is opened


# %%
def outcome(d):
    """Compare the answer with what was hidden, in one word and the places."""
    v = verdict(d)
    hidden = None if EFFECT is None else MENU[EFFECT][0]
    if hidden is None:
        return "right" if v["verdict"] in ("explained", "parameters_only") else "false alarm"
    if not v["findings"]:
        return "missed"
    first = v["findings"][0]
    places = {first["location"]["element"], *first["location"]["indistinguishable_from"]}
    if first["effect"] == "unknown":
        return "abstained, place right" if PLACE in places else "abstained"
    if hidden == "?":
        return "named; judge yourself"
    if first["effect"] == hidden:
        return "right" if PLACE in places else "right name, wrong place"
    return "look-alike named" if PLACE in places else "wrong"


if RECORDING is None:
    print(f"hidden: {EFFECT} at {PLACE}" if EFFECT else "hidden: nothing")
    print(f"found:  {[t.label for t in found_of(found)] or found.kind}")
    print(outcome(found))

# %% [markdown]
# And the law itself, where a spring or a damper is concerned: what you wrote, and what was found
# from the outside, by two sensors that never saw the force. A constant preload is taken off: it
# only shifts the zero of the sensors. (Dry friction has no single value at rest: there the dots are
# not its law.)


# %%
def laws(d):
    """Return argument, hidden and found force (N) at the place you chose."""
    past = scene(fits_of(d)[-1][1]).past[PLACE]
    if PLACE.startswith("k"):
        x, v, unit = past.argument, past.rate, "m"
        straight = TRUE[PLACE] * x
    else:
        x, v, unit = past.moved, past.argument, "m/s"
        straight = TRUE[PLACE] * v
    times = d.recording.time[: x.size]
    law = MENU[EFFECT][2] if EFFECT else lambda a, x, v, t: 0.0
    hidden = [law(STRENGTH, *each) for each in zip(x, v, times, strict=True)]
    whole = straight + np.array(hidden)
    return past.argument, whole, past.output - np.mean(past.output - whole), unit


by_law = RECORDING is None and PLACE[0] in "kd" and len(fits_of(found)) > 1
if by_law:
    argument, hidden, seen, unit = laws(found)
    figure, ax = plt.subplots(figsize=(7, 3.6))
    order = np.argsort(argument)
    ax.plot(argument[order], hidden[order], "k.", ms=4, label="hidden")
    ax.plot(argument[order], seen[order], color="tab:blue", lw=1.2, label="found")
    ax.set(xlabel=f"{PLACE} / {unit}", ylabel="force / N")
    ax.legend()
    figure.tight_layout()
    off = np.linalg.norm(seen - hidden) / np.linalg.norm(hidden)
    print(f"found and hidden force differ by {100 * off:.2g} %")

# %% [markdown]
# With the settings above the answer is right, at the right one of the two springs, and what is
# left is noise:

# %%
untouched = (EFFECT, PLACE, STRENGTH, NOISE, SEED, RECORDING) == (
    "stiffening", "k_2", 1.0, 1e-5, 1, None,
)  # fmt: skip
if untouched:
    assert outcome(found) == "right"
    assert len(found.findings) == 1
    assert found.nominal.chi2("test") > 100
    assert found.repaired.chi2("test") < 1.3
    worst = max(abs(found.repaired.values[n] / v - 1) for n, v in TRUE.items() if n != "k_2")
    print(f"all other constants are within {100 * worst:.2g} % of the machine's")
    assert worst < 0.05
    assert next(iter(marked)) == "k_2"
    assert off < 0.01

# %% [markdown]
# ### The control
#
# The same machine with nothing hidden, measured by the same sensors. Its constants still differ
# from those of the model; that is not missing physics.

# %%
if RECORDING is None:
    control = diagnose(linear(), measured(None), options=DiagnosisOptions(jobs=1))
    say(sentence(control))
    if untouched:
        assert control.kind in ("explained", "parameters_only")

# %% [markdown]
# Now hide something else. Good questions: how weak may it be? Does `d_1` or `d_3` rub? What does
# it say to *nothing*, or to a law of your own that no catalogue has? A right answer there is
# "unknown", with the right place. A law that looks like one of the catalogue within the noise
# will be called by that name: nothing in the recording could tell.
