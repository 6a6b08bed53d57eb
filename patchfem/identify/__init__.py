"""Values of a scene from measurements, with intervals.

In: a function of parameters and rows measured. Out: best values, 95 % intervals, what the rows leave open.
Read `least_squares` first.
"""
