"""What is written: files whole or not at all, folders with one writer, old and new exchanged in one step.

In: a path and what writes it. Out: the file or folder in its place, or Missing that names path,
need and room, with the older one untouched. `atomic_write` writes files, `lock` says who writes a
folder, `exchange` puts a folder in its place, `open_with_timeout` opens what is read, `file_hashes`
signs the files that texts name, `installed` says which packages are there. Read `atomic_write`
first.
"""
