"""CVODES and IDAS along a record, for those who want another integrator than ours."""
