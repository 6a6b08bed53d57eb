"""Drawings: curves over time and load, the pressed pieces, a window on them, films and a script for ParaView.

`pictures` holds colours, axes and the SVG text that the others draw with. Read it first, then `panels`, which says what
a picture of the pieces shows; `view`, `flat` and `film` draw it.
"""
