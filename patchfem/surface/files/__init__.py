"""Readers of measured surfaces.

Formats: text, exports of Dektak, arrays of NumPy and MATLAB, and those of SurfaceTopography, an optional
package, such as X3P. In: a path, and units if the file states none or wrong ones. Out: a `Profile` or an
`Areal` in metres, or a refusal that names file and line. The content of a file decides its format. Every
reader returns a `Table`, the numbers and units of the file, of which `table` makes the surface; all names
and units that files use stand in `units`. Read `table` first, then `read` and `text`.
"""
