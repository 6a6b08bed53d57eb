"""Output of a run: results folder, netCDF, VTK, report page and pictures.

In: a `Result`. Out: files. A module imports only entries of this list that come before it:

1. `written`: values of swept keys as text
2. `read_results`: files of results that are read again, with one error that says what is wrong
3. `results`: the results folder, complete at every moment
4. `summary`: summary.json
5. `netcdf`: result.nc
6. `histories`: content of result.nc from a run
7. `tolerance_misses`: cases of a sweep that miss their tolerance
8. `fields`: fields of the pieces as VTKHDF, VTU and PVD, as grids of PyVista, and on a grid for a page
9. `lab`: histories and loops in the formats of laboratories
10. `drawing`: charts as SVG
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
21. `pieces`: pictures and films of the pieces
22. `convert`: a results folder in another format, chosen by the suffix of a file

Read `folder` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "backbone": (
        "COLUMNS",
        "backbone_charts",
        "backbone_contents",
        "format_backbone",
        "write_backbone",
    ),
    "convert": (
        "export_results",
        "view_results",
    ),
    "cost": (
        "cost_data",
        "format_cost",
        "format_details",
        "write",
        "write_picture",
    ),
    "drawing.pictures": ("draw_charts",),
    "drawing.swept": ("sweep_chart",),
    "fits.options": ("FitOptions",),
    "fits.request": (
        "Listener",
        "choose_kind",
        "fit_into",
    ),
    "folder": (
        "is_complete",
        "run_into",
        "save_run",
        "saves_state",
        "write_run_page",
    ),
    "histories": ("result_contents",),
    "lab.imported": (
        "EstimateOptions",
        "convert_file",
    ),
    "lab.structures": ("export_structure",),
    "pages.driven": ("list_changed_keys",),
    "pages.headline": ("summarise_sweep",),
    "pages.released": ("describe_release",),
    "pages.sentences": (
        "format_measures",
        "headline_sentence",
        "notebook_html",
        "tolerance_sentence",
        "verdict_sentence",
    ),
    "report": ("draw_axes",),
    "reports": ("write_report",),
    "results": ("Folder",),
    "summary": (
        "count_cycles",
        "measure_object",
        "read_summary",
        "summarise_run",
        "write_json",
    ),
    "sweeps.folder": ("case_folder_name",),
    "sweeps.manifest": (
        "hash_request",
        "read_manifest",
        "write_manifest",
    ),
    "sweeps.page": ("sweep_table",),
    "sweeps.run": (
        "SweepTarget",
        "collect_shards",
        "compute_in_memory",
        "sweep_into",
    ),
    "sweeps.tables": ("table_contents",),
    "written": ("shorten_number",),
}
