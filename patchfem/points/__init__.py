"""Sweeps over many cases of one mode and one contact point, by steps that end at the events of the law.

1. `laws`                 numbers of the laws
2. `smooth_laws_kernels`  force of each smooth law at the end of a step
3. `case_rows`, `case_observers_kernels`, `linear_cases_kernels`, `smooth_cases_kernels`, `case_march_kernels`, `cases`
   cases with their measures, for laws that are linear between events and for smooth ones

A law is a number in `law_rows.Law`, a row of `laws.POINT_LAWS` and branches in `smooth_laws_kernels`, which read first.
"""

# Names that other folders use, by module.
PUBLIC = {}
