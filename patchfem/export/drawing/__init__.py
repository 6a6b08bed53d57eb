"""Drawings: figures of a run as data and as SVG, pictures and films of the pieces, ParaView.

`charts` makes the figures of a run as data, which `pictures` draws with matplotlib and the pages
draw in the browser; `accuracy` makes the figure of accuracy against computing time. `panels`
computes what a picture of the pieces shows; `view`, `flat` and `film` draw it. `paraview` writes a
script.

Read `charts` first, then `panels`.
"""
