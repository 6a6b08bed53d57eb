"""Drawings: figures of a run as data and as SVG.

`charts` makes the figures of a run as data, which `pictures` draws with matplotlib and the pages
draw in the browser; `accuracy` makes the figure of accuracy against computing time.

Read `charts` first.
"""
