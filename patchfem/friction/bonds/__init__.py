"""Friction law as a sum over bonds (eq. 2.17), and the algorithms that evaluate the sum.

In: bond parameters, relative displacement and pressure. Out: traction and energies. Read `parameters`, then
`recursion`, which is exact for reading="stretch" with p = 1, then `quadrature`, the direct sum for every order and
reading over the `strips` of a path. These are NumPy.

Compiled, along a line: `point_kernels` has the recursion, `list_kernels` the sum as one list of strips. `engines`
chooses between them by error and cost. `list_numbers` makes the arrays of a list, whose positions `list_rows_kernels`
names; `list_sum_kernels` has its sums, `list_merge_kernels` joins its strips.

Which code runs: reading="stretch" with p = 1, the default, is summed by the recursion. Every other sum
along a line is the compiled list, which `engines` truncates and merges to the tolerance. The NumPy
`Quadrature` sums the bonds of a bench that is evaluated sample by sample (`runs.bench.law`). A strip is
here a piece of the path along which the bonds of a point formed, not a strip of the patch.

Numerical errors: `EngineChoice.error` bounds what dropped and merged strips change, and every run adds this bound to
its errors. The Gauss rules have no bound of their own. Their strips are pieces of the path in a time step, so that the
runs with half and a quarter of the steps show their error; only increments above MAX_STRIP_LENGTH bond lengths have
pieces of a fixed length. Measured on benches of p = 0.5 and 2: with 40 steps per cycle and increments of up to 1.6 bond
lengths, work and peak force differ by at most 2e-6 from those with 6400 steps. With one Gauss point in place of two, 12
measures of benches and rigs change by up to 3e-4; 11 stated errors contain the change, but not that of the peak force
of a bench with p = 0.5. The sum over the nodes of a patch that slips part by part has the error of its mesh.
"""
