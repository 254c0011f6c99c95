#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""exports.py check LIBRARY...: each exported symbol has LRT_API in a public header, in the inline namespace of the ABI, or LRT_INTERNAL_API in src/.
A class that is nested in one of these inherits its visibility: it has LRT_LOCAL where it is defined, unless the header defines it. Of an archive the
symbols that a shared library would export are checked.
exports.py suppressions: for abidiff, what LRT_INTERNAL_API exports. It is no part of the ABI."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
# _ZN3lrt3rdf2v05Graph...: a function or a member; a vtable, type_info or its name; a thunk; a static of a function, and its guard.
KIND = r"^_Z(?:T[VTIS]|Thn?[0-9]+_|Tvn?[0-9]+_n?[0-9]+_|GV)?Z?N[VKRO]*3lrt"
VERSION = "v" + re.search(r"^#define LRT_ABI (\d+)$", (ROOT / "include/lrt/version.hpp").read_text(), re.M).group(1)  # the inline namespace


def parts_of(symbol):
    """["rdf", "v0", "Graph", "add"] of lrt::rdf::v0::Graph::add(); "operator" for an operator. None: it is not lrt's."""
    kind = re.match(KIND, symbol)
    if not kind:
        return None
    rest = symbol[kind.end() :]
    parts = []
    while length := re.match(r"[0-9]+", rest):
        end = length.end() + int(length.group())
        parts.append(rest[length.end() : end])
        rest = rest[end:]
    if re.match(r"[a-z]{2}", rest):
        parts.append("operator")
    return parts


def marked(folder, macro):
    """The names of classes and functions that have the macro: ("rdf", "Graph")."""
    names = set()
    for path in sorted((ROOT / folder).rglob("*.hpp")):
        if path.name == "abi.hpp":
            continue
        text = re.sub(r"^namespace [\w:]+ \{\n((class|struct) \w+;\n)+\}\n", "", path.read_text(), flags=re.M)  # forward declarations
        for use in re.finditer(r"\b" + macro + r"\b([^;{]*)", text):
            stack = []
            for opened in re.findall(r"^(?:(?:inline )?namespace([\w: ]*) \{|\}  // namespace)", text[: use.start()], re.M):
                stack.append(opened.strip().split("::")) if opened else stack.pop()
            place = [part for names_of in stack for part in names_of if part not in ("lrt", VERSION)]
            declaration = re.sub(r"^\s*(\[\[\w+\]\]\s*)*", "", use.group(1)).strip()
            found = re.match(r"([A-Za-z_]\w*)\s*(?:final)?\s*(?::[^:].*)?$", declaration, re.S)
            found = found or re.search(r"(operator)\W+\(|([A-Za-z_]\w*)\s*\(", declaration)
            names.add((*place, found.group(1) or found.group(2)))
    return names


def nested_in(symbol, known):
    """The class that is nested in a class `known`, for a member of it; None: the symbol is a member of `known` itself."""
    parts = parts_of(symbol)
    rest = [part for part in parts if part != VERSION][len(known) :]
    name = rf"{len(rest[0])}{rest[0]}" if rest else ""
    of_class = len(rest) > 1 or (rest and (re.match("_ZT[VTIS]", symbol) or re.search(name + r"[CD][0-9]", symbol)))
    return rest[0] if of_class else None


def defined_in(folder):
    """The nested classes that headers define: ("Graph", "Matches")."""
    found = set()
    for path in sorted((ROOT / folder).rglob("*.hpp")):
        text = re.sub(r"//[^\n]*|\"(?:\\.|[^\"\\\n])*\"", "", path.read_text())
        stack = []  # the names of classes; None: another scope
        opened = None
        for match in re.finditer(r"\b(?:class|struct|union)\s+(?:LRT_\w+\s+)?((?:\w+::)*\w+)(?=[^;(){}]*\{)|([{}])", text):
            if match.group(1):
                name = match.group(1).split("::")
                owner = name[-2] if len(name) > 1 else next((c for c in reversed(stack) if c), None)
                found.add((owner, name[-1]))
                opened = name[-1]
                continue
            if match.group(2) == "{":
                stack.append(opened)
                opened = None
            elif stack:
                stack.pop()
    return found


def exported(library):
    if str(library).endswith(".a"):
        out = subprocess.run(["readelf", "-sW", library], check=True, capture_output=True, text=True).stdout
        rows = [line.split() for line in out.splitlines()]
        symbols = {row[7] for row in rows if len(row) > 7 and row[4] in ("GLOBAL", "WEAK", "UNIQUE") and row[5] == "DEFAULT" and row[6] != "UND"}
        return sorted(symbol for symbol in symbols if parts_of(symbol))
    out = subprocess.run(["nm", "-D", "--defined-only", "--format=posix", library], check=True, capture_output=True, text=True).stdout
    return sorted(line.split()[0] for line in out.splitlines())


def check(libraries):
    names = {"LRT_API": marked("include", "LRT_API"), "LRT_INTERNAL_API": marked("src", "LRT_INTERNAL_API")}
    classes = {"LRT_API": defined_in("include"), "LRT_INTERNAL_API": defined_in("src")}
    bad = 0
    for library in libraries:
        symbols = exported(library)
        count = {"LRT_API": 0, "LRT_INTERNAL_API": 0}
        for symbol in symbols:
            parts = parts_of(symbol)
            known = [tuple(p for p in parts[:end] if p != VERSION) for end in range(1, len(parts) + 1)] if parts else []
            macro, owner = next(((m, k) for m in names for k in known if k in names[m]), (None, None))
            if macro == "LRT_API" and VERSION not in parts:
                macro = None
            nested = nested_in(symbol, owner) if macro else None
            if nested and (owner[-1], nested) not in classes[macro]:
                bad += 1
                print(f"{library}: {'::'.join(owner)}::{nested} has no LRT_LOCAL where it is defined ({symbol})")
                continue
            if macro:
                count[macro] += 1
                continue
            bad += 1
            why = f"has no LRT_API in a namespace {VERSION}, nor LRT_INTERNAL_API" if known else "is not lrt's"
            print(f"{library}: {subprocess.run(['c++filt', symbol], capture_output=True, text=True).stdout.strip()} {why} ({symbol})")
        print(f"{pathlib.Path(library).name}: {count['LRT_API']} symbols of LRT_API, {count['LRT_INTERNAL_API']} of LRT_INTERNAL_API")
    return 1 if bad else 0


def suppressions():
    for name in sorted(marked("src", "LRT_INTERNAL_API")):
        path = f"({len(VERSION)}{VERSION})?".join(f"{len(part)}{part}" for part in ("", *name) if part)
        symbol = f"{KIND}({len(VERSION)}{VERSION})?{path}".replace("(?:", "(")
        if len(name) == 1:
            symbol = f"{KIND}{len(VERSION)}{VERSION}{path}".replace("(?:", "(")
        for kind in ("function", "variable"):
            print(f"[suppress_{kind}]\n  symbol_name_regexp = {symbol}.*\n  drop = yes")
    return 0


if __name__ == "__main__":
    if sys.argv[1:] == ["suppressions"]:
        sys.exit(suppressions())
    if len(sys.argv) > 2 and sys.argv[1] == "check":
        sys.exit(check(sys.argv[2:]))
    sys.exit(__doc__)
