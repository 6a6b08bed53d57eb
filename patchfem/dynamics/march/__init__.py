"""The march in time: modes move exactly under the path-mean friction force of each step.

Read `march` first, then `loop_kernels` and `step_kernels`.
"""
