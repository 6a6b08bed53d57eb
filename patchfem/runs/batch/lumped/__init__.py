"""Batches of cases with one mode and one interface under constant load and sinusoidal drive.

In: models of one group. Out: `CaseResults` equal to those of single runs, from one compiled call.

- `columns`: measures, errors, outcomes and reasons of n runs as columns.
- `pieces`: event-driven runs of piecewise linear friction, for single points (`lumped`) and for
  patches with partial slip (`sheared`).
- `lanes`, `tabled`: time integration of many points or patches in parallel lanes, with separate
  error estimates.

A case that a batch cannot complete is computed by a single run.
"""
