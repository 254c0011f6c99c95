# SPDX-License-Identifier: Apache-2.0
"""The C++ of a Markdown page compiles with what the page shows.

  snippets_test.py ROOT COMPILER [FLAG...]     FLAGs: where the headers of third parties are

The blocks of a page are one program from top to bottom, as a reader pastes them:
- Lines `#include` come first.
- Blocks that define a class, a template or a function at the start of a line follow, outside of functions.
- The statements of all other blocks are in one function. A block sees the names of the blocks before it and may declare them anew.
Nothing is added. Only the syntax and the types are judged; `<!-- from FILE -->` names a program that runs the lines (pages_test.py).
"""
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from markdown import is_cpp, pages, split

ROOT = Path(sys.argv[1]).resolve()
COMPILER = sys.argv[2:]
FLAGS = ["-std=c++17", "-fsyntax-only", "-Wall", "-Wno-unused-variable", "-Wno-unused-but-set-variable", "-Wno-vexing-parse", "-Werror",
         "-I%s" % (ROOT / "include")]


def is_outside(lines):
    return any(re.match(r"(template|struct|class|enum)\b|[\w:<>]+ \w+\(.*\) \{", line) for line in lines)


def program_of(page, blocks):
    first, outside, inside, depth = [], [], [], 0
    for number, _, _, lines in blocks:
        rest = []
        for at, line in enumerate(lines, number + 1):
            where = '#line %d "%s"' % (at, page)
            if line.startswith("#include"):
                first += [where, line]
                rest.append("")
            else:
                rest.append(line)
        where = '#line %d "%s"' % (number + 1, page)
        if is_outside(rest):
            outside += [where, *rest]
        elif any(rest):
            inside += ["{", where, *rest]
            depth += 1
    return "\n".join([*first, *outside, "void statements_of_the_page();", "void statements_of_the_page() {", *inside, "}" * depth, "}", ""])


def check(job):
    page, text, source = job
    source.write_text(text, encoding="utf-8")
    found = subprocess.run([*COMPILER, *FLAGS, source], capture_output=True, text=True)
    return page, found.returncode, found.stderr


jobs, blocks_in_all, failed = [], 0, 0
with tempfile.TemporaryDirectory() as folder:
    for path in pages(ROOT):
        page = path.relative_to(ROOT).as_posix()
        blocks = [block for block in split(path.read_text(encoding="utf-8"))[1] if is_cpp(block)]
        if not blocks:
            continue
        blocks_in_all += len(blocks)
        jobs.append((page, program_of(page, blocks), Path(folder) / ("%d.cpp" % len(jobs))))
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for page, status, said in threads.map(check, jobs):
            missing = re.search(r"fatal error: '?(?!lrt/)([\w/.]+)'?(?: file not found|: No such file)", said)
            if missing:
                print("skipped: %s: the header %s is not installed" % (page, missing.group(1)))
            elif status != 0:
                failed += 1
                print("%s does not compile as it stands:\n%s" % (page, said))
print("%d pages with %d blocks of C++, %d failed" % (len(jobs), blocks_in_all, failed))
sys.exit(1 if failed else 0)
