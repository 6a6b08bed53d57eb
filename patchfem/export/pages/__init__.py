"""Pages whose pictures the reader's browser draws from the data they hold: one file each, nothing is fetched.

In: plain tables of a sweep. Out: HTML text. `document` makes the page around its sections, `library` finds the drawing
library BokehJS in the installed package `bokeh` without importing it, `explorer.js` draws. Read `sweep` first.
"""
