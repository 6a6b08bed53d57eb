"""What the meshes of a patch will be, before any is made.

In: a `PatchModel`. Out: the size of its grids and how many it climbs (`grids`), from a contact that is guessed as of
springs beside each other (`contact`). Read `grids`.
"""
