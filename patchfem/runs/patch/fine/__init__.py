"""Static measures of a patch under a profile too fine for its cells, at the spacing of the file and below.

In: a patch on cells whose errors miss the tolerance. Out: values with errors, for the measures that have smaller ones
there. Read `trace` first.
"""
