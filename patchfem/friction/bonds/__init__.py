"""The sum over bonds of eq. 2.17 and its engines.

In: bond parameters (`parameters`), slide and pressure. Out: traction and energies. `recursion` is exact for stretch
with p = 1; `quadrature` is the plain sum for every order and reading; the compiled list (`bond_*`) merges old bonds;
`engines` chooses by error and cost. Read `parameters`, then `recursion`, then `quadrature`.
"""
