"""Batches of cases with one mode and one interface under a constant load and a sine.

In: models of one group. Out: their `CaseResults`, as single runs compute them, by one compiled
call for all. `columns` has measures and errors as columns, outcomes and reasons; `pieces` runs
friction that is linear between events, for a point (`lumped`) and for patches that slip in part
(`sheared`); `lanes` marches many points side by side, and `tabled` many patches, both with
their own error estimates. A case that a batch cannot finish as a single run would (stops,
warnings with a remedy) is run by itself.
"""
