# SPDX-License-Identifier: Apache-2.0
"""The inline namespaces of lrt have the number LRT_ABI of include/lrt/version.hpp, and each public header that declares something has one.

  abi_number.py ROOT
"""
import re
import sys
from pathlib import Path

NAMESPACE = re.compile(r"(?:^inline namespace|^\}  // namespace) v(\d+)\b")
DECLARES = re.compile(r"^namespace lrt", re.M)

root = Path(sys.argv[1]).resolve()
abi = re.search(r"^#define LRT_ABI (\d+)$", (root / "include/lrt/version.hpp").read_text(), re.M).group(1)
found, faults = 0, []
for path in sorted(path for folder in ("include", "src") for path in (root / folder).rglob("*") if path.name.endswith((".hpp", ".cpp", ".in"))):
    text = path.read_text()
    numbers = [(n, match.group(1)) for n, line in enumerate(text.splitlines(), 1) if (match := NAMESPACE.match(line))]
    found += len(numbers)
    faults += ["%s:%d: namespace v%s, but LRT_ABI is %s" % (path.relative_to(root), n, number, abi) for n, number in numbers if number != abi]
    if not numbers and "include" in path.relative_to(root).parts and DECLARES.search(text):
        faults.append("%s: expected inline namespace v%s" % (path.relative_to(root), abi))
print("\n".join(faults + ["%d lines with the namespace of ABI %s, %d faults" % (found, abi, len(faults))]))
sys.exit(1 if faults or found < 100 else 0)
