"""Numbers read off a run.

In: histories. Out: measures by name, the outcome, events of sticking and slipping, ringing. Read `measures` first.
"""
