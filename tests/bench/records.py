#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What records of a user cost in the user's object file.

  records.py source RECORDS FIELDS pulled|pushed     prints a program with RECORDS writable properties, each of a struct of FIELDS fields
  records.py check COMPILER INCLUDE                  compiles such programs and compares them with the limits below
"""
import os
import re
import subprocess
import sys
import tempfile

# Bytes of text (code, constants and tables of exceptions) of 40 records of 6 fields, GCC 12, -O2.
MAX_TEXT = {"pulled": 122_000, "pushed": 155_000}
# Functions that a further record brings: of its struct, its traits and its property, none of its fields.
MAX_FUNCTIONS = {"pulled": 9, "pushed": 17}
# Of larger structs the compiler does not inline all constructors and destructors: two for each of four.
MAX_OF_FIELDS = 8

FIELDS = [
    ("double", "value", " = 0"), ("int", "count", " = 0"), ("std::string", "name", ""),
    ("bool", "on", " = false"), ("std::array<double, 3>", "axis", "{}"), (None, "last", ""),
]


def source(records, fields, kind):
    members = []
    for r in range(records):
        these = []
        for f in range(fields):
            cpp, name, value = FIELDS[f % len(FIELDS)]
            if cpp is None:
                cpp, value = ("Mode", " = Mode::off") if r % 2 else ("Point", "")
            these.append((cpp, name + (str(f // len(FIELDS)) if f >= len(FIELDS) else ""), value))
        members.append(these)
    out = ["#include <array>", "#include <string>", "", "#include <lrt/lrt.hpp>", "", "namespace robot {",
           "enum class Mode { off, slow, fast };", "struct Point {", "  double x = 0, y = 0;", "};"]
    for r, these in enumerate(members):
        out += [f"struct Part{r} {{", *(f"  {cpp} {name}{value};" for cpp, name, value in these), "};"]
    out += ["}  // namespace robot", "", "namespace lrt::rdf {", "template <>", "struct traits<robot::Mode> : Enumeration<robot::Mode> {",
            "  static void describe(Enumeration<robot::Mode>& e) {",
            '    e.name(robot::Mode::off, "off").name(robot::Mode::slow, "slow").name(robot::Mode::fast, "fast");', "  }", "};",
            "template <>", "struct traits<robot::Point> : Record<robot::Point> {", "  static void describe(Record<robot::Point>& r) {",
            '    r.field("x", &robot::Point::x);', '    r.field("y", &robot::Point::y);', "  }", "};"]
    for r, these in enumerate(members):
        part = f"robot::Part{r}"
        out += ["template <>", f"struct traits<{part}> : Record<{part}> {{", f"  static void describe(Record<{part}>& r) {{"]
        for cpp, name, _ in these:
            facets = ".unit(unit::metre).at_least(0)" if cpp == "double" else ""
            out.append(f'    r.field("{name}", &{part}::{name}){facets};')
        out += ["  }", "};"]
    out += ["}  // namespace lrt::rdf", "", "struct Robot {", *(f"  robot::Part{r} part{r};" for r in range(records)), "};",
            "lrt::Thing describe(Robot& robot);", "lrt::Thing describe(Robot& robot) {", '  lrt::Thing thing{"robot"};']
    for r in range(records):
        write = f".on_write([&robot](const robot::Part{r}& value) {{ robot.part{r} = value; }});"
        if kind == "pulled":
            out.append(f'  thing.property("part{r}", [&robot] {{ return robot.part{r}; }}){write}')
        else:
            out += [f'  auto part{r} = thing.property<robot::Part{r}>("part{r}");', f"  part{r}{write}", f"  part{r}.publish(robot.part{r});"]
    return "\n".join([*out, "  return thing;", "}", ""])


def compiled(compiler, include, records, fields, kind):
    """Bytes of text and number of functions."""
    with tempfile.TemporaryDirectory() as work:
        with open(f"{work}/records.cpp", "w") as file:
            file.write(source(records, fields, kind))
        subprocess.run([compiler, "-std=c++17", "-O2", f"-I{include}", "-c", "records.cpp", "-o", "records.o"], cwd=work, check=True)
        text = int(subprocess.check_output(["size", "records.o"], cwd=work, text=True).splitlines()[1].split()[0])
        symbols = subprocess.check_output(["nm", "--defined-only", "records.o"], cwd=work, text=True).splitlines()
        names = [line.split()[-1] for line in symbols if re.match(r"[0-9a-f]+ [tTwW] ", line)]
        return text, len({re.sub(r"\.(cold|constprop|part|isra).*", "", name) for name in names})


def check(compiler, include):
    if "clang" in subprocess.check_output([compiler, "--version"], text=True):
        print("skipped: the limits are those of GCC")
        return 77
    failures = 0
    for kind in ("pulled", "pushed"):
        text, functions = compiled(compiler, include, 40, 6, kind)
        _, of_four = compiled(compiler, include, 4, 6, kind)
        _, with_twice_the_fields = compiled(compiler, include, 4, 12, kind)
        of_a_record = (functions - of_four) / 36
        print(f"{kind}: 40 records of 6 fields: {text} bytes of text, {functions} functions, {of_a_record:.1f} for each further record; "
              f"4 records of 6 fields: {of_four} functions, of 12 fields: {with_twice_the_fields}")
        for found, limit, what in ((text, MAX_TEXT[kind], "bytes of text of 40 records"),
                                   (of_a_record, MAX_FUNCTIONS[kind], "functions of a further record"),
                                   (with_twice_the_fields - of_four, MAX_OF_FIELDS, "functions of 24 further fields")):
            if found > limit:
                print(f"{kind}: {what}: found {found}, expected at most {limit}", file=sys.stderr)
                failures += 1
    return min(failures, 1)


if len(sys.argv) == 5 and sys.argv[1] == "source":
    print(source(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]), end="")
elif len(sys.argv) == 4 and sys.argv[1] == "check":
    sys.exit(check(sys.argv[2], os.path.abspath(sys.argv[3])))
else:
    sys.exit(__doc__)
