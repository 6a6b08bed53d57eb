"""Values of a rig from a table of measured responses, as Table 1 of the report is one.

In: a scene of a rig, rows of frequency, input, acceleration and displacement, ranges of free keys, rows held out. Out:
values with intervals, scores of what was fitted, held out and left out, and those of models without mechanics.
`cells` what was read, `asked` the models of a scene, `computed` what their instruments read, `search` starts and folds,
`null_models` models without mechanics. Read `fit` first.
"""
