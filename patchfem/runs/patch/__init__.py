"""Static patch: condense the pieces, solve the contact, estimate errors on coarser meshes.

In: a `PatchModel`. Out: patches on nested meshes, and static measures with errors. A single run is a group of cases with one
case: `case_meshes` presses the cases of a group together on meshes that `grids` chooses from the contacts that
`contact_search` finds. `condensed` condenses the pieces to their
interface; `press` computes the pressure; `profile_points` adds more accurate measures for profiles, and `store` caches
results that several runs of a patch need. Read `press` first, then `grids`, `case_meshes` and `measures`.
"""
