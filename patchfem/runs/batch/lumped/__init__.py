"""Cases of one mode and one interface under a constant load and a sine: one compiled call for all.

In: models of one group. Out: their `CaseResults`, as single runs give them. `columns` has measures
and errors as columns, outcome, reasons; `pieces` the runs of friction that is linear between
events, of a lumped contact (`lumped`) and of patches that slip part by part (`sheared`); `lanes`
marches many points side by side, and `tabled` many patches, with bars of their own. A case that a
batch cannot end as a single run would (stops, warnings with a remedy) is run by itself.
"""
