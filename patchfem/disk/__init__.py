"""Writing of files and folders that survives interrupts, full disks and other writers.

In: a path and its content. Out: the complete file or folder in its place, or an error `Missing` that states what
failed, with the previous file untouched. `atomic_write` writes files, `exchange` replaces folders, `deferred_signals`
defers the signals that end the process, `lock` lets one process write to a folder, `open_with_timeout` opens files for
reading, `user_cache` keeps files between runs, `file_hashes` detects files that changed, `installed` lists package
versions. Read `atomic_write` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "atomic_write": (
        "is_partial_name",
        "open_lossy",
        "write_atomically",
        "write_text",
    ),
    "lock": ("FolderLock",),
}
