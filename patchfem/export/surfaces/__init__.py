"""Pages, tables and files on measured surfaces: roughness and wear.

In: the records of `surface.roughness`, `surface.compare` and `surface.scans`, or two results
folders of runs with wear (`worn_runs`). Out: lines for the screen, plain data for JSON, CSV and X3P
files, and a self-contained page. `quantities` has the common table of quantities; `pictures` draws.

Read `roughness` first.
"""
