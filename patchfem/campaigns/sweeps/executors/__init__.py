"""Ways to work on the chunks of a sweep: in this process, in others beside it, on a Dask cluster.

Each has `workers` and `run(work, take, say)`, which gives (chunk, seconds, answer or Died) of every chunk that `take`
hands out. Read `here` first.
"""
