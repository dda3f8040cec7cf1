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
# # From a model to a repaired fit
#
# A linear piezo stack is declared, drawn, derived and fitted. It does not explain the recording.
# The diagnosis says what is missing and where, inserts it and shows the fit on held-out samples.
#
# The recording is the public `piezo-actuator-sine` if `BONDSIGHT_RECORDINGS` names a folder that
# holds it; otherwise a virtual stack conceals hysteresis.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import HTML, Math, display

from actuators import stack_bond_graph
from actuators.models.plants import plant_model
from bondgraph import simulate
from bondgraph.drawing.svg import svg
from bondsight import equations
from bondsight.cli.demonstration import Wish, conceal
from identification.datasets import available, load
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.report.changed import changes
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import normalised_error, sentence, verdict

# %config InlineBackend.figure_formats = ['svg']
plt.rcParams.update({"figure.figsize": (6.0, 2.6), "font.size": 8, "svg.hashsalt": "bondsight"})

SEED, PLACE = 3, "k"  # of the virtual stack
real = available("piezo-actuator-sine")
print("recording: " + ("piezo-actuator-sine" if real else "a virtual stack (no recordings here)"))

# %% [markdown]
# ## Declare and draw

# %%
graph = stack_bond_graph() if real else plant_model("stack")
assert graph.check() == ()
graph

# %% [markdown]
# ## Equations

# %%
model = equations(graph)
assert set(model.states) == {"q_C_nl" if real else "q_C_a", "q_k", "p_m"}
model

# %% [markdown]
# ## Simulate
#
# A step of 1 V: the stack rings, then rests. The step is small; the model is linear.

# %%
source, span = ("V_in", 4e-3) if real else ("V", 0.04)  # s
time = np.linspace(0.0, span, 4000)
step = simulate(
    graph, time, {source: np.where(time > span / 20, 1.0, 0.0)}, x0="rest", hold="linear"
)
plt.plot(1e3 * time, 1e9 * step["x"])
plt.xlabel("time / ms")
plt.ylabel("x / nm")
plt.show()
assert step["x"][-1] > 0

# %% [markdown]
# ## The recording

# %%
split = None
if real:
    recording, split = load("piezo-actuator-sine")
    recording = recording.select({"V_in": "V", "x": "x"})
else:
    with tempfile.TemporaryDirectory() as folder:
        recording = conceal(SEED, Wish("stack", "hysteresis"), Path(folder) / "stack.csv").recording
fig, (top, bottom) = plt.subplots(2, 1, sharex=True)
top.plot(recording.time, recording[source], lw=0.6)
top.set_ylabel(f"{source} / V")
bottom.plot(recording.time, 1e6 * recording["x"], lw=0.6)
bottom.set_ylabel("x / µm")
bottom.set_xlabel("time / s")
plt.show()

# %% [markdown]
# ## Diagnose
#
# One call: noise floor, nominal fit, every effect at every port, decision, repair.

# %%
d = diagnose(graph, recording, split, options=DiagnosisOptions(keep=3, more=2, effects=1))
print(sentence(d))
v = verdict(d)
assert v["verdict"] == "missing_physics"
(finding,) = v["findings"]
place = finding["location"]
assert finding["effect"] == "hysteresis"
assert ("C_nl" if real else PLACE) in (place["element"], *place["indistinguishable_from"])

# %% [markdown]
# The residual of the nominal fit on held-out samples, beside the noise floor. No parameters of the
# linear model remove it.

# %%
x = d.data.names.index("x")
held = d.data.mask("test")
floor = d.data.floor[x]
before, after = np.full((2, held.size), np.nan)  # no lines between held-out stretches
before[held] = d.nominal.residuals("test")[:, x]
after[held] = d.repaired.residuals("test")[:, x]
plt.plot(d.data.time, 1e9 * before, lw=0.6, label="linear model")
plt.plot(d.data.time, 1e9 * after, lw=0.6, label="with hysteresis")
plt.axhspan(-2e9 * floor, 2e9 * floor, color="0.8", label="noise floor, ±2σ")
plt.xlabel("time / s")
plt.ylabel("residual of x / nm")
plt.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3)
plt.show()

# %% [markdown]
# ## The loop that was found
#
# What the law adds to its linear part, over its argument, in the repaired model.

# %%
fitted = d.repaired.problem.compiled
values = {n: d.repaired.values[n] for n in fitted.parameter_names}
run = simulate(
    fitted, d.data.time, d.data.commands, values, accuracy=1e-3, x0="rest", hold="linear"
)
s, w = run.laws[place["element"]]
plt.plot(np.where(held, s, np.nan), np.where(held, w, np.nan), lw=0.5)
plt.xlabel(f"argument of {place['element']} (SI)")
plt.ylabel("deviation (SI)")
plt.show()

# %% [markdown]
# ## Where it sits, and the equation that changed

# %%
same = place["indistinguishable_from"]
HTML(svg(graph, marked={place["element"]: "hysteresis"}, also=same))

# %%
changed, _ = changes(graph, d.decision.chosen.insertion.graph)
for c in changed:
    display(Math(rf"\text{{before:}}\quad {c.before}"))
    display(Math(rf"\text{{after:}}\quad {c.after}"))
assert changed

# %% [markdown]
# ## The repaired fit on held-out samples

# %%
old, new = normalised_error(d.nominal)["x"], normalised_error(d.repaired)["x"]
print(f"held-out error of x: {100 * old:.3g} % -> {100 * new:.3g} %")
assert new < 0.3 * old
if real:
    assert old > 0.05
    assert new < 0.015
