#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""letter_case_test.py RUN_QUERY: UCASE and LCASE of every character of Unicode are what Python's str.upper() and str.lower() are."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unicodedata

TABLE = pathlib.Path(__file__).parents[2] / "src/query/letter_case_table.hpp"
WORDS = ["ΟΔΟΣ ΣΟΦΟΣ", "Α'Σ", "ΑΣ'Α", "Α\u0301Σ\u0301 Σ", "ΣΣΣ", "aΣ.b", "aΣ-", "1Σ", "ΑΣ" + "'" * 50 + "Α", "straße ﬃ ŉ İ"]


def literal(text):
    return '"' + "".join(f"\\U{ord(c):08X}" if c < " " or c in '"\\' else c for c in text) + '"'


def main():
    texts = list(WORDS)
    for first in range(0, 0x110000, 0x400):
        texts.append("|".join(chr(c) for c in range(first, first + 0x400) if not 0xD800 <= c < 0xE000))
        texts.append("|".join("a" + chr(c) + "Σ" for c in range(first, min(first + 0x400, 0x30000)) if not 0xD800 <= c < 0xE000))
    known = TABLE.read_text().split("Unicode ")[1].split(",")[0]
    newer, wrong, compared = 0, [], 0
    with tempfile.TemporaryDirectory() as folder, subprocess.Popen([sys.argv[1]], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as run:
        for i, text in enumerate(filter(None, texts)):
            file = pathlib.Path(folder) / f"{i}.rq"
            file.write_text(f"SELECT (UCASE({literal(text)}) AS ?u) (LCASE({literal(text)}) AS ?l) {{}}", encoding="utf-8", newline="\n")
            run.stdin.write(f"{file}\thttp://example.org/\n".encode())
            run.stdin.flush()
            kind, size = run.stdout.readline().split()
            answer = run.stdout.read(int(size) + 1)
            assert kind == b"json", answer
            row = json.loads(answer)["results"]["bindings"][0]
            for found, wanted in ((row["u"]["value"], text.upper()), (row["l"]["value"], text.lower())):
                if i < len(WORDS):
                    parts = [(text, found, wanted)]
                else:
                    parts = list(zip(text.split("|"), found.split("|"), wanted.split("|"), strict=True))
                compared += len(parts)
                for part in parts:
                    if part[1] == part[2]:
                        continue
                    if known != unicodedata.unidata_version:
                        newer += 1
                    else:
                        wrong.append(part)
        run.stdin.close()
    assert not wrong, f"{len(wrong)} differ, such as {wrong[:5]}"
    if known != unicodedata.unidata_version:
        print(f"The table is of Unicode {known}, this Python has {unicodedata.unidata_version}: {newer} texts differ")
    assert newer < 500, "more differ than two versions of Unicode do"
    assert compared > 2_000_000, compared
    print(f"{compared} texts compared")


main()
