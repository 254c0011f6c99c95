# SPDX-License-Identifier: Apache-2.0
"""A forward declaration, or a friend declaration, names a type of another module only if arrows.txt has an arrow to that module.

  forward_declarations.py ROOT

Without it, a module could know a type of a module above it that it may not include. Types that no file below ROOT defines are those of third parties,
which third_parties.cmake judges.
"""
import re
import sys
from pathlib import Path

TYPE = re.compile(
    r"(?:(?:public|private|protected)\s*:\s*)?(?:template\s*<.*>\s*)?(friend\s+)?(?:class|struct|union|enum class|enum struct)\s+(?:LRT_\w+\s+)?"
    r"((?:\w+::)*\w+)(?:<.*>)?(?:\s+final)?\s*(?::[^:].*)?", re.S)
NAMESPACE = re.compile(r"(?:inline\s+)?namespace\s*([\w:]*)")
VERSION = re.compile(r"v\d+")


def read_arrows(path):
    """Module by name, and the modules that each module may know."""
    module_of, may_know = {}, {}
    for line in path.read_text().splitlines():
        match = re.fullmatch(r"([a-z0-9_/]+)( \(([a-z0-9_/ ]+)\))?:([a-z0-9_/ ]*)", line.strip())
        if line.startswith("#") or not match:
            continue
        module = match[1]
        may_know[module] = {module, *match[4].split()}
        for name in [module, *(match[3] or "").split()]:
            module_of[name] = module
    return module_of, may_know


def module_at(path, module_of):
    """As find_module() of arrows.cmake: the longest name that fits."""
    name = re.sub(r"\.[a-z.]+$", "", path)
    while name and name not in module_of:
        name = name.rpartition("/")[0]
    return module_of.get(name)


def types_of(text):
    """(line number, namespaces, name, whether it is defined) of the types of a file, friends included, without other nested ones."""
    def blank(match):
        return "\n" * match[0].count("\n")
    text = re.sub(r"//[^\n]*|/\*.*?\*/|^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", blank, re.sub(r'"(?:\\.|[^"\\\n])*"', '""', text), flags=re.S | re.M)
    spaces, depth, line = [], 0, 1  # spaces: (names of a namespace, depth outside of it)
    for statement, end in re.findall(r"([^{};]*)([{};])", text):
        line += statement.count("\n")
        statement = statement.strip()
        opened, names = NAMESPACE.fullmatch(statement), [n for space, _ in spaces for n in space]
        is_type = TYPE.fullmatch(statement)
        if opened and end == "{":
            spaces.append(([n for n in opened[1].split("::") if n and not VERSION.fullmatch(n)], depth))
        elif is_type and (is_type[1] or depth == len(spaces)):
            yield line, names, is_type[2], end == "{"
        depth += {"{": 1, "}": -1, ";": 0}[end]
        while spaces and depth <= spaces[-1][1]:
            spaces.pop()


def main(root):
    module_of, may_know = read_arrows(root / "tests/headers/arrows.txt")
    defined_in, declarations = {}, []
    for folder in ("src", "include/lrt"):
        for path in sorted((root / folder).rglob("*")):
            if not path.name.endswith((".hpp", ".cpp", ".in")):
                continue
            module = module_at(path.relative_to(root / folder).as_posix(), module_of)
            for number, names, name, is_definition in types_of(path.read_text()):
                if is_definition:
                    defined_in.setdefault("::".join([*names, name]), set()).add(module)
                else:
                    declarations.append((path.relative_to(root), number, module, names, name))
    faults = []
    for path, number, module, names, name in declarations:
        # The innermost namespace that has the name counts.
        found = next((q for n in range(len(names), -1, -1) if (q := "::".join([*names[:n], name])) in defined_in), None)
        if found and not defined_in[found] & may_know.get(module, set()):
            faults.append("%s:%d: %s may not know lrt's %s, of %s" % (path, number, module, found, ", ".join(sorted(map(str, defined_in[found])))))
    print("\n".join(faults + ["%d declarations of types, %d faults" % (len(declarations), len(faults))]))
    return 1 if faults or len(declarations) < 100 or len(defined_in) < 500 else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
