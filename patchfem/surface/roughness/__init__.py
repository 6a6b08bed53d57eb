"""Roughness of a trace or of an areal scan: filters, parameters, spectrum, intervals.

In: a `Profile` or an `Areal` [m]. Out: a `RoughnessReport` with the parameters of ISO 21920-2 and
ISO 13565-2 of the primary profile, with a cut-off also those of the roughness profile (Gaussian
filter, ISO 16610-21), or those of ISO 25178-2 for a scan. A single measurement gives an interval
for many of them (`intervals`). `peaks` derives the asperities of a surface from its traces. Read
`report` first, then `rows`, which defines each parameter.
"""
