"""Electrostatic actuators: the moving-plate capacitor."""
