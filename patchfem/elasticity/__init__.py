"""Elastic pieces condensed to their interface.

In: tagged meshes and materials. Out: compliance matrices of the interface nodes (normal, tangential, coupled), and
displacement and stress inside for a given interface traction. Plane strain or stress, bilinear or any cells.
Grids: `tensor_stiffness` assembles them, `condense` eliminates their inside in the fronts of `grid_fronts`, which
also says what that will cost. Any cells, those of a mesh file or beside a round end: `substructure`, whose stiffness
scikit-fem assembles, with `fronts` and `dissect`.
`mortar` joins meshes that do not match, `recovery` goes back inside. Read `elasticity` first, then `condense`.
"""
