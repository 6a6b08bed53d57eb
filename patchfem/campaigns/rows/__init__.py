"""Fit of a rig to a table of measured responses, such as Table 1 of the report.

In: a scene of a rig, rows of frequency, input, acceleration and displacement, ranges of the free
parameters, and validation rows. Out: fitted values with confidence intervals, and scores of the
fitted, the held-out and the left-out readings.

- `cells`: readings of the table
- `condition_models`: models of the rig at the measured conditions
- `model_readings`: readings that these models predict

Read `fit` first.
"""
