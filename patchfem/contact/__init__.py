"""Normal contact of two pieces through their condensed compliance.

In: compliance (m, m), gap (m,), load or approach. Out: nodal pressure, gap, approach and rotation that satisfy
w = g + theta x - delta + C f >= 0, f >= 0, f.w = 0. `unilateral` solves it, `strips` sets patches side
by side and adds asperities (`skin_laws`), `contact_sets` tabulates contact sets. Read `gaps` and `unilateral` first.
"""
