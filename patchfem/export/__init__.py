"""Output of a verb: its answer, and the screen, files, pages and pictures that are made from it.

In: results of `runs` and `campaigns`. Out: an `Answer`, files, and lines of text.

    Result -> runs (run_data: arrays, run_words: verdict) -> Answer
    Answer -> show -> screen
    Answer -> store (netcdf, columns) -> summary.json, NAME.json, result.nc, NAME.csv
    these files -> store -> page (charts: table -> panels -> plotly) -> report.html
    Answer -> charts: table -> panels -> axes -> --plot and `plot` in Python
    Result -> fields: blocks -> vtkhdf -> fields.vtkhdf -> film of the page, pieces (view), grids (export)

A module imports only entries of this list that come before it:

1. `answer`: the record that every verb returns
2. `surface_definitions`: definitions of the quantities of measured surfaces
3. `quantities`: definitions of all quantities, the key quantities, and how numbers are displayed
4. `charts`: tables of charts, curves and tables, and their drawing for pages and pictures
5. `netcdf`: arrays of an answer as a netCDF file
6. `columns`: rows of an answer, for its CSV files and tables
7. `store`: files of an answer, written and read
8. `fields`: fields of the pieces as VTKHDF, VTU and PVD, as grids of PyVista, and on a grid for a page
9. `page`: report.html, of one or several answers, made from the other files
10. `folder`: the results folder, complete at every moment
11. `show`: an answer as lines on the screen
12. `run_data`: arrays of a run
13. `run_words`: verdict of a run
14. `runs`: answer of a run
15. `run_folder`: a run that writes its folder
16. `sweeps`: answer of a sweep, and its folder
17. `surfaces`: answers on measured surfaces
18. `costs`: answer on error against time
19. `backbones`: answer on frequency and damping over the amplitude
20. `fits`: answer of a fit
21. `lab`: histories and loops in the formats of laboratories
22. `pieces`: pictures and films of the pieces
23. `convert`: a results folder in another format, chosen by the suffix of a file

Read `answer` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "folder": ("Folder",),
}
