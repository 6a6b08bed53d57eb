"""Friction laws: traction as a function of the relative displacement at a given pressure.

In: increments of relative displacement and pressure. Out: path-mean traction, dissipated energy, and the state after
the step (`protocol`). `laws/` has one law per file, `bonds/` the sum over bonds of eq. 2.17 and its engines. Files named
*kernels are compiled and have their NumPy form beside them. `grooves` has matched grooves, whose flanks the load climbs.
`path_work` computes the friction work of samples. Read `protocol` first, then `laws/elastic_plastic`.
"""
