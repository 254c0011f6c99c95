#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""exports.py check LIBRARY...: each exported symbol has LRT_API in a public header, in the inline namespace of the ABI, or LRT_INTERNAL_API in src/.
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


def exported(library):
    out = subprocess.run(["nm", "-D", "--defined-only", "--format=posix", library], check=True, capture_output=True, text=True).stdout
    return sorted(line.split()[0] for line in out.splitlines())


def check(libraries):
    names = {"LRT_API": marked("include", "LRT_API"), "LRT_INTERNAL_API": marked("src", "LRT_INTERNAL_API")}
    bad = 0
    for library in libraries:
        symbols = exported(library)
        count = {"LRT_API": 0, "LRT_INTERNAL_API": 0}
        for symbol in symbols:
            parts = parts_of(symbol)
            known = [tuple(p for p in parts[:end] if p != VERSION) for end in range(1, len(parts) + 1)] if parts else []
            macro = next((m for m in names for k in known if k in names[m]), None)
            if macro == "LRT_API" and VERSION not in parts:
                macro = None
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
