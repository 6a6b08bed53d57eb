"""Pages whose pictures the reader's browser draws from the data they hold: one file each, nothing is fetched.

In: plain data of a run, of several runs or of a sweep. Out: HTML text. `document` makes the page around its sections,
`library` reads the drawing library BokehJS from `bokehjs`. `charts` makes the pictures of a run as data, which
`curves.js` draws; `player` the frames of its fields (`thinned` the cells), which `player.js` plays on the canvases of
`stage.js`; `explorer.js` draws a sweep. Read `charts` first.
"""
