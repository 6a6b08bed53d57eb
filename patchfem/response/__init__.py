"""Compute measures from a run: numbers with names, units and errors.

In: histories of a run, and the measures that an engine integrated over the last cycles itself
(`dynamics.integrated`). Out: measures by name with their errors from coarse runs, the outcome,
the events of stick and slip, and the ringing. Read `rows` first: every row of its table reads a
`LastCycles`, and takes the value of the engine before the value from the samples. `measures` has the
functions that evaluate samples.
"""
