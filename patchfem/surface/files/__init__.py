"""Readers of measured surfaces.

Formats: text, Dektak exports, arrays, X3P, and others through SurfaceTopography.
In: a path, and units if the file states none or wrong ones. Out: a `Profile` or an `Areal` in
metres, or a refusal that names file and line. The content of a file decides its format, then its
suffix. Sizes are read from a header and limited before anything is allocated. SurfaceTopography is
an optional package and works in a process of its own. Read `read` first, then `head` and `text`.
"""
