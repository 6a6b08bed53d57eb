"""Drawings: curves over time and load, the pressed pieces, an interactive view of them.

`pictures` holds colours, axes and the SVG text that the others draw with. Read it first.
"""
