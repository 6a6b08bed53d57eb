"""Simultaneous solution of many contacts of one pair of pieces, for sweeps over loads, tilts and crowns.

In: one compliance, and gaps, loads and moments of q cases. Out: forces, motions, edges and stiffnesses, the
same that `unilateral` and `edges` give case by case.

`intervals` solves cases whose contact set is one stretch of consecutive nodes, and reports by a residual which
cases are not of this kind; `interval_kernels` has its compiled parts, and `arrays` the records that they work
on. Read `intervals` first.
"""
