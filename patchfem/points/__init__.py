"""Sweeps over many cases of one mode and one contact point, by steps that end at the events of the law.

1. `rows`              columns of all arrays, and the laws
2. `laws`              numbers of the laws
3. `law_kernels`       force of each smooth law at the end of a step
4. `motion_kernels`    pieces of the motion
5. `observer_kernels`  integrals, extremes and stick of a piece
6. `march_kernels`     loop over cases, cycles and pieces
7. `cases`             cases with their measures

A law is a number in `rows.Law`, a row of `laws.POINT_LAWS` and branches in `law_kernels`; read `motion_kernels` first.
"""

# Names that other folders use, by module.
PUBLIC = {}
