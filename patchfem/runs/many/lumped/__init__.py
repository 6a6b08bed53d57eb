"""Cases of one mode and one interface under a constant load and a sine: one compiled call for all.

In: models of one group. Out: their `Answers`, as single runs give them. `columns` has what all kinds share: measures
and errors as columns, outcome, reasons; `pieces` and `smooth` are the kinds of a lumped contact; `sheared` has patches
that slip part by part. A case that a batch cannot end as a single run would (stops, warnings with a remedy) is run by
itself.
"""
