"""Pages whose pictures the reader's browser draws from the data they hold: one file each, nothing is fetched.

In: plain data of a run, of several runs or of a sweep. Out: HTML text. `document` makes the page around its sections,
`library` packs the drawing library BokehJS of `bokehjs`, and `unpack.js` unpacks it with the data. `curves.js` draws
the figures of `drawing.charts`; `player` makes the frames of the fields (`thinned` the cells), which `player.js`
plays on the canvases of `stage.js`; `explorer.js` draws a sweep. Read
`document` first.
"""
