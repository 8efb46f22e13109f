"""The light model of SPEC.md in Numba: one kernel source, compiled for one core or for several."""
