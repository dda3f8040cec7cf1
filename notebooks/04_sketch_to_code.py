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
# # From a sketch to equations, C and an FMU
#
# A servo axis on a sheet of paper: a DC motor, a gearbox that is not quite stiff, an arm.
#
# ```text
#         R_a   L_a                          k, d
#   V o---www---mmm---( K )===[ J_m ]===[ 1:N ]===/\/\/===[ J_l ]
#                               |b_m                        |b_l
# ```
#
# Written down as a bond graph, it gives the causality, the equations, a transfer function, a
# simulation and code for five other tools; every answer is compared with another way to get it. The
# gearbox then gets hysteresis, and the code is written again, with its memory.
#
# The numbers are made up, of the size of a robot joint with a strain wave gear. Nothing is
# measured.

# %%
import importlib.util
import runpy
import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import HTML, display

from bondgraph import (
    GY,
    TF,
    BondGraph,
    C,
    De,
    Df,
    Dq,
    I,
    One,
    Port,
    R,
    Se,
    UnusableInput,
    Zero,
    assign_causality,
    simulate,
    use,
)
from bondgraph.drawing.svg import svg
from bondgraph.equations.codegen import program
from bondgraph.export.c_code import c_code
from bondgraph.export.control import to_control
from bondgraph.export.fmu import fmu2_cosimulation, fmu3_model_exchange
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.export.latex_document import document
from bondgraph.export.modelica import modelica
from bondgraph.export.numpy_module import numpy_module
from bondgraph.graph.composing.components import COMPONENTS
from bondgraph.graph.composing.simplification import merge_junctions
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondgraph.support.native import compiler
from bondsight import equations

# %config InlineBackend.figure_formats = ['png']
plt.rcParams.update(
    {
        "figure.figsize": (8.0, 2.9),
        "figure.dpi": 90,
        "figure.constrained_layout.use": True,
        "font.size": 8,
        "axes.grid": True,
        "grid.alpha": 0.3,
    }
)
GCC = compiler()
HAS_FMPY, HAS_CONTROL, HAS_PYMOCA = (
    importlib.util.find_spec(name) is not None for name in ("fmpy", "control", "pymoca")
)


def worst(found, expected):
    """Largest error relative to the range of what is expected."""
    return float(np.abs(found - expected).max() / np.ptp(expected))


# %% [markdown]
# ## Declare
#
# Whatever shares a current, a speed or a twist sits at one 1-junction; the torque of the shaft is
# the 0-junction. `GY` is the motor (torque from current), `TF` the gear (torque from torque). `De`,
# `Df` and `Dq` are sensors for effort, flow and displacement.
#
# The first attempt forgets the motor.

# %%
with BondGraph("forgotten") as forgotten:
    rotor = One("rotor")
    Se("V", unit="V") >> rotor >> I("J_m", 1e-4, unit="kg*m^2")
    rotor >> R("b_m", 1e-4, unit="N*m*s")

(line,) = forgotten.check()
print(line)
assert "electrical" in line
assert "rotation" in line

# %% [markdown]
# The units gave it away. The whole machine:

# %%
with BondGraph("axis") as axis:
    N = axis.parameter("N", 100.0)
    armature, rotor, arm = One("armature"), One("rotor"), One("arm")
    shaft, twist = Zero("shaft"), One("twist")
    Se("V", unit="V") >> armature >> R("R_a", 0.6, unit="ohm")
    armature >> I("L_a", 3e-4, unit="H")
    armature >> GY("K", ratio=0.05, unit="V*s") >> rotor
    rotor >> I("J_m", 1e-4, unit="kg*m^2")
    rotor >> R("b_m", 1e-4, unit="N*m*s")
    rotor >> TF("gear", ratio=1 / N) >> shaft
    shaft >> twist >> C("k", stiffness=1e4, unit="N*m/rad")
    twist >> R("d", 5.0, unit="N*m*s")
    shaft >> arm >> I("J_l", 1.0, unit="kg*m^2")
    arm >> R("b_l", 2.0, unit="N*m*s")
    arm >> Df("w", unit="rad/s")
    shaft >> De("M", unit="N*m")
    twist >> Dq("phi", unit="rad")

assert axis.check() == ()
display(HTML(svg(axis)))

# %% [markdown]
# The stroke at one end of a bond says where its effort is known; the flow is known at the other
# end. Nobody placed the strokes; each has a reason.

# %%
causality = assign_causality(axis)
print(causality)
assert causality.derivative == causality.free_choices == ()

# %% [markdown]
# All storages integrate (no effort needs a derivative), and nothing had to be chosen (no algebraic
# loop).
#
# ## Equations
#
# The strokes put the relations in an order in which each uses only what is known already:

# %%
model = equations(axis)
print(model)
assert model.states == ("p_L_a", "p_J_m", "q_k", "p_J_l")
assert model.is_explicit

# %% [markdown]
# Closed forms follow by substitution. States are flux linkage, momenta and twist:

# %%
model

# %% [markdown]
# ## Transfer function, and the same by hand
#
# By hand one writes four balances with the unknowns current, motor speed, shaft torque and arm
# speed, and eliminates. The difference must be zero, symbol by symbol.

# %%
s = sp.Symbol("s")
of_graph = model.transfer_function("V", "w")

names = ("R_a", "L_a", "K", "J_m", "b_m", "N", "k", "d", "J_l", "b_l")
Ra, La, K, Jm, bm, N, k, d, Jl, bl = (axis.parameters[n].symbol for n in names)
i, omega, w, M, V = sp.symbols("i omega w M V")
balances = [
    (La * s + Ra) * i + K * omega - V,  # mesh of the armature
    (Jm * s + bm) * omega - K * i + M / N,  # rotor
    M - (k / s + d) * (omega / N - w),  # shaft
    (Jl * s + bl) * w - M,  # arm
]
by_hand = sp.cancel(sp.solve(balances, [i, omega, w, M], dict=True)[0][w] / V)
assert sp.cancel(of_graph - by_hand) == 0

steady = sp.factor(of_graph.subs(s, 0))
print("steady gain, rad/s per V:", steady)
assert sp.cancel(steady - K * N / (K**2 * N**2 + Ra * (bm * N**2 + bl))) == 0
for pole in model.eigenvalues():
    print(f"pole {pole:.4g} rad/s")
assert (model.eigenvalues().real < 0).all()

# %% [markdown]
# python-control takes the linear model with its names. Lines: python-control; dots: the balances by
# hand with numbers put in.

# %%
values = {p.symbol: p.value for p in axis.parameters.values()}
omegas = np.logspace(0, 4, 400)
number = sp.lambdify(s, by_hand.subs(values), "numpy")
hand = number(1j * omegas)
if HAS_CONTROL:
    import control

    plant = to_control(program(axis))
    response = control.frequency_response(plant["w", "V"], omegas).complex.ravel()
    print(plant.state_labels, plant.input_labels, plant.output_labels)
    print(f"python-control against the balances: {np.abs(response / hand - 1).max():.0e}")
    assert np.abs(response / hand - 1).max() < 1e-9
else:
    response = hand
    print("python-control is not installed")

fig, (left, right) = plt.subplots(1, 2)
left.loglog(omegas, np.abs(response))
left.loglog(omegas[::20], np.abs(hand[::20]), "k.", ms=4)
left.set(xlabel="rad/s", ylabel="arm speed / voltage, rad/(V s)", title="magnitude")
right.semilogx(omegas, np.degrees(np.unwrap(np.angle(response))))
right.semilogx(omegas[::20], np.degrees(np.unwrap(np.angle(hand)))[::20], "k.", ms=4)
right.set(xlabel="rad/s", ylabel="degrees", title="phase")
plt.show()

# %% [markdown]
# The peak near 140 rad/s is the arm swinging against the rotor through the shaft.
#
# ## Simulate
#
# The linear part is integrated exactly, so no step has to be chosen, although the poles are two
# decades apart.

# %%
time = np.linspace(0.0, 1.0, 1001)
volt = 6.0 * np.sin(2 * np.pi * 2 * time) + 5.0 * np.sin(2 * np.pi * 7 * time)
linear = simulate(axis, time, {"V": volt}, x0="rest", hold="linear")

fig, axes = plt.subplots(1, 3, figsize=(9.5, 2.6))
for a, (name, scale, label) in zip(
    axes,
    (
        ("w", 1, "arm speed / (rad/s)"),
        ("M", 1, "shaft torque / (N m)"),
        ("phi", 1e3, "twist / mrad"),
    ),
    strict=True,
):
    a.plot(time, scale * linear[name])
    a.set(xlabel="time / s", ylabel=label)
plt.show()

# once settled, both tones must have the gain of the balances by hand
later = np.linspace(0.0, 3.0, 3001)
tones = {2.0: 6.0, 7.0: 5.0}
both = sum(a * np.sin(2 * np.pi * f * later) for f, a in tones.items())
settled, at = (
    simulate(axis, later, {"V": both}, x0="rest", hold="linear")["w"][-1000:],
    later[-1000:],
)
for f, amplitude in tones.items():
    gain = 2j * np.mean(settled * np.exp(-2j * np.pi * f * at)) / amplitude
    expected = number(2j * np.pi * f)
    print(f"{f:g} Hz: simulated gain {abs(gain):.5f}, by hand {abs(expected):.5f} rad/s per V")
    assert abs(gain / expected - 1) < 1e-3

# %% [markdown]
# ## Code
#
# Everything below reads one executable form, `program(axis)`. First a Python module that needs
# NumPy and nothing of this project; its equations stay readable.

# %%
form = program(axis)
source = numpy_module(form)
start = source.index("def evaluate")
print(source[start : source.index("def jacobian")].rstrip())


def run_module(source, time, volt, substeps=1):
    """Run the text as a file of its own."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.py"
        file.write_text(source, encoding="ascii")
        return runpy.run_path(str(file))["simulate"](time, {"V": volt}, substeps=substeps)


printed = run_module(source, time, volt)
print()
for name in form.outputs:
    print(
        f"module against simulation, {name:4s}{worst(printed[name], linear[name]):.0e} of its range"
    )
    assert worst(printed[name], linear[name]) < 1e-4

# %% [markdown]
# C99: no heap, no global state, every index named, and an example program that reads inputs and
# writes outputs. It takes four of its implicit third-order steps a sample here.


# %%
def run_c(form, time, volt, steps):
    """Compile the exported C, feed it the record, return outputs by name."""
    with tempfile.TemporaryDirectory() as folder:
        files = c_code(form)
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="ascii")
        units = [name for name in files if name.endswith(".c")]
        flags = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2"]
        subprocess.run([GCC, *flags, *units, "-o", "run", "-lm"], cwd=folder, check=True)
        rows = "".join(f"{t!r} {v!r}\n" for t, v in zip(time.tolist(), volt.tolist(), strict=True))
        done = subprocess.run(
            [Path(folder) / "run", str(steps)],
            input=rows,
            capture_output=True,
            text=True,
            check=True,
        )
    table = np.array([line.split() for line in done.stdout.splitlines()], float)
    return dict(zip(form.outputs, table[:, 1:].T, strict=True))


files = c_code(form)
for name, text in files.items():
    print(f"{name:16s}{len(text.splitlines()):5d} lines")
print("\n".join(line for line in files["axis.h"].splitlines() if "_STATE" in line))
if GCC:
    compiled = run_c(form, time, volt, 4)
    for name in form.outputs:
        print(
            f"C against simulation, {name:4s}{worst(compiled[name], linear[name]):.0e} of its range"
        )
        assert worst(compiled[name], linear[name]) < 1e-5
else:
    print("no gcc here")

# %% [markdown]
# Functional mock-up units: FMI 2.0 with its own integrator (co-simulation) and FMI 3.0 for the
# importer's (model exchange). FMPy holds the inputs over its steps, so the reference holds them
# too.


# %%
def record(time, volt, stairs=False):
    """Input of FMPy; stairs make every step an event, where its solver starts anew."""
    if stairs:
        volt = np.append(np.repeat(volt[:-1], 2), volt[-1])
        time = np.append(time[0], np.repeat(time[1:], 2))
    rows = np.zeros(time.size, [("time", float), ("V", float)])
    rows["time"], rows["V"] = time, volt
    return rows


def run_fmus(form, time, volt):
    """Outputs of both units by their standard."""
    import fmpy

    options = {
        "start_time": time[0],
        "stop_time": time[-1],
        "output_interval": time[1] - time[0],
        "output": list(form.outputs),
    }
    with tempfile.TemporaryDirectory() as folder:
        two = fmu2_cosimulation(form, Path(folder) / "two.fmu")
        three = fmu3_model_exchange(form, Path(folder) / "three.fmu")
        return {
            "FMI 2.0 co-simulation": fmpy.simulate_fmu(
                str(two), input=record(time, volt), **options
            ),
            "FMI 3.0 model exchange": fmpy.simulate_fmu(
                str(three),
                input=record(time, volt, stairs=True),
                record_events=False,
                relative_tolerance=1e-7,
                **options,
            ),
        }


if GCC and HAS_FMPY:
    held = simulate(axis, time, {"V": volt}, hold="hold", x0="rest")
    for standard, found in run_fmus(form, time, volt).items():
        for name in form.outputs:
            print(f"{standard}, {name:4s}{worst(found[name], held[name]):.0e} of its range")
            assert worst(found[name], held[name]) < 1e-4
else:
    print("gcc or FMPy is not here")

# %% [markdown]
# Modelica, LaTeX and JSON are texts. The Modelica model depends on no library; pymoca, if it is
# here, parses it. The LaTeX file is complete (article and amsmath). JSON reads back to the same
# graph, and is safe to take from strangers: nothing in a file is executed.

# %%
text = modelica(form)
lines = text.splitlines()
print("\n".join([*lines[:14], "  ...", *lines[-22:]]))
assert text.count("der(") == 4
if HAS_PYMOCA:
    import pymoca.parser

    assert "axis" in pymoca.parser.parse(text).classes

# %%
tex = document(form)
lines = tex.splitlines()
closed = next(n for n, line in enumerate(lines) if "Closed form" in line)
print("\n".join([*lines[closed : closed + 5], "..."]))
assert tex.startswith(r"\documentclass")
assert tex.rstrip().endswith(r"\end{document}")

# %%
written = to_json(axis)
again = from_json(written)
print("\n".join([*written.splitlines()[:13], "..."]))
assert to_json(again) == written
assert dict(again.elements) == dict(axis.elements)
assert again.bonds == axis.bonds
assert [str(r) for r in equations(again).rates] == [str(r) for r in model.rates]

# %% [markdown]
# ## Parts
#
# A second machine should not be typed again. A graph that ends in `Port`s can be used in another;
# `COMPONENTS` has a dozen ready. The motor is taken from there, gear and arm are written here.
# Names get the name of the instance in front: `motor_K`. With the names put back, every
# rate must be the one of above.

# %%
print(COMPONENTS)

with BondGraph("gear_and_arm") as gear_and_arm:
    N = gear_and_arm.parameter("N", 100.0)
    shaft, twist, arm = Zero("shaft"), One("twist"), One("arm")
    Port("motor", unit="N*m") >> TF("gear", ratio=1 / N) >> shaft
    shaft >> twist >> C("k", stiffness=1e4, unit="N*m/rad")
    twist >> R("d", 5.0, unit="N*m*s")
    shaft >> arm >> I("J_l", 1.0, unit="kg*m^2")
    arm >> R("b_l", 2.0, unit="N*m*s")

with BondGraph("joint") as joint:
    motor = COMPONENTS.use("dc_motor", "motor", R=0.6, L=3e-4, K=0.05, J=1e-4, b=1e-4)
    load = use(gear_and_arm, "load")
    Port("supply", unit="V") >> motor.terminal
    motor.shaft >> load.motor

with BondGraph("single") as single:
    Se("V", unit="V") >> use(joint, "joint").supply

composed = merge_junctions(single)
renamed = {
    "motor_R": "R_a",
    "motor_L": "L_a",
    "motor_K": "K",
    "motor_J": "J_m",
    "motor_b": "b_m",
    "load_N": "N",
    "load_k": "k",
    "load_d": "d",
    "load_J_l": "J_l",
    "load_b_l": "b_l",
}
put = {
    composed.parameters[f"joint_{a}"].symbol: axis.parameters[b].symbol for a, b in renamed.items()
}
put |= {
    sp.Symbol(f"{letter}_joint_{a}", real=True): sp.Symbol(f"{letter}_{b}", real=True)
    for letter in "pq"
    for a, b in renamed.items()
}
typed, parts = dict(zip(model.states, model.rates, strict=True)), equations(composed)
assert len(composed.parameters) == len(axis.parameters) == len(renamed)
for state, rate in zip(parts.states, parts.rates, strict=True):
    twin = str(sp.Symbol(state, real=True).xreplace(put))
    assert sp.cancel(rate.xreplace(put) - typed[twin]) == 0
assert np.allclose(parts.eigenvalues(), model.eigenvalues(), rtol=1e-9)
print(f"\na joint: {len(single.elements)} elements, {len(composed.elements)} with junctions merged")

# %% [markdown]
# Two joints on one supply with an inner resistance. What must come out is known: moved in common
# they see twice the resistance of the supply, moved against each other none.

# %%
with BondGraph("pair") as pair:
    mains, bus = One("mains"), Zero("bus")
    left, right = use(joint, "left"), use(joint, "right")
    Se("V", unit="V") >> mains >> R("R_s", 0.2, unit="ohm")
    mains >> bus >> left.supply
    bus >> right.supply

assert pair.check() == ()
found = equations(pair).eigenvalues()
expected = np.concatenate([model.eigenvalues(), model.eigenvalues({"R_a": 0.6 + 2 * 0.2})])
assert found.size == 8
assert np.allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-8)
print(np.array2string(np.sort_complex(found), precision=1, suppress_small=True))
display(HTML(svg(merge_junctions(pair))))

# %% [markdown]
# ## A gearbox with hysteresis
#
# The teeth of a strain wave gear rub: torque over twist is a loop. A law takes the place of the
# stiffness, here three springs in parallel of which two slip (a Maxwell resistive capacitor). The
# rest of the graph stays.

# %%
teeth = MaxwellResistiveCapacitor((3e3, 2e3, 5e3), (2.4, 4.0, 500.0))
worn = axis.replace("k", C("k", unit="rad/(N*m)", law=Hysteretic(teeth))).copy("worn")
assert worn.check() == ()
assert teeth.linear_slope == 1e4

loops = simulate(worn, time, {"V": volt}, accuracy=1e-7, x0="rest", hold="linear")
change = worst(loops["phi"], linear["phi"])
print(f"slip changes the twist by {100 * change:.0f} % of its range")
print(f"memory at the end: {', '.join(f'{1e3 * m:.3f}' for m in loops.memory['k'])} mrad")
assert change > 0.05

# %% [markdown]
# The exports carry the memory: it moves once an accepted step and is part of the state. The same
# record, minor loops included, from the module, the compiled C and both units. python-control has
# no place for a memory, and says so.

# %%
form = program(worn)
answers = {"NumPy module": (run_module(numpy_module(form), time, volt, 2), loops)}
if GCC:
    answers["C, 8 steps a sample"] = run_c(form, time, volt, 8), loops
if GCC and HAS_FMPY:
    held = simulate(worn, time, {"V": volt}, hold="hold", accuracy=1e-7, x0="rest")
    for standard, found in run_fmus(form, time, volt).items():
        answers[standard] = found, held

for tool, (found, reference) in answers.items():
    errors = {name: worst(found[name], reference[name]) for name in form.outputs}
    print(f"{tool:24s}" + "".join(f"{name}: {e:.0e}   " for name, e in errors.items()))
    assert max(errors.values()) < 1e-2 * change

end = answers["NumPy module"][0]["memory"]
assert np.allclose(end, loops.memory["k"], atol=1e-3 * np.ptp(loops["phi"]))
try:
    to_control(form)
except UnusableInput as error:
    print(error)

# %%
fig, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4))
left.plot(1e3 * linear["phi"], linear["M"], color="0.7", lw=0.9, label="linear spring")
left.plot(1e3 * loops["phi"], loops["M"], lw=1.0, label="simulation")
if GCC:
    in_c = answers["C, 8 steps a sample"][0]
    left.plot(1e3 * in_c["phi"][::12], in_c["M"][::12], "k.", ms=4, label="exported C")
left.set(xlabel="twist / mrad", ylabel="shaft torque / (N m)")
left.legend(loc="upper left")
for tool, (found, reference) in answers.items():
    error = np.abs(found["phi"] - reference["phi"]) / np.ptp(reference["phi"])
    right.semilogy(time[1:], error[1:] + 1e-16, lw=0.8, label=tool)
right.axhline(change, color="0.5", ls="--", lw=0.9, label="without hysteresis")
right.set(xlabel="time / s", ylabel="error of the twist / range", ylim=(1e-12, 3))
right.legend(loc="lower right", fontsize=7)
plt.show()

# %% [markdown]
# ## What was not typed
#
# No equation, no derivative, no sign. What the graph knows it shows; what it cannot know is whether
# this gearbox slips like that. Notebooks 01 and 02 ask such questions of a recording.
