# SPDX-License-Identifier: Apache-2.0
"""The words of the pages, by codespell.

  spelling_test.py ROOT CODESPELL
"""
import subprocess
import sys
from pathlib import Path

root, codespell = Path(sys.argv[1]).resolve(), sys.argv[2] if len(sys.argv) > 2 else ""
if not codespell:
    print("skipped: codespell is not installed (vendor/install.sh ci)")
    sys.exit(77)
skipped = {"build", ".git", "node_modules"}
pages = [str(path) for path in sorted(root.rglob("*.md")) if not skipped.intersection(path.relative_to(root).parts[:-1])]
result = subprocess.run([codespell, *pages], cwd=root)
print("%d pages" % len(pages))
sys.exit(1 if result.returncode else 0)
