"""Static patch: condense the pieces, solve the contact, estimate errors on coarser meshes.

In: a `PatchModel`. Out: patches on nested meshes, and static measures with errors. `grids`
chooses the mesh, for plans and for runs; `condensed` condenses the pieces to their interface;
`press` computes the pressure; `profile_points` adds more accurate measures for profiles. `case_meshes`
presses many cases together, and `store` caches results that several runs of a patch need.
Read `press` first, then `grids`, `mesh_levels` and `measures`.
"""
