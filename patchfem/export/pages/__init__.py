"""HTML pages of one file each, whose figures the browser draws from data in the page.

In: plain data of a run, of several runs or of a sweep. Out: HTML text. A page loads nothing from
the network: `library` packs the drawing library BokehJS of `bokehjs`, and `unpack.js` unpacks it
with the data. `document` builds the page around its sections. `curves.js` draws the figures of
`drawing.charts`. `explorer.js` draws a sweep.

Read `document` first.
"""
