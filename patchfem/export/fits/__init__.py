"""Fits on disk: fit.json, fit.csv, fit.svg, the fitted scene, and a page.

In: a fit of `campaigns.fits` or `campaigns.rows`. Each kind of fit describes its files as a
`FitFiles` (`loop`, `curve`, `rows`, `patch`, `wear`), and `files.write_fit` writes them all.
`request` takes the options of the command line and of Python, chooses the kind of fit and calls the
other modules.

Read `files` first.
"""
