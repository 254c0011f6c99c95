# SPDX-License-Identifier: Apache-2.0
"""The Markdown pages of the tree.

  pages_test.py ROOT

- A block of C++ after `<!-- from examples/x/main.cpp -->` has lines of that file, in their order; lines between them may be left out. White space,
  #include and lines of comment do not count. The source is a file of examples/ or tests/ that a CMakeLists.txt compiles.
  `<!-- all of FILE but lines that say lesson -->`: the block is the whole program. snippets_test.py compiles all blocks.
- Each relative link leads to a file, and each #anchor to a heading.
- The comments of Thing, Server, Options and Responder open with an example, which tests/docs/snippets_headers.cpp has.
- Each table after `<!-- options of STRUCT in HEADER -->` has the options of that struct with a number or a time, and their defaults.
"""
import re
import sys
from pathlib import Path

from markdown import is_cpp, pages, split

ROOT = Path(sys.argv[1]).resolve()
problems = []


def problem(page, line, text):
    problems.append("%s:%d: %s" % (page.relative_to(ROOT), line, text))


def squeeze(text):
    return re.sub(r"\s+", "", text)


def is_compiled(path):
    """A CMakeLists.txt above the file names its directory, its name, or for snippets_x.cpp of tests/docs the x."""
    if path.suffix == ".hpp" or re.match(r"examples/t\d\d_", path.relative_to(ROOT).as_posix()):
        return True  # a header is compiled by who includes it; lessons are found by their names
    for directory in path.parents:
        lists = directory / "CMakeLists.txt"
        if lists.exists():
            words = [re.escape(path.name), re.escape(path.stem.replace("snippets_", "")), re.escape(path.parent.name)]
            return any(re.search(r"\b%s\b" % word, lists.read_text(encoding="utf-8")) for word in words)
        if directory == ROOT:
            return False


def check_snippet(page, block):
    number, _, comment, lines = block
    found = re.fullmatch(r"(from|all of) (\S+?)( but lines that say lesson)?", comment)
    if not found:
        return
    source = ROOT / found.group(2)
    if not source.is_file() or source.relative_to(ROOT).parts[0] not in ("examples", "tests"):
        problem(page, number, "%s is no file of examples/ or tests/" % found.group(2))
        return
    if not is_compiled(source):
        problem(page, number, "no CMakeLists.txt compiles %s" % found.group(2))
    text = source.read_text(encoding="utf-8")
    if found.group(3):
        text = "\n".join(line for line in text.split("\n") if "lesson" not in line)
    if found.group(1) == "all of":
        program = text[text.index("#include"):].split("\n// Output:")[0]
        if squeeze(program) != squeeze("\n".join(lines)):
            problem(page, number, "this program is not that of %s" % found.group(2))
        return
    text, at = squeeze(text), 0
    for line in map(squeeze, lines):
        if line.startswith(("//", "#include")):
            continue
        position = text.find(line, at)
        if position < 0:
            problem(page, number, "%s does not have, after the lines before: %s" % (found.group(2), line))
            return
        at = position + len(line)


def check_example(header, name):
    """The comment of a class opens with an example, which tests/docs/snippets_headers.cpp has."""
    path = ROOT / header
    found = re.search(r"((?:^///[^\n]*\n)+)(?:class|struct)(?: LRT_API)? %s\b[^;{]*\{" % name, path.read_text(encoding="utf-8"), re.M)
    lines = found.group(1).split("\n") if found else []
    paragraphs = "\n".join(line[3:] for line in lines).strip("\n").split("\n\n")
    code = next((text for text in paragraphs[:3] if text.startswith("     ")), "")
    if not code:
        problem(path, 1, "the comment of %s does not open with an example" % name)
    elif squeeze(code) not in squeeze((ROOT / "tests/docs/snippets_headers.cpp").read_text(encoding="utf-8")):
        problem(path, 1, "tests/docs/snippets_headers.cpp does not have the example of %s" % name)


def slug(heading):
    heading = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    heading = re.sub(r"[^\w\- ]", "", heading.strip().lower())
    return heading.replace(" ", "-")


def anchors(path):
    if path.suffix != ".md":
        return set()
    found, seen = set(), {}
    prose, _ = split(path.read_text(encoding="utf-8"))
    for _, line in prose:
        heading = re.match(r"^#{1,6}\s+(.*?)\s*#*$", line)
        if heading:
            name = slug(heading.group(1))
            count = seen.get(name, 0)
            seen[name] = count + 1
            found.add(name if count == 0 else "%s-%d" % (name, count))
        found.update(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", line))
    return found


def check_links(page, prose):
    count = 0
    for number, line in prose:
        line = re.sub(r"(`+)(?:(?!\1).)*\1", lambda code: "x" * len(code.group(0)), line)
        for target in re.findall(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)", line):
            if re.match(r"[a-z][a-z0-9+.-]*:", target):
                continue
            count += 1
            name, _, anchor = target.partition("#")
            path = (page.parent / name).resolve() if name else page
            if not path.exists():
                problem(page, number, "the link %s leads nowhere" % target)
            elif anchor and anchor not in anchors(path):
                problem(page, number, "%s has no heading for #%s" % (path.relative_to(ROOT), anchor))
    return count


UNITS = {"nanoseconds": 1e-9, "microseconds": 1e-6, "milliseconds": 1e-3, "seconds": 1.0, "minutes": 60.0, "hours": 3600.0}


def members(header, struct):
    """The members of a struct: a name and its default, ("s", seconds), ("n", number) or None."""
    text = (ROOT / header).read_text(encoding="utf-8")
    found = re.search(r"struct %s\b[^;{]*\{" % re.escape(struct.split("::")[-1]), text)
    if not found:
        return None
    depth, end = 1, found.end()
    while depth:
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        end += 1
    body = re.sub(r"//[^\n]*", "", text[found.end():end - 1])
    result = {}
    for kind, name, value in re.findall(r"([\w:<>]+)\s+(\w+)\s*((?:=[^;{}]+|\{[^;{}]*\})?);", body):
        value = value.strip().strip("={}").strip().replace("'", "")
        duration = re.search(r"chrono::(\w+)", kind)
        numeric = re.fullmatch(r"[\d.*\s]+", value) is not None
        if not numeric:
            result[name] = None
        elif duration:
            result[name] = ("s", eval(value) * UNITS[duration.group(1)])
        else:
            result[name] = ("n", float(eval(value)))
    return result


def stated(cell):
    """The default in a cell of a table: "16 KiB", "2,048", "0.5 s"; None: it is a text."""
    found = re.fullmatch(r"([\d.,]+)(?: (KiB|MiB|GiB|us|ms|s|min|h))?", cell)
    if not found:
        return None
    number = float(found.group(1).replace(",", ""))
    unit = found.group(2)
    if unit in ("KiB", "MiB", "GiB"):
        return ("n", number * 1024 ** (["KiB", "MiB", "GiB"].index(unit) + 1))
    if unit:
        return ("s", number * {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}[unit])
    return ("n", number)


def check_options(page, prose):
    count = 0
    for index, (number, line) in enumerate(prose):
        marker = re.match(r"<!-- options of (\S+) in (\S+) -->", line)
        if not marker:
            continue
        options = members(marker.group(2), marker.group(1))
        if options is None:
            problem(page, number, "%s has no struct %s" % (marker.group(2), marker.group(1)))
            continue
        listed = set()
        for row_number, row in prose[index + 1:]:
            if not row.startswith("|"):
                if listed:
                    break
                continue
            cells = [cell.strip() for cell in row.strip("|").split("|")]
            name = re.match(r"`(\w+)`", cells[0])
            if not name:
                continue
            name = name.group(1)
            listed.add(name)
            count += 1
            if name not in options:
                problem(page, row_number, "%s has no option %s" % (marker.group(1), name))
            elif options[name] is not None:
                value = stated(cells[1])
                if value is None or value[0] != options[name][0] or abs(value[1] - options[name][1]) > 1e-9:
                    problem(page, row_number, "the default of %s is %s in the header, not %s" % (name, options[name], cells[1]))
        for name, value in options.items():
            if value is not None and name not in listed:
                problem(page, number, "the option %s of %s is missing" % (name, marker.group(1)))
    return count


snippets = links = options = 0
for page in pages(ROOT):
    prose, blocks = split(page.read_text(encoding="utf-8"))
    for block in blocks:
        if is_cpp(block):
            snippets += 1
            check_snippet(page, block)
    links += check_links(page, prose)
    options += check_options(page, prose)
for header, name in (("thing", "Thing"), ("server", "Server"), ("options", "Options"), ("responder", "Responder")):
    check_example("include/lrt/%s.hpp" % header, name)
print("%d blocks of C++, %d links, %d options" % (snippets, links, options))
if snippets < 55 or links < 200 or options < 180:
    problems.append("expected at least 55 blocks, 200 links and 180 options: the pages have lost something, or this script does not see it")
for text in problems:
    print(text)
sys.exit(1 if problems else 0)
