"""Comparison of a rig with a table of measured responses, such as Table 1 of the report.

In: a scene of a rig, rows of frequency, input, acceleration and displacement, and free keys. Out: measured and computed
readings for values of the keys, and scores of the fitted, the held-out and the left-out readings.

- `cells`: readings of the table
- `condition_models`: models of the rig at the measured conditions
- `model_readings`: readings that these models predict

Read `cells` first; `fits.rows` fits the rig.
"""
