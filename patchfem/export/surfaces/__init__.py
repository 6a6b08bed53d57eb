"""Pages, tables and files about measured surfaces: roughness and wear.

In: the records of `surface.roughness`, `surface.compare` and `surface.scans`, or two results
folders of runs with wear (`worn_runs`). Out: lines for the screen, plain data for JSON, CSV and X3P
files, and a page that needs no other file. `quantities` has the one table of quantities that all of
them use; `pictures` draws. Read `roughness` first.
"""
