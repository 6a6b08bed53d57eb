"""Contact on a row of points as fine as a measured trace.

In: layers, free ends, a gap at thousands of evenly spaced points. Out: forces, edges of the contact, stiffnesses.
`layer` has the closed form for waves along a layer and what the free ends change, `point_compliance` the operator made
of both and its equations. Read `point_compliance` first.
"""
