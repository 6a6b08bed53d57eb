"""What people look at: results folder, netCDF, VTK, report page, pictures.

In: a `Result`. Out: files. Read `folder` first.
"""
