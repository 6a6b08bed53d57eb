"""The commands of the command line, one function each.

In: words of the command line as typed parameters. Out: results on stdout, remarks and progress on
stderr, and files. A command imports what it needs when it is called, so that help and `check`
return at once. `shared` has the options and refusals of several commands.

Read `run` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "streams": ("make_printable",),
}
