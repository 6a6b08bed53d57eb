"""Elastic pieces condensed to their interface.

In: tagged meshes and materials. Out: compliance matrices of the interface nodes (normal, tangential, coupled), and
displacement and stress inside for a given interface traction. Plane strain or stress, bilinear or any cells.
The form of plane elasticity is in `plane_form`, and scikit-fem evaluates it for every mesh. The pieces of a tensor
grid are assembled in `tensor_stiffness` from the matrices of three reference cells; `condense` eliminates their inside
in the fronts of `grid_fronts`, which also predicts the cost. Pieces of any other cells, those of a mesh file or beside
a round end, are assembled cell by cell in `substructure` and factorised with `fronts` and `dissect`.
`mortar` joins meshes that do not match, `recovery` goes back inside. Read `elasticity` first, then `condense`.
"""
