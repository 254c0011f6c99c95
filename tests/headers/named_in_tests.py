# SPDX-License-Identifier: Apache-2.0
"""Each public function and method of lrt is named by a test or an example.

  named_in_tests.py ROOT

Public is what include/lrt declares, except in folders and namespaces `detail`, between `@cond internal` and `@endcond`, and in private and
protected parts of classes. Operators, constructors, destructors and friends are left out. A C++ file below tests or examples names a function
if the name is a word of its code; comments and string literals do not count. named_in_tests.txt contains the exceptions, one a line: NAME,
then the reason.
"""
import re
import sys
from pathlib import Path

INTERNAL = re.compile(r"@cond internal.*?@endcond", re.S)
COMMENT_OR_LITERAL = re.compile(r"//[^\n]*|/\*.*?\*/|R\"(\w*)\(.*?\)\1\"|\"(?:\\.|[^\"\\\n])*\"|(?<!\w)'(?:\\.|[^'\\\n])+'", re.S)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.M)
PART = re.compile(r"([{};]|\b(?:public|protected|private)\s*:(?!:))")
CLASS = re.compile(r"(?:template\s+)?(class|struct|union)\s+(?:LRT_API\s+|LRT_INTERNAL_API\s+)?(\w+)")
NAMESPACE = re.compile(r"(?:inline\s+)?namespace\b|extern\b")
NO_FUNCTION = re.compile(r"\b(?:operator|using|typedef|friend|static_assert|enum)\b")
NAME = re.compile(r"(~?\b(?!LRT_)[A-Za-z_]\w*)\s*\(")


def stripped(declaration):
    """A declaration without template arguments and attributes."""
    count = 1
    while count:  # from the innermost
        declaration, count = re.subn(r"<[^<>]*>", " ", declaration)
    return re.sub(r"\[\[.*?\]\]|\b(?:alignas|explicit|decltype|noexcept)\s*\([^()]*\)", " ", declaration).strip()


def function_in(declaration, owner):
    """The name of the function that a declaration declares, in a list; empty: it declares something else."""
    found = None if NO_FUNCTION.search(declaration) else NAME.search(stripped(declaration).split("=")[0])
    return [found.group(1)] if found and found.group(1) != owner and not found.group(1).startswith("~") else []


def functions_of(header):
    """The public functions and methods of a header."""
    found = []
    scopes = [("namespace", None, True, True)]  # kind, name of the class, whether others see it, whether they see what follows
    declaration = ""
    for part in PART.split(DIRECTIVE.sub("", COMMENT_OR_LITERAL.sub(" ", INTERNAL.sub("", header)))):
        kind, owner, visible, public = scopes[-1]
        head = stripped(declaration)
        if part == "{":
            if kind == "body" or head.count("(") > head.count(")"):  # within a body, or the default of a parameter
                scopes.append(("body", None, False, False))
            elif CLASS.match(head):
                keyword, name = CLASS.match(head).groups()
                scopes.append(("class", name, public, public and keyword != "class"))
                declaration = ""
            elif NAMESPACE.match(head):
                public = public and not re.search(r"\bdetail\b", head)
                scopes.append(("namespace", None, public, public))
                declaration = ""
            else:  # the body of a function, or the braces of a value or an enum
                found += function_in(declaration, owner) if public else []
                declaration = "" if "(" in head else declaration
                scopes.append(("body", None, False, False))
        elif part == "}":
            scopes.pop()
        elif kind == "body":
            pass
        elif part == ";":
            found += function_in(declaration, owner) if public else []
            declaration = ""
        elif part.endswith(":") and PART.fullmatch(part):
            scopes[-1] = (kind, owner, visible, visible and part.startswith("public"))
        else:
            declaration += part
    if len(scopes) != 1:
        sys.exit("expected as many '{' as '}' in:\n" + header)
    return found


root = Path(sys.argv[1]).resolve()
functions = {}  # name: headers
for path in sorted((root / "include" / "lrt").rglob("*.hpp")):
    if "detail" not in path.parts:
        for name in functions_of(path.read_text()):
            functions.setdefault(name, set()).add(str(path.relative_to(root)))
words = set()
for folder in ("tests", "examples"):
    for path in sorted((root / folder).rglob("*.[ch]pp")):
        words |= set(re.findall(r"[A-Za-z_]\w*", COMMENT_OR_LITERAL.sub(" ", path.read_text())))

wrong = []
exceptions = set()
for line in (Path(__file__).parent / "named_in_tests.txt").read_text().splitlines():
    name, _, reason = line.partition(" ")
    if name and not name.startswith("#"):
        exceptions.add(name)
        if not reason.strip():
            wrong.append("named_in_tests.txt: %s has no reason" % name)
        if name not in functions or name in words:
            wrong.append("named_in_tests.txt: %s is not needed: %s" % (name, "a test names it" if name in functions else "no header declares it"))
for name in sorted(set(functions) - words - exceptions):
    wrong.append("%s: no test names %s()" % (", ".join(sorted(functions[name])), name))
print("\n".join(wrong + ["%d public functions, %d exceptions, %d errors" % (len(functions), len(exceptions), len(wrong))]))
sys.exit(1 if wrong or not functions else 0)
