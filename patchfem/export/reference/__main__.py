"""Write the generated pages of patchfem/scene anew."""

from . import keys, limits, records

for page in (keys, records.Measures, records.Materials, limits):
    page.FILE.write_text(page.text(), encoding="utf-8")
    print(page.FILE)
