# SPDX-License-Identifier: Apache-2.0
"""The types that a program sees after `#include <lrt/lrt.hpp>` are those of newcomer.txt, so that a further one is a decision.

  newcomer.py ROOT

Counted are the classes, structs, enums and aliases that the headers define in namespaces, except in folders and namespaces `detail` and between
`@cond internal` and `@endcond`. A forward declaration does not count, nor does a type within a class, which is a detail of that class, nor a specialisation.
"""
import re
import sys
from pathlib import Path

INTERNAL = re.compile(r"@cond internal.*?@endcond", re.S)
COMMENT_OR_LITERAL = re.compile(r"//[^\n]*|/\*.*?\*/|R\"(\w*)\(.*?\)\1\"|\"(?:\\.|[^\"\\\n])*\"|(?<!\w)'(?:\\.|[^'\\\n])+'", re.S)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.M)
TYPE = re.compile(r"\b(class|struct|union|enum(?: class| struct)?)\s+(?:LRT_API\s+|LRT_INTERNAL_API\s+|\[\[[^]]*\]\]\s*)?(\w+)\s*(?:final\s*)?(?::[^:]|$)")
ALIAS = re.compile(r"\busing\s+(\w+)\s*=")
NAMESPACE = re.compile(r"^\s*(inline\s+)?namespace\s*([\w:]*)\s*$")


def without_arguments(text):
    count = 1
    while count:  # from the innermost
        text, count = re.subn(r"<[^<>]*>", " ", text)
    return text


def types_of(header):
    """The types that a header defines, with their namespaces below lrt: "rdf::Graph"."""
    found = []
    scopes = []  # the name of a namespace; None: another scope
    statement = ""
    for part in re.split(r"([{};])", DIRECTIVE.sub("", COMMENT_OR_LITERAL.sub(" ", INTERNAL.sub("", header)))):
        if part not in ("{", "}", ";"):
            statement += part
            continue
        head = without_arguments(statement)
        in_namespace = None not in scopes
        place = [name for scope in scopes if scope for name in scope.split("::")]
        public = in_namespace and "detail" not in place
        names = [name for name in place if name not in ("lrt",) and not re.fullmatch(r"v\d+", name)]
        if part == "{":
            namespace, defined = NAMESPACE.match(head), TYPE.search(re.sub(r"^.*\btemplate\b", "", head.strip()))
            if namespace and in_namespace:
                scopes.append(namespace.group(2))
            else:
                # traits<...>: a specialisation has arguments after its name
                if public and defined and "(" not in head and not re.search(r"\b(?:class|struct)\s+(?:LRT_API\s+)?%s\s*<" % defined.group(2), statement):
                    found.append("::".join(names + [defined.group(2)]))
                scopes.append(None)
            statement = ""
        elif part == "}":
            scopes.pop()
            statement = ""
        else:
            alias = ALIAS.search(head)
            if public and alias:
                found.append("::".join(names + [alias.group(1)]))
            statement = ""
    return found


root = Path(sys.argv[1]).resolve()
include = root / "include"
seen, types = [], {}
waiting = ["lrt/lrt.hpp"]
while waiting:
    header = waiting.pop()
    if header in seen:
        continue
    seen.append(header)
    text = (include / header).read_text()
    waiting += re.findall(r"^#include <(lrt/[^>]+)>", text, re.M)
    for name in types_of(text) if "/detail/" not in header else ():
        types.setdefault(name, header)

allowed = [line.split("#")[0].strip() for line in (Path(__file__).parent / "newcomer.txt").read_text().splitlines()]
allowed = [name for name in allowed if name]
wrong = ["include/%s: %s is not in newcomer.txt: a program that includes lrt/lrt.hpp sees it. Declare it in a header that lrt.hpp does not include, "
         "or add it to the list with its reason in the commit" % (types[name], name) for name in sorted(set(types) - set(allowed))]
wrong += ["newcomer.txt: %s is not seen after including lrt/lrt.hpp" % name for name in allowed if name not in types]
print("\n".join(wrong + ["%d headers, %d types, %d errors" % (len(seen), len(types), len(wrong))]))
sys.exit(1 if wrong or not types else 0)
