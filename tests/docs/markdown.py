# SPDX-License-Identifier: Apache-2.0
"""The Markdown pages of the tree: where they are, and their blocks of code."""
import re


def pages(root):
    skipped = {"build", ".git", "node_modules"}
    for path in sorted(root.rglob("*.md")):
        if not skipped.intersection(path.relative_to(root).parts[:-1]):
            yield path


def split(text):
    """The lines of a page with their numbers: those of prose, and blocks as (first line, language, comment before it, lines)."""
    prose, blocks, comment, block = [], [], "", None
    for number, line in enumerate(text.split("\n"), 1):
        fence = re.match(r"^ {0,3}```+\s*([\w+-]*)", line)
        if block is not None:
            if fence and not fence.group(1):
                blocks.append(tuple(block))
                block = None
            else:
                block[3].append(line)
        elif fence:
            block = [number, fence.group(1), comment, []]
            comment = ""
        else:
            found = re.match(r"^<!--\s*(.*?)\s*-->$", line.strip())
            if found:
                comment = found.group(1)
            elif line.strip():
                comment = ""
            prose.append((number, line))
    if block is not None:
        blocks.append(tuple(block))
    return prose, blocks


def is_cpp(block):
    return block[1] in ("cpp", "c++", "C++")
