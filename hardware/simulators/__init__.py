"""Virtual benches and plants that conceal effects.

Independent of the tool on purpose: own equations, own integrator, own step; only numpy, scipy and
the standard library are imported.
"""
