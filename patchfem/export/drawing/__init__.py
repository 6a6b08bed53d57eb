"""Drawings: figures of a run as data and on paper, the pressed pieces, a window on them, films, a script for ParaView.

`charts` makes the figures of a run as data, which `pictures` draws with matplotlib and the pages draw in the browser.
Read it first, then `panels`, which says what a picture of the pieces shows; `view`, `flat` and `film` draw it.
"""
