"""One mode behind the elastic-plastic elements of one interface, under sines: the run of `dynamics.piecewise`, faster.

In: what the loop there takes, as scalars. Out: the same rows and books. Read `one_kernels` first.
"""
