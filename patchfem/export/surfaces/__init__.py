"""Pages about measured surfaces.

In: the records of `surface.roughness` and `surface.compare`. Out: a page that stands alone, and the same numbers
as plain data and as lines of text. `areal` writes heights as X3P and text. Read `roughness` first, then
`pictures`.
"""
