"""Files of measured surfaces: text, Dektak exports, arrays, X3P, and other instruments through SurfaceTopography.

In: a path, and units where a file names none or wrong ones. Out: a `Profile` or an `Areal` in metres, or a refusal
that names file and line. A format is known by its content first, by the suffix of the file second. Sizes are read from
a header and limited before anything is allocated. X3P (ISO 25178-72) is read by every installation;
SurfaceTopography is an extra and works in a process of its own. Read `read` first, then `head` and `text`.
"""
