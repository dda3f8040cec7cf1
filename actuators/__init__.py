"""Machines declared in the language."""

from actuators.stack.bond_graph import stack_bond_graph as stack_bond_graph
from actuators.stack.lumped import stack_lumped as stack_lumped
