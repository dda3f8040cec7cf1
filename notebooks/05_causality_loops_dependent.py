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
# # Causality, loops and storages that depend on each other
#
# A graph says what is connected. Which variable follows from which is causality, and three things
# can happen: the strokes fit and the equations are explicit; they do not fit; or they fit at a
# price, a storage that depends on another or an algebraic loop. Each case here is small, and each
# answer is compared with a derivation that does not use the graph. Then the checks that no equation
# shows: energy, passivity, redundancy, observability.
#
# All numbers are made up; nothing is measured.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import HTML, display
from scipy.integrate import solve_ivp

from bondgraph import (
    GY,
    MTF,
    TF,
    AlgebraicLoop,
    BondGraph,
    C,
    CausalConflict,
    CField,
    De,
    Df,
    I,
    MSe,
    One,
    Parameter,
    R,
    Se,
    Sf,
    Trajectory,
    Zero,
    alternatives,
    assign_causality,
    displacement,
    effort,
    port_variables,
    simulate,
)
from bondgraph.analysis.redundancy import redundancy
from bondgraph.analysis.sensor_advice import splitting_sensors
from bondgraph.analysis.structural import observability
from bondgraph.drawing.svg import svg
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.energy.port_hamiltonian import port_hamiltonian
from bondgraph.laws import QuadraticDrag
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


def parameters(graph):
    """Symbols of the parameters by name."""
    return {name: p.symbol for name, p in graph.parameters.items()}


def equal(a, b):
    """Whether two expressions are the same function."""
    return sp.simplify(a - b) == 0


# %% [markdown]
# ## Strokes and their reasons
#
# A resistor has no preference. Behind a voltage source it answers with a current, behind a current
# source with a voltage; the graph decides, not the element.

# %%
asked = {}
for source in (Se, Sf):
    with BondGraph(f"{source.kind}_R") as pair:
        source("source") >> R("R_1", 10.0)
    strokes = assign_causality(pair)
    print(strokes)
    asked[source.kind] = strokes.strokes[pair.bonds[0]].effort_to
assert asked == {"Se": "R_1", "Sf": "source"}

# %% [markdown]
# ## A conflict
#
# Two pumps in a row in one rigid pipe: each imposes the flow. No stroke can serve both, and the
# message says which bonds disagree and why.

# %%
with BondGraph("pumps") as pumps:
    pipe = One("pipe")
    Sf("Q_1", unit="m^3/s") >> pipe >> R("R_p", 1e9, unit="Pa*s/m^3")
    Sf("Q_2", unit="m^3/s") >> pipe

try:
    assign_causality(pumps)
except CausalConflict as conflict:
    message = str(conflict)
print(message)
assert "Q_1>pipe" in message
assert "Q_2>pipe" in message

# %% [markdown]
# What was forgotten is the oil between the pumps, which gives way and stores the difference:

# %%
(bond,) = pumps.bonds_of("Q_2")
mended = pumps.with_inserted(bond, Zero("oil"))
mended = mended.with_branch("oil", [C("C_oil", 1e-13, unit="m^3/Pa")])
print(assign_causality(mended))
(rate,) = equations(mended).rates
assert equal(rate, sp.Symbol("Q_2", real=True) - sp.Symbol("Q_1", real=True))

# %% [markdown]
# ## Storages that depend on each other
#
# Three flywheels on one shaft have one speed, so only one momentum is free: one wheel integrates,
# two are in *derivative* causality. Which one is a choice. All three choices are listed; the
# equations differ, the machine does not.

# %%
with BondGraph("wheels") as wheels:
    shaft = One("shaft")
    Se("tau", unit="N*m") >> shaft
    for n, inertia in enumerate((0.1, 0.2, 0.3), start=1):
        shaft >> I(f"J_{n}", inertia, unit="kg*m^2")
    shaft >> R("b", 0.05, unit="N*m*s")
    shaft >> Df("w", unit="rad/s")

p = parameters(wheels)
s = sp.Symbol("s")
by_hand = 1 / ((p["J_1"] + p["J_2"] + p["J_3"]) * s + p["b"])
choices = sorted(alternatives(wheels), key=lambda choice: sorted(choice.derivative))
for choice in choices:
    model = equations(wheels, choice)
    (rate,) = model.rates
    names = ", ".join(sorted(choice.derivative))
    print(f"dependent: {names:10s} d{model.states[0]}/dt = {sp.simplify(rate)}")
    assert equal(model.transfer_function("tau", "w"), by_hand)
assert len(choices) == 3

# %% [markdown]
# Through a gear the dependent inertia counts with the square of the ratio. The dependent momentum
# is no state, but it is known.

# %%
with BondGraph("geared") as geared:
    fast, slow = One("fast"), One("slow")
    Se("tau", unit="N*m") >> fast >> I("J_1", 1e-4, unit="kg*m^2")
    fast >> TF("n", ratio=0.1) >> slow >> I("J_2", 0.02, unit="kg*m^2")
    slow >> R("b", 0.1, unit="N*m*s")
    slow >> Df("w", unit="rad/s")

assert assign_causality(geared).derivative == ("J_2",)
model, p = equations(geared), parameters(geared)
print("dependent:", model.dependent)
by_hand = p["n"] / ((p["J_1"] + p["n"] ** 2 * p["J_2"]) * s + p["n"] ** 2 * p["b"])
assert equal(model.transfer_function("tau", "w"), by_hand)
assert equal(model.dependent["p_J_2"], p["n"] * p["J_2"] / p["J_1"] * sp.Symbol("p_J_1", real=True))

# %% [markdown]
# A storage can also depend on a source. A capacitance across a voltage has no state; its current
# needs the rate of the input, which becomes an input of its own, `d_V`.

# %%
with BondGraph("blocked") as blocked:
    loop = One("loop")
    Se("V", unit="V") >> loop >> C("C_p", 2e-6, unit="F")
    loop >> Df("i", unit="A")

model = equations(blocked)
print("states:", model.states, " input rates:", model.input_rates, " i =", model.outputs[0])
assert (model.states, model.input_rates) == ((), ("d_V",))
time = np.linspace(0.0, 0.02, 2001)
current = simulate(blocked, time, {"V": 100.0 * np.sin(400.0 * time)}, x0="rest", hold="linear")[
    "i"
]
exact = 2e-6 * 100.0 * 400.0 * np.cos(400.0 * time)
print(
    f"2 uF at 100 V, 400 rad/s: {1e3 * current[5:].max():.2f} mA, exact {1e3 * exact.max():.2f} mA"
)
assert np.abs(current - exact)[1:].max() < 3e-3 * exact.max()

# %% [markdown]
# ## A mass that depends on the angle
#
# A scotch yoke: the pin of a crank moves a rod to and fro, `x = r cos(theta)`. The lever is a
# transformer whose ratio follows the angle, the mass of the rod depends on the crank, and the crank
# is out of balance. The dashed arrow in the drawing is the signal that modulates the lever; the
# coloured stroke marks the derivative causality of the rod.

# %%
with BondGraph("yoke") as yoke:
    r, W = yoke.parameter("r", 0.1, "m"), yoke.parameter("W", 0.3, "N*m")
    (theta,) = port_variables("q", 1)
    crank, rod = One("crank"), One("rod")
    Se("tau", unit="N*m") >> crank >> I("J_c", 0.01, unit="kg*m^2")
    crank >> R("b", 0.02, unit="N*m*s")
    crank >> CField("angle", energy=W * (1 - sp.cos(theta)), ports=1, units=("N*m",))
    lever = MTF("lever", ratio=-r * sp.sin(displacement("angle1")), unit="m")
    crank >> lever >> rod >> I("m", 2.0, unit="kg")
    rod >> R("c", 5.0, unit="N*s/m")
    crank >> Df("w", unit="rad/s")

assert yoke.check() == ()
assert assign_causality(yoke).derivative == ("m",)
display(HTML(svg(yoke)))

# %% [markdown]
# The same by Lagrange, from kinetic and potential energy: the inertia is `J_c + m r^2
# sin(theta)^2`, and its change with the angle costs a torque that is quadratic in the speed.

# %%
p = parameters(yoke)
t = sp.Symbol("t")
angle = sp.Function("theta")(t)
speed = angle.diff(t)
kinetic = p["J_c"] * speed**2 / 2 + p["m"] * (p["r"] * sp.cos(angle)).diff(t) ** 2 / 2
potential = p["W"] * (1 - sp.cos(angle))
damping = p["b"] * speed + p["c"] * (p["r"] * sp.sin(angle)) ** 2 * speed
tau = sp.Symbol("tau", real=True)
lagrange = kinetic.diff(speed).diff(t) - kinetic.diff(angle) + potential.diff(angle) + damping - tau
(acceleration,) = sp.solve(lagrange, angle.diff(t, 2))

model = equations(yoke)
q, w = sp.Symbol("q_angle1", real=True), sp.Symbol("p_J_c", real=True) / p["J_c"]
by_hand = acceleration.subs(speed, w).subs(angle, q)
rates = dict(zip(model.states, model.rates, strict=True))
assert equal(rates["p_J_c"] / p["J_c"], by_hand)
assert equal(rates["q_angle1"], w)
print("states:", model.states, " dependent:", model.dependent)

# %% [markdown]
# In numbers: `simulate` against an explicit Runge-Kutta integration of Lagrange's equation.

# %%
values = {p.symbol: p.value for p in yoke.parameters.values()}
wdot = sp.lambdify((q, sp.Symbol("p_J_c", real=True), tau), by_hand.subs(values))
time = np.linspace(0.0, 4.0, 2001)
torque = np.where(time < 3.0, 0.8, 0.8 - 2.0 * (time - 3.0))
start = np.array([0.0, 0.1])  # momentum of the crank, angle
run = simulate(
    yoke, time, {"tau": torque}, x0=start, accuracy=1e-6, observed=observables(yoke), hold="linear"
)


def rate_of(instant, state):
    at = np.interp(instant, time, torque)
    return [0.01 * wdot(state[1], state[0], at), state[0] / 0.01]


reference = solve_ivp(rate_of, (0.0, 4.0), start, t_eval=time, rtol=1e-9, atol=1e-12, max_step=0.01)
error = np.abs(run["w"] - reference.y[0] / 0.01).max() / np.ptp(run["w"])
print(f"largest error of the speed: {error:.0e} of its range")
assert error < 1e-5

fig, (left, right) = plt.subplots(1, 2)
left.plot(time, run["w"], label="bond graph")
left.plot(time[::50], reference.y[0][::50] / 0.01, "k.", ms=4, label="Lagrange, Runge-Kutta")
left.set(xlabel="time / s", ylabel="speed / (rad/s)")
left.legend()
turned = run["q_angle1"]
inertia = 0.01 + 2.0 * 0.1**2 * np.sin(turned) ** 2
right.plot(turned / (2 * np.pi), inertia)
right.set(xlabel="turns", ylabel="inertia / (kg m²)", xlim=(0, 2), ylim=(0, 0.035))
plt.show()

# %% [markdown]
# ## Linear loops
#
# In a bridge no storage and no source decides which resistor gives a current and which a voltage.
# Two are chosen freely (coloured in the drawing), which makes an algebraic loop. Linear loops are
# solved exactly; against nodal analysis by hand:

# %%
with BondGraph("bridge") as bridge:
    top, left, right = Zero("top"), Zero("left"), Zero("right")
    a, b, middle = One("a"), One("b"), One("middle")
    Se("V", unit="V") >> top
    top >> a >> R("R_1", 100.0, unit="ohm")
    a >> left >> R("R_2", 200.0, unit="ohm")
    top >> b >> R("R_3", 100.0, unit="ohm")
    b >> right >> R("R_4", 210.0, unit="ohm")
    left >> middle >> right
    middle >> R("R_g", 50.0, unit="ohm")
    middle >> Df("i", unit="A")

display(HTML(svg(bridge)))
model, p = equations(bridge), parameters(bridge)
print("chosen freely:", ", ".join(assign_causality(bridge).free_choices))
print("solved loop of", ", ".join(model.loops[0]))
assert model.is_explicit

u_l, u_r, V = sp.Symbol("u_l"), sp.Symbol("u_r"), sp.Symbol("V", real=True)
nodes = [
    (V - u_l) / p["R_1"] - u_l / p["R_2"] - (u_l - u_r) / p["R_g"],
    (V - u_r) / p["R_3"] - u_r / p["R_4"] + (u_l - u_r) / p["R_g"],
]
solved = sp.solve(nodes, [u_l, u_r])
current = sp.factor(model.outputs[0])
print("i =", current)
assert equal(current, (solved[u_l] - solved[u_r]) / p["R_g"])
assert equal(current.subs(p["R_4"], p["R_2"] * p["R_3"] / p["R_1"]), sp.S.Zero)  # balanced

# %% [markdown]
# ## Nonlinear loops
#
# An accumulator is filled through a pipe and an orifice: both would like the flow, and the orifice
# drops `k Q |Q|`. No pivot solves that, so the flow stays an unknown `z` with a residual, and the
# integrator solves it with every step. Here pencil and paper can solve it, too: a quadratic
# equation.

# %%
with BondGraph("filling") as filling:
    line = One("line")
    Se("p_s", unit="Pa") >> line >> R("R_p", 1e9, unit="Pa*s/m^3")
    line >> R("orifice", 0.0, unit="Pa*s/m^3", law=QuadraticDrag())
    line >> C("C_a", 1e-12, unit="m^3/Pa")
    line >> Df("Q", unit="m^3/s")
filling = filling.with_parameters([Parameter("c_2_orifice", 1e12, "Pa*s^2/m^6")])

model = equations(filling)
(unknown,) = model.algebraic
print(f"unknown {unknown.name}: {unknown.reason}")
print("0 =", model.residuals[0])
assert not model.is_explicit

time = np.linspace(0.0, 0.02, 401)
supply = 1e7 * (1 - np.exp(-time / 1e-3)) * (1 + 0.4 * np.sin(2 * np.pi * 200 * time))
run = simulate(filling, time, {"p_s": supply}, x0=np.zeros(1), hold="linear")


def flow(drop, resistance=1e9, k=1e12):
    """Solution of ``R Q + k Q |Q| = drop``."""
    return np.sign(drop) * (np.sqrt(resistance**2 + 4 * k * np.abs(drop)) - resistance) / (2 * k)


explicit = solve_ivp(
    lambda instant, volume: flow(np.interp(instant, time, supply) - volume / 1e-12),
    (0.0, 0.02),
    [0.0],
    t_eval=time,
    rtol=1e-9,
    atol=1e-14,
    max_step=time[1],
)
by_hand = flow(supply - explicit.y[0] / 1e-12)
error = np.abs(run["Q"] - by_hand).max() / np.ptp(by_hand)
print(f"largest error of the flow: {error:.0e} of its range")
assert error < 1e-4

fig, axis = plt.subplots(figsize=(5.0, 2.6))
axis.plot(1e3 * time, 6e4 * run["Q"], label="residual solved with every step")
axis.plot(1e3 * time[::8], 6e4 * by_hand[::8], "k.", ms=4, label="quadratic formula")
axis.set(xlabel="time / ms", ylabel="flow / (l/min)")
axis.legend()
plt.show()

# %% [markdown]
# ## A loop through a signal
#
# An inverting amplifier. Its loop does not run through bonds only: the output is a source,
# commanded by the voltage at the input node. The loop is found and solved all the same, for any
# gain `A`.

# %%
with BondGraph("amplifier") as amplifier:
    A = amplifier.parameter("A", 1e5)
    a, node, b, out = One("a"), Zero("node"), One("b"), Zero("out")
    Se("u", unit="V") >> a >> R("R_1", 1e3, unit="ohm")
    a >> node >> b >> R("R_2", 1e4, unit="ohm")
    b >> out
    MSe("op_amp", unit="V", value=-A * effort("node")) >> out
    out >> De("y", unit="V")

display(HTML(svg(amplifier)))
model, p = equations(amplifier), parameters(amplifier)
gain = sp.factor(model.transfer_function("u", "y"))
print("gain:", gain)
print("loop:", ", ".join(model.loops[0]))
by_hand = -p["A"] * p["R_2"] / (p["R_1"] + p["R_2"] + p["A"] * p["R_1"])
assert equal(gain, by_hand)
assert equal(sp.limit(gain, p["A"], sp.oo), -p["R_2"] / p["R_1"])

# %% [markdown]
# A loop can also say nothing at all. An amplifier of gain one that feeds its own input leaves the
# voltage open; that is an error, not an equation with a zero below the line.

# %%
with BondGraph("mirror") as mirror:
    node = Zero("node")
    MSe("copy", unit="V", value=effort("node")) >> One("wire") >> node
    node >> R("R_1", 1.0, unit="ohm")

try:
    equations(mirror)
except AlgebraicLoop as error:
    message = str(error)
print(message)
assert "singular" in message

# %% [markdown]
# ## The ledger closes
#
# Stored energies follow from the state, work from integrated powers. What is left over when one is
# subtracted from the other is the error of model, integrator and quadrature together. For the yoke:

# %%
time = np.linspace(0.0, 4.0, 2001)
torque = np.where(time < 3.0, 0.8, 0.8 - 2.0 * (time - 3.0))
run = simulate(
    yoke, time, {"tau": torque}, x0=start, accuracy=1e-6, observed=observables(yoke), hold="linear"
)
account = ledger(yoke, run)
print(account)
assert account.closes
assert account.relative_residual < 1e-5

wrong = {**run.outputs, "p_J_c": 1.02 * run["p_J_c"]}
false = ledger(yoke, Trajectory("yoke", time, wrong))
print(f"\nwith the momentum 2 % too large: residual {false.relative_residual:.0e}")
assert not false.closes

fig, (left, right) = plt.subplots(1, 2)
left.stackplot(time, account.lost, account.stored, labels=("lost", "stored"), alpha=0.6)
left.plot(time, account.supplied, "k", lw=0.9, label="supplied")
left.set(xlabel="time / s", ylabel="energy / J")
left.legend(loc="upper left")
for book, label in ((false, "2 % too large"), (account, "as simulated")):
    right.semilogy(time[1:], np.abs(book.residual[1:]) / book.throughput, lw=0.8, label=label)
right.set(xlabel="time / s", ylabel="residual / throughput", ylim=(1e-15, 10))
right.legend(loc="upper left")
plt.show()

# %% [markdown]
# ## Port-Hamiltonian form
#
# `dx/dt = (J - R) dH/dx + G u` with a skew J and a positive R: the form in which losses and
# passivity can be read off. The energy of the dependent rod is part of H. `differences` compares
# everything with the equations above.

# %%
form = port_hamiltonian(yoke)
assert set(form.differences()) == {0}
assert form.J + form.J.T == sp.zeros(2, 2)
print(form.passivity)
assert form.passivity.passive
form

# %% [markdown]
# The note on `angle` is caution: a curved energy is not judged. The amplifier, on the other hand,
# must not pass as passive, and the culprit is named:

# %%
print(port_hamiltonian(amplifier).passivity)
assert not port_hamiltonian(amplifier).passivity.passive

# %% [markdown]
# ## An error in print
#
# The manual of MTT, the Model Transformation Tools, gives a capacitor with a moving plate the
# voltage `q x / (c0 x0)` and the force `c0 x0 q^2 / (2 x^2)`. Each looks right alone. Together they
# have no energy: the cross derivatives differ, and `check` says so before anything is simulated.

# %%
charge, gap = port_variables("q", 2)


def plate(force):
    """Capacitor with a moving plate, its voltage as published, its force as given."""
    with BondGraph("plate") as g:
        c0, x0 = g.parameter("c0", 1e-9, "F"), g.parameter("x0", 1e-3, "m")
        laws = (charge * gap / (c0 * x0), force(c0, x0))
        device = CField("plates", law=laws, units=("V", "N"))
        loop, body = One("loop"), One("body")
        Se("V", unit="V") >> loop >> R("R_s", 1e6, unit="ohm")
        loop >> device
        body >> device
        body >> I("m", 1e-4, unit="kg")
        body >> C("k", stiffness=10.0, unit="N/m")
    return g


published = plate(lambda c0, x0: c0 * x0 * charge**2 / (2 * gap**2))
right_one = plate(lambda c0, x0: charge**2 / (2 * c0 * x0))
(line,) = published.check()
print(line)
assert "not reciprocal" in line
assert right_one.check() == ()

# %% [markdown]
# What it would mean: charge the plates, open the gap, discharge, close the gap. The work taken up
# in one round must be zero; as published, every round would give work from nothing.

# %%
c0, x0 = 1e-9, 1e-3
steps = np.linspace(0.0, 1.0, 4001)
corners_q, corners_x = np.array([1, 2, 2, 1, 1]) * 1e-8, np.array([1, 1, 2, 2, 1]) * 1e-3
round_q = np.interp(4 * steps, range(5), corners_q)
round_x = np.interp(4 * steps, range(5), corners_x)
voltage = round_q * round_x / (c0 * x0)
work = {}
for name, force in (
    ("published", c0 * x0 * round_q**2 / (2 * round_x**2)),
    ("corrected", round_q**2 / (2 * c0 * x0)),
):
    work[name] = np.trapezoid(voltage, round_q) + np.trapezoid(force, round_x)
    print(f"{name}: {1e9 * work[name]:8.2f} nJ a round")
assert abs(work["published"]) > 1e-8
assert abs(work["corrected"]) < 1e-12

# %% [markdown]
# ## Relations that must hold
#
# A motor with a sensor for its current and one for its speed. If sensors impose what they read and
# storages differentiate, every sensor leaves one relation between known signals. Faults break some
# of them and not others: that is their signature.

# %%
with BondGraph("motor") as motor:
    armature, rotor = One("armature"), One("rotor")
    Se("V", unit="V") >> armature >> R("R_a", 0.6, unit="ohm")
    armature >> I("L_a", 3e-4, unit="H")
    armature >> GY("K", ratio=0.05, unit="V*s") >> rotor
    rotor >> I("J_m", 1e-4, unit="kg*m^2")
    rotor >> R("b_m", 1e-4, unit="N*m*s")
    armature >> Df("i", unit="A")
    rotor >> Df("w", unit="rad/s")

found = redundancy(motor)
print(found)
assert found.signatures.column("R_a") == (True, False)
assert found.signatures.column("b_m") == (False, True)
assert found.signatures.column("K") == (True, True)

# %% [markdown]
# On data: the brush resistance rises by a fifth in the middle of a record. Only the relation of the
# current notices.

# %%
time = np.linspace(0.0, 0.4, 8001)
volt = 12.0 + 6.0 * np.sin(2 * np.pi * 20 * time)
half = 4000
before = simulate(motor, time[: half + 1], {"V": volt[: half + 1]}, x0="rest", hold="linear")
worn = {"R_a": 0.72}
after = simulate(motor, time[half:], {"V": volt[half:]}, worn, x0=before.state, hold="linear")
read = {name: np.append(before[name], after[name][1:]) for name in ("i", "w")}
known = {"V": [volt]} | {name: [y, np.gradient(y, time)] for name, y in read.items()}
nominal = {name: p.value for name, p in motor.parameters.items()}

fig, axes = plt.subplots(1, 2, figsize=(8.0, 2.4))
for axis, sensor, unit in zip(axes, ("i", "w"), ("V", "N m"), strict=True):
    residual = found[sensor].residual(known, nominal)
    size = np.abs(0.6 * read["i"]).max() if sensor == "i" else np.abs(0.05 * read["i"]).max()
    healthy = np.abs(residual[10 : half - 10]).max() / size
    faulty = np.abs(residual[half + 10 : -10]).max() / size
    print(f"relation of {sensor}: {healthy:.0e} before, {faulty:.0e} after the fault")
    assert healthy < 1e-3
    assert (faulty > 0.05) == (sensor == "i")
    axis.plot(time[5:-5], residual[5:-5], lw=0.9)
    axis.axvline(time[half], color="0.6", lw=0.8, ls="--")
    axis.set(xlabel="time / s", ylabel=f"residual / {unit}", title=f"relation of {sensor}")
    axis.set_ylim(-0.25 * size, 0.25 * size)
plt.show()

# %% [markdown]
# With the current alone there is one relation, which every fault breaks: a fault shows and stays
# nameless. Which sensor would help?

# %%
alone = motor.remove("w")
print(redundancy(alone)["i"])
advice = splitting_sensors(alone)
print(advice)
best = advice.ranked[0]
assert (best.kind, best.junction) == ("Df", "rotor")

# %% [markdown]
# ## What a sensor cannot see
#
# Two wagons with a coupling, and a force sensor in it. Every state has a causal path to the sensor,
# and still the train could roll at any speed unseen: derivative causality, with the sensor imposing
# what it reads, leaves one mass in integral causality. One speed sensor is enough.

# %%
with BondGraph("train") as train:
    first, second, coupling, spring = One("first"), One("second"), Zero("coupling"), One("spring")
    Se("F", unit="N") >> first >> I("m_1", 2.0, unit="kg")
    first >> coupling >> spring >> C("k_c", stiffness=100.0, unit="N/m")
    spring >> R("d_c", 1.0, unit="N*s/m")
    coupling >> second >> I("m_2", 3.0, unit="kg")
    coupling >> De("F_c", unit="N")

blind = observability(train)
print(blind)
assert (blind.holds, blind.rank, blind.separate) == (False, 2, ())
assert blind.tied == (("p_m_1", "p_m_2"),)
seeing = observability(train.with_branch("second", [Df("v", unit="m/s")]))
print(seeing)
assert seeing.holds

linear = equations(train).linearise()
a, _, c, _ = linear.numbers({name: p.value for name, p in train.parameters.items()})
unseen = np.array([2.0, 0.0, 3.0])  # both wagons at the same speed, coupling relaxed
assert linear.states == ("p_m_1", "q_k_c", "p_m_2")
assert np.allclose(a @ unseen, 0.0)
assert np.allclose(c @ unseen, 0.0)

# %% [markdown]
# The last lines are the proof in numbers: both wagons at one speed is a motion that the force never
# shows.
