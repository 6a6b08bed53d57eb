"""Cases of one lumped contact: one mode, one interface under a constant load, a sine: one compiled call for all.

In: models of one group. Out: their `Answers`, as single runs give them. `columns` has what all kinds share: measures
and errors as columns, outcome, reasons; `coulomb` is the first kind, `pieces` and `smooth` the others. A case that a
batch cannot end as a single run would (stops, warnings with a remedy) is run by itself.
"""
