"""Methods that the report and textbooks use, kept for comparison: Duhamel, Newmark, Euler.

Read `comparison` first.
"""
