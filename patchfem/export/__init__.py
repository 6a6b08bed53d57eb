"""What people look at: results folder, netCDF, VTK, report page, pictures.

In: a `Result`. Out: files. A module imports its own entry of this list and the entries before it:

1. `written`    values of swept keys as they were written
2. `read_results`   files of results read back, one fault that names what is wrong
3. `results`    the results folder, whole at every moment
4. `summary`    summary.json
5. `netcdf`     result.nc
6. `histories`  what result.nc holds, taken from a run
7. `tolerance_misses`     cases of a sweep that miss their tolerance
8. `fields`     fields of the pieces as VTKHDF, VTU and PVD
9. `lab`        histories and loops in the formats of laboratories
10. `drawing`   drawings as SVG, films, a script for ParaView
11. `pages`     pages whose pictures the browser draws
12. `page_data` what the page and the pictures of a run show
13. `report`    report.html of a run, and its pictures
14. `folder`    a finished run on disk
15. `sweeps`    a sweep on disk
16. `reports`   one page over runs or sweeps
17. `surfaces`  pages about measured surfaces
18. `cost`      error against time of the knobs of a scene
19. `fits`      fits of any kind, from their options to their folder
20. `backbone`  frequency and damping over the amplitude on disk
21. `convert`    a results folder in the format, or the picture, that the ending of a file asks for

Read `folder` first.
"""
