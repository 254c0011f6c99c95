# SPDX-License-Identifier: Apache-2.0
"""Each exported class and free function of a public header says which threads may call it: its comment has "@par Threads".

  threads.py ROOT

The paragraph of a namespace or of a group (@{ to @}) holds for the functions in it, that of a function also for overloads behind it without a
comment. A header whose classes and functions are not exported has the paragraph at least once. Headers with neither (macros, includes,
enumerations) need none. What is in a namespace `detail` or behind @cond is not for users.
"""
import re
import sys
from pathlib import Path

IGNORED = re.compile(r"^/// @cond\b.*\n(?:.*\n)*?/// @endcond$\n"
                     r"|^namespace (?:\w+::)*detail\b.*\{\n(?:.*\n)*?\}  // namespace (?:\w+::)*detail\b.*$|^ *template <.*>$\n|^(?:class|struct) \w+;$\n", re.M)
TYPE = re.compile(r"^(?:class|struct) (?:LRT_API )?(?P<name>\w+)(?:<.*>)?(?: final)?(?: :.*)? \{")
FUNCTION = re.compile(r"^(?:\[\[nodiscard\]\] )?(?:LRT_API|inline|constexpr) [^=(]*?(?P<name>operator\W+|\w+)\(")
THREADS = re.compile(r"@par Threads +\S")


def faults_of(text):
    """What lacks the paragraph: names of exported classes and functions; "" if nothing is exported and the header has none."""
    comment, namespace, group, last, declared, lacking = "", False, False, None, False, []
    for line in IGNORED.sub("", text).splitlines():
        if line.startswith("///"):
            comment += line + "\n"
            group = group and "@}" not in line
            continue
        says = bool(THREADS.search(comment))
        if "@{" in comment:
            group = says
        if line.startswith("namespace "):
            namespace = says
        a_type = TYPE.match(line)
        found = a_type or FUNCTION.match(line)
        if found:
            declared = True
            says = says or (not a_type and (namespace or group or (not comment and last == (found["name"], True))))
            last = (found["name"], says)
            if "LRT_API" in line and not says:
                lacking.append(found["name"])
        comment = ""
    return lacking or ([""] if declared and not THREADS.search(text) else [])


ANY = "/// @par Threads  Any.\n"
EXAMPLES = (("/// A.\nclass LRT_API A {\n", ["A"]), (ANY + "class LRT_API A {\n", []), ("struct A {\n", [""]), ("#define A\n", []),
            (ANY + "template <class T>\nLRT_API Result<T> f(T) noexcept;\n", []), ("/// F.\nLRT_API Result<int> f(int) noexcept;\n", ["f"]),
            (ANY + "LRT_API int f();\nLRT_API int f(int);\n", []), (ANY + "LRT_API int f();\n/// G.\nLRT_API int g();\n", ["g"]),
            ("/// @{\n" + ANY + "LRT_API int f();\nLRT_API int g();\n/// @}\nLRT_API int h();\n", ["h"]),
            (ANY + "namespace n {\n/// A.\nclass LRT_API A {\n};\n/// F.\nLRT_API int f();\n", ["A"]),
            ("namespace n::detail {\nLRT_API int f();\n}  // namespace n::detail\n", []))
for example, expected in EXAMPLES:
    assert faults_of(example) == expected, (example, faults_of(example))

root = Path(sys.argv[1]).resolve()
headers = sorted(path for path in (root / "include/lrt").rglob("*.hpp") if "detail" not in path.parts)
faults = ["%s: %s has no @par Threads" % (path.relative_to(root), name or "this header") for path in headers for name in faults_of(path.read_text())]
print("\n".join(faults + ["%d headers, %d without @par Threads" % (len(headers), len(faults))]))
sys.exit(1 if faults or len(headers) < 50 else 0)
