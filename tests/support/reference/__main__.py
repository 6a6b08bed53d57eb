"""Write the generated pages of patchfem/scene: python tests/support/reference."""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from reference import joint_laws, keys, limits, records

for page in (keys, keys.Equations, records.MeasuresPage, records.MaterialsPage, limits, joint_laws):
    page.FILE.write_text(page.text(), encoding="utf-8")
    print(page.FILE)
