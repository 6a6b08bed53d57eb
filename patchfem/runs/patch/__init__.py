"""The static patch: condense, press, estimate errors on coarser meshes.

In: a `PatchModel`. Out: patches on nested meshes and static measures with errors. `grids` owns the mesh, for plans and
runs alike; `condensed` has the pieces, `press` the pressure. `fine` has sharper measures for
traces. `meshes` and `static` serve the patches of a sweep together, `store` keeps what runs of one patch share.
Read `press` first, then `grids`, `ladder` and `measures`.
"""
