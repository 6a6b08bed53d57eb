"""The march in time: modes move exactly under the path-mean friction force of each step.

In: modes, a drive, a law under its load. Out: histories, extremes, energy ledger. Three loops: `loop_kernels` of one
interface, `joints_kernels` of several elements, `varying_load_kernels` of a load that changes. Each is one text that
runs with any contact or law: `hub` and `joints` make an instance of it per law. Read `march` first, then `hub` and
`loop_kernels`.
"""
