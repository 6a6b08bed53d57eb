"""Output of a verb: its answer, and the screen, files, pages and pictures that are made from it.

In: results of `runs` and `campaigns`. Out: an `Answer`, files, and lines of text. A module imports only entries of this
list that come before it:

1. `answer`: the record that every verb returns
2. `quantities`: definitions of all quantities, the key quantities, and how numbers are displayed
3. `charts`: tables of charts, curves and tables, and their drawing for pages and pictures
4. `netcdf`: arrays of an answer as a netCDF file
5. `store`: files of an answer, written and read
6. `fields`: fields of the pieces as VTKHDF, VTU and PVD, as grids of PyVista, and on a grid for a page
7. `several`: what differs between several runs
8. `page`: report.html, made from the other files
9. `folder`: the results folder, complete at every moment
10. `show`: an answer as lines on the screen
11. `driven`: the drive of a run in words
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
