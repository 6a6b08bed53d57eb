"""Output of a run: results folder, netCDF, VTK, report page and pictures.

In: a `Result`. Out: files. A module imports only entries of this list that come before it:

1. `written`: values of swept keys as text
2. `read_results`: files of results that are read again, with one error that says what is wrong
3. `results`: the results folder, complete at every moment
4. `summary`: summary.json
5. `netcdf`: result.nc
6. `histories`: content of result.nc from a run
7. `tolerance_misses`: cases of a sweep that miss their tolerance
8. `fields`: fields of the pieces as VTKHDF, VTU and PVD
9. `lab`: histories and loops in the formats of laboratories
10. `drawing`: drawings as SVG, films, a script for ParaView
11. `pages`: pages whose figures the browser draws
12. `page_data`: data of the page and the pictures of a run
13. `report`: report.html of a run, and its pictures
14. `folder`: a finished run on disk
15. `sweeps`: a sweep on disk
16. `reports`: one page over runs or sweeps
17. `surfaces`: pages on measured surfaces
18. `cost`: error against time of the numerical settings of a scene
19. `fits`: fits of any kind, from their options to their folder
20. `backbone`: frequency and damping over the amplitude on disk
21. `convert`: a results folder in another format, chosen by the suffix of a file

Read `folder` first.
"""
