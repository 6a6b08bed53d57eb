"""Contact on a row of points as fine as a measured trace: short waves in closed form, the ends of the pieces by cells.

In: layers, free ends, a gap at thousands of even points. Out: forces, ends of the contact, stiffnesses. `strip` has
the waves and what the ends change, `products` the operator made of both and its equations. Read `products` first.
"""
