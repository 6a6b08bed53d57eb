"""The sum over bonds of eq. 2.17 and its engines.

In: bond parameters, slide and pressure. Out: traction and energies. Read `parameters`, then `recursion`, which is exact
for stretch with p = 1, then `quadrature`, the plain sum for every order and reading over the `strips` of a path. Both
are NumPy and serve a line and a plane alike.

Compiled, along a line: `point_kernels` is the recursion, `list_kernels` the sum as one list of strips. Direct,
truncated and merged are settings of that list, chosen by error and cost in `engines`: `list_numbers` holds them,
`list_sum_kernels` its sums, `list_merge_kernels` its merging.
"""
