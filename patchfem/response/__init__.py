"""Numbers read off a run.

In: histories, and what an engine integrated over the last cycles itself (`dynamics.integrated`). Out: measures by name
with their errors from coarser runs, the outcome, events of sticking and slipping, ringing. Read `rows` first: `Seen` is
what every row reads, the engine's own number before the one that samples show; `measures` has how samples are read.
"""
