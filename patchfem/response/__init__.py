"""Numbers read off a run.

In: histories. Out: measures by name with their errors from coarser runs, the outcome, events of sticking and
slipping, ringing. Read `measures` first.
"""
