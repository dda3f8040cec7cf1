"""Machines declared in the language."""

from actuators.stack_bond_graph import stack_bond_graph as stack_bond_graph
