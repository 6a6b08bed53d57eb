"""Fit of a rig to a table of measured responses, such as Table 1 of the report.

In: a scene of a rig, rows of frequency, input, acceleration and displacement, ranges of free keys,
and rows to hold out. Out: values with intervals, and scores of the readings that were fitted, held
out and left out, for the rig and for models without mechanics.

- `cells`: readings of the table
- `asked`: models of the scene at the measured conditions
- `computed`: readings that these models give
- `search`: random starts and descents
- `null_models`: models without mechanics

Read `fit` first.
"""
