"""A rig whose law is smooth between reversals.

In: a `Model`. `choice` says whether `dynamics.smooth` takes it and what it costs; `solve` runs it and reads its
measures.
"""
