"""Where power goes: ledgers, energies of stores, the port-Hamiltonian form."""
