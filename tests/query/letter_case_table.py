#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""letter_case_table.py: prints src/query/letter_case_table.hpp, from what this Python knows of Unicode."""
import sys
import unicodedata

SCALARS = [c for c in range(0x110000) if not 0xD800 <= c < 0xE000]


def ranges(points):
    """[first, last] of neighbours."""
    found = []
    for c in points:
        if found and found[-1][1] == c - 1:
            found[-1][1] = c
        else:
            found.append([c, c])
    return found


def runs(mapping):
    """[first, last, step, distance]: characters at equal steps, of 1 or 2, whose other case is at one distance."""
    found = []
    for c, other in sorted(mapping.items()):
        if found:
            run = found[-1]
            step = c - run[1]
            if other - c == run[3] and step in (1, 2) and (run[0] == run[1] or step == run[2]):
                run[1], run[2] = c, step
                continue
        found.append([c, c, 1, other - c])
    return found


def entries(items):
    """Lines of at most 150 columns."""
    line, out = " ", []
    for item in items:
        if len(line) + len(item) + 2 > 150:
            out.append(line)
            line = " "
        line += " " + item + ","
    return "\n".join(out + [line])


def table(kind, name, items):
    return f"inline constexpr {kind} {name}[] = {{\n{entries(items)}\n}};\n"


def main():
    upper, lower, upper_long, lower_long = {}, {}, {}, {}
    for c in SCALARS:
        for mapped, single, several in ((chr(c).upper(), upper, upper_long), (chr(c).lower(), lower, lower_long)):
            if len(mapped) > 1:
                several[c] = mapped
            elif ord(mapped) != c:
                single[c] = ord(mapped)
    # Of these two properties only the effect on a capital sigma shows: one before it, and one between a letter and it.
    cased = {c for c in SCALARS if (chr(c) + "Σ").lower().endswith("ς")}
    ignored = {c for c in SCALARS if c not in cased and ("a" + chr(c) + "Σ").lower().endswith("ς")}
    run = lambda r: f"{{0x{r[0]:X}, 0x{r[1]:X}, {r[2]}, {r[3]}}}"
    range_ = lambda r: f"{{0x{r[0]:X}, 0x{r[1]:X}}}"
    several = lambda one: "{0x%X, {%s}}" % (one[0], ", ".join(f"0x{ord(c):X}" for c in one[1]))
    print(f"""// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

// Written by tests/query/letter_case_table.py: Unicode {unicodedata.unidata_version}, Unicode Standard 3.13 and its SpecialCasing.txt without what depends on a language.
// clang-format off

namespace lrt::query::letter_case {{

/// Characters from `first` to `last` at equal steps, whose other case is at that distance.
struct Run {{
  char32_t first, last;
  std::int32_t step, distance;
}};
/// A character whose other case is several.
struct Several {{
  char32_t from, to[3];  ///< U+0000: no character
}};
struct Range {{
  char32_t first, last;
}};

{table("Run", "to_upper", map(run, runs(upper)))}
{table("Run", "to_lower", map(run, runs(lower)))}
{table("Several", "to_upper_several", map(several, sorted(upper_long.items())))}
{table("Several", "to_lower_several", map(several, sorted(lower_long.items())))}
/// Letters with a case, without those that are ignored, too.
{table("Range", "cased", map(range_, ranges(sorted(cased))))}
/// What may be between a letter and a sigma at the end of a word, such as an apostrophe or an accent.
{table("Range", "ignored", map(range_, ranges(sorted(ignored))))}
}}  // namespace lrt::query::letter_case""")


sys.exit(main())
