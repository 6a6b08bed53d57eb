"""Roughness of a trace or of an areal scan: filter, parameters, spectrum, each with its interval.

In: a `Profile` or an `Areal` [m]. Out: a `RoughnessReport`: the parameters of ISO 21920-2 (4287, 13565-2), of the
primary profile without a cut-off and of the roughness profile with one, spectrum, Abbott curve, the stylus's reach.
The filter is that of ISO 16610-21; `rows` has the definitions, one record each; `intervals` says what a single trace
can tell. Read `report` first, then `rows`.
"""
