"""Output of a verb: its answer, and the screen, files, pages and pictures that are made from it.

In: results of `runs` and `campaigns`. Out: an `Answer`, files, and lines of text.

    Result -> runs (run_data: arrays, run_words: verdict) -> Answer
    Answer -> show -> screen
    Answer -> store (netcdf, columns) -> summary.json, NAME.json, result.nc, NAME.csv
    these files -> store -> page (charts: panels -> plotly) -> report.html
    Answer -> charts: panels -> axes -> --plot and `plot` in Python
    Result -> fields: vtkhdf -> fields.vtkhdf -> film of the page, pieces (view), grids (export)

A module imports only entries of this list that come before it:

1. `answer`: the record that every verb returns
2. `rows`: the table rows.toml of all variables, quantities, charts, CSV files and tables
3. `surface_definitions`: definitions of the quantities of measured surfaces
4. `quantities`: definitions of all quantities, the key quantities, and how numbers are displayed
5. `charts`: curves and axes of charts, and their drawing for pages and pictures
6. `netcdf`: arrays of an answer as a netCDF file
7. `columns`: rows of an answer, for its CSV files and tables
8. `store`: files of an answer, written and read
9. `fields`: fields of the pieces as VTKHDF, VTU and PVD, as grids of PyVista, and on a grid for a page
10. `page`: report.html, of one or several answers, made from the other files
11. `folder`: the results folder, complete at every moment
12. `show`: an answer as lines on the screen
13. `run_data`: arrays of a run
14. `run_words`: verdict of a run
15. `runs`: answer of a run
16. `run_folder`: a run that writes its folder
17. `sweeps`: answer of a sweep, and its folder
18. `surfaces`: answers on measured surfaces
19. `costs`: answer on error against time
20. `backbones`: answer on frequency and damping over the amplitude
21. `fits`: answer of a fit
22. `lab`: histories and loops in the formats of laboratories
23. `pieces`: pictures and films of the pieces
24. `convert`: a results folder in another format, chosen by the suffix of a file

Read `answer` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "folder": ("Folder",),
}
