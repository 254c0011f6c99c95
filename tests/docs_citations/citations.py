#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What sources and documents cite exists.

    citations.py ROOT

- Each section ("SPEC 3.3") and requirement ("R0.9") that the tree cites is a heading of docs/specification.md, which has R0.1-R0.17 and R1.1-R1.12.
- Each requirement there has a test that carries it as a tag, and so has each test file that its section names.
- Each link to a file, and to a heading, in the documents for developers leads somewhere, and each path in backticks exists.
- Each name in backticks in the specification, maps and recipes occurs in the sources.
- docs/decisions/README.md lists each record, and records have the four parts that it promises. So does docs/recipes/README.md list each recipe.

A path in a line with "(new)" is one that the reader makes, and is not looked for.
"""
import os
import re
import sys

CITED = re.compile(r"\bSPEC (?:section )?(\d+(?:\.\d+)*)")
REQUIREMENT = re.compile(r"\bR([01])\.(\d+)\b")
REQUIREMENTS = {f"R0.{n}" for n in range(1, 18)} | {f"R1.{n}" for n in range(1, 13)}
FOLDERS = ("include", "src", "tests", "examples", "tools", "docs")
FILES = ("README.md", "SECURITY.md", "CHANGELOG.md", "CONTRIBUTING.md")
SUFFIXES = (".cpp", ".hpp", ".h", ".py", ".md", ".txt", ".ttl", ".cmake", ".in", ".sh", ".js", ".mjs", ".html", ".java")
TOP = {"include", "src", "tests", "examples", "tools", "docs", "cmake", "vendor", ".ci"}


def read(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def sources(root):
    for folder in FOLDERS:
        for place, folders, names in os.walk(os.path.join(root, folder)):
            folders[:] = [f for f in folders if f not in ("corpus", "node_modules", "__pycache__")]
            for name in names:
                if name.endswith(SUFFIXES):
                    yield os.path.relpath(os.path.join(place, name), root)
    for name in FILES:
        if os.path.exists(os.path.join(root, name)):
            yield name


def lines_outside_code(text):
    """The lines of a Markdown document with their numbers, without fenced blocks."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


def headings(text):
    return [re.sub(r"[`*]", "", line.lstrip("#").strip()) for _, line in lines_outside_code(text) if re.match(r"#{1,6} ", line)]


def anchors(text):
    """As GitHub and pandoc name headings: lower case, without punctuation, hyphens for spaces."""
    found = set()
    for heading in headings(text):
        heading = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)
        found.add(re.sub(r" ", "-", re.sub(r"[^\w\- ]", "", heading.lower())))
    return found


def check_citations(root, fault):
    specification = read(os.path.join(root, "docs/specification.md"))
    sections, requirements = set(), set()
    for heading in headings(specification):
        first = heading.split()[0]
        (requirements if REQUIREMENT.fullmatch(first) else sections).add(first)
    for missing in sorted(REQUIREMENTS ^ requirements):
        fault(f"docs/specification.md: expected a heading for each of R0.1-R0.17 and R1.1-R1.12; {missing} differs")
    tags, citations = set(), 0
    for path in sources(root):
        own = path == os.path.join("tests", "docs_citations", "citations.py")
        for number, line in enumerate(read(os.path.join(root, path)).splitlines(), 1):
            for found in () if own else CITED.finditer(line):
                citations += 1
                if found.group(1) not in sections:
                    fault(f"{path}:{number}: docs/specification.md has no section {found.group(1)}")
            for found in () if own else REQUIREMENT.finditer(line):
                citations += 1
                if found.group(0) not in requirements:
                    fault(f"{path}:{number}: docs/specification.md has no requirement {found.group(0)}")
                if f"[{found.group(0)}]" in line and path.startswith("tests"):
                    tags.add(found.group(0))
    for untested in sorted(requirements - tags):
        fault(f"docs/specification.md: no test has the tag [{untested}]")
    for section in re.split(r"^### ", specification, flags=re.M):
        requirement = section.split(None, 1)[0]
        named = re.findall(r"`(tests/[\w/]+\.cpp)`", section.partition("Tests:")[2]) if requirement in requirements else []
        if requirement in requirements and "Tests:" not in section:
            fault(f"docs/specification.md: {requirement} names no tests")
        for path in named:
            if os.path.exists(os.path.join(root, path)) and f"[{requirement}]" not in read(os.path.join(root, path)):
                fault(f"docs/specification.md: {path} has no test with the tag [{requirement}]")
    return citations


def documents(root):
    yield from (p for p in ("docs/specification.md", "src/README.md", "src/client/README.md", "CONTRIBUTING.md") if os.path.exists(os.path.join(root, p)))
    for folder in ("docs/decisions", "docs/recipes"):
        for name in sorted(os.listdir(os.path.join(root, folder))):
            if name.endswith(".md"):
                yield f"{folder}/{name}"


def exists(root, folder, path):
    """A path of the tree, of the document's folder, or, for documents in src/, of src/ or include/lrt/."""
    places = [root, os.path.join(root, folder)] + ([os.path.join(root, "src"), os.path.join(root, "include/lrt")] if folder.startswith("src") else [])
    return any(os.path.exists(os.path.join(place, path)) for place in places)


def check_documents(root, fault):
    links = 0
    for document in documents(root):
        folder, text = os.path.dirname(document), read(os.path.join(root, document))
        for number, line in lines_outside_code(text):
            where = f"{document}:{number}"
            for target in re.findall(r"\]\(([^)\s]+)\)", line):
                if re.match(r"[a-z]+:", target):
                    continue
                links += 1
                path, _, anchor = target.partition("#")
                file = os.path.normpath(os.path.join(root, folder, path)) if path else os.path.join(root, document)
                if not os.path.exists(file):
                    fault(f"{where}: {target} does not exist")
                elif anchor and file.endswith(".md") and anchor not in anchors(read(file)):
                    fault(f"{where}: there is no heading for {target}")
            if "(new" in line:
                continue
            for path in re.findall(r"`([\w.+-]+(?:/[\w.+-]+)*/?)`", line):
                in_tree = path.split("/")[0] in TOP and "/" in path
                in_source = folder.startswith("src") and re.fullmatch(r"[\w/]+\.(?:cpp|hpp|js|html|ttl)", path) and "/" in path
                if (in_tree or in_source) and not exists(root, folder, path):
                    fault(f"{where}: there is no {path}")
    return links


def check_names(root, fault):
    """The functions, types and options that the maps and recipes name occur in the sources."""
    words = set()
    for path in sources(root):
        if not path.endswith(".md"):
            words.update(re.findall(r"\w+", read(os.path.join(root, path))))
    for path in ("CMakeLists.txt", "cmake/LrtOptions.cmake", "src/CMakeLists.txt", "tests/CMakeLists.txt", "examples/CMakeLists.txt"):
        words.update(re.findall(r"\w+", read(os.path.join(root, path))))
    for document in documents(root):
        if document.startswith("docs/decisions") or document == "CONTRIBUTING.md":  # they speak of what is gone, and of forms of names
            continue
        for number, line in lines_outside_code(read(os.path.join(root, document))):
            if "(new" in line:
                continue
            for name in re.findall(r"`((?:[A-Za-z_]\w*::)*[A-Za-z_]\w*)(?:\(\))?`", line):
                missing = [part for part in name.split("::") if part not in words]
                if missing:
                    fault(f"{document}:{number}: the sources have no {name}")


def check_index(root, folder, parts, fault):
    index = read(os.path.join(root, folder, "README.md"))
    names = sorted(n for n in os.listdir(os.path.join(root, folder)) if n.endswith(".md") and n != "README.md")
    for name in names:
        if f"({name})" not in index:
            fault(f"{folder}/README.md: expected a link to {name}")
        text = read(os.path.join(root, folder, name))
        for part in parts:
            if part not in text:
                fault(f"{folder}/{name}: expected the part {part!r}")
    return names


def main():
    root = sys.argv[1]
    faults = []
    citations = check_citations(root, faults.append)
    links = check_documents(root, faults.append)
    check_names(root, faults.append)
    records = check_index(root, "docs/decisions", ("\nStatus: ", "\n## Context\n", "\n## Decision\n", "\n## Consequences\n"), faults.append)
    for number, name in enumerate(records, 1):
        if not name.startswith(f"{number:04}-"):
            faults.append(f"docs/decisions/{name}: expected the number {number:04}")
    recipes = check_index(root, "docs/recipes", ("\n## Files\n", "\n## Tests\n"), faults.append)
    for text in faults:
        print(text)
    print(f"{citations} citations, {links} links, {len(records)} decisions, {len(recipes)} recipes, {len(faults)} faults")
    # A check that finds nothing to check would pass for ever.
    return 1 if faults or citations < 1000 or links < 50 or len(records) < 20 or len(recipes) < 5 else 0


if __name__ == "__main__":
    sys.exit(main())
