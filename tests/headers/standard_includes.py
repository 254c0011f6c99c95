# SPDX-License-Identifier: Apache-2.0
"""A file that names something of the standard library includes its header, by itself or through files of lrt.

  standard_includes.py ROOT

Headers of the standard library include each other differently in each release of a compiler, so a missing line is found only by the next one.
Only names that stand for one header are looked up: names that several headers declare, std::size_t for instance, are left out.
"""
import os
import re
import sys
from pathlib import Path

NAMES = {  # header: what is declared there, a regular expression behind "std::"
    "algorithm": r"(sort|stable_sort|find|find_if|find_if_not|any_of|all_of|none_of|copy|copy_n|copy_if|fill|fill_n|max|min|clamp|reverse|remove_if|"
                 r"lower_bound|upper_bound|equal_range|unique|transform|count|count_if|equal|rotate|partition|stable_partition|max_element|"
                 r"min_element|mismatch|search|generate|nth_element|binary_search|is_sorted|lexicographical_compare)\s*\(",
    "array": r"array\s*<",
    "atomic": r"(atomic|memory_order)",
    "bitset": r"bitset\s*<",
    "charconv": r"(from_chars|to_chars)\b",
    "chrono": r"chrono::",
    "cmath": r"(isfinite|isnan|isinf|signbit|floor|ceil|trunc|round|lround|sqrt|pow|fmod|hypot|sin|cos)\b",
    "condition_variable": r"condition_variable\b",
    "cctype": r"(isdigit|isalpha|isalnum|isspace|isxdigit|tolower|toupper)\b",
    "cstdint": r"u?int(8|16|32|64|ptr|max|_fast\d+|_least\d+)_t\b",
    "cstdio": r"(snprintf|printf|fprintf|fopen|fclose|fputs|fflush|rename|FILE)\b",
    "cstdlib": r"(getenv|strto[a-z]+|abort|exit|_Exit|malloc)\b",
    "cstring": r"(mem(cpy|cmp|chr|set|move)|str(len|cmp|error|chr))\b",
    "deque": r"deque\s*<",
    "exception": r"(exception_ptr|current_exception|rethrow_exception|terminate)\b",
    "filesystem": r"filesystem::",
    "fstream": r"(if|of|f)stream\b",
    "functional": r"function\s*<",
    "future": r"(future|promise)\s*<",
    "initializer_list": r"initializer_list\s*<",
    "iostream": r"(cin|cout|cerr)\b",
    "limits": r"numeric_limits\s*<",
    "list": r"list\s*<",
    "map": r"(multi)?map\s*<",
    "memory": r"((unique|shared|weak)_ptr|make_(unique|shared))\b",
    "mutex": r"(mutex|lock_guard|unique_lock|scoped_lock|once_flag)\b",
    "numeric": r"(accumulate|iota)\s*\(",
    "optional": r"(optional\s*<|nullopt\b)",
    "queue": r"(priority_)?queue\s*<",
    "random": r"(mt19937|random_device|uniform_\w+_distribution)",
    "set": r"(multi)?set\s*<",
    "sstream": r"[io]?stringstream\b",
    "stdexcept": r"(runtime_error|logic_error|invalid_argument|out_of_range)\b",
    "string": r"(string|to_string)\b",
    "string_view": r"string_view\b",
    "thread": r"(thread\b|this_thread::)",
    "tuple": r"(tuple\s*<|make_tuple\b|tie\s*\()",
    "type_traits": r"(is_\w+_v|enable_if_t|decay_t|conditional_t|remove_cv\w*|void_t)\s*<",
    "unordered_map": r"unordered_map\s*<",
    "unordered_set": r"unordered_set\s*<",
    "utility": r"(exchange|pair|as_const|index_sequence)\b",
    "variant": r"(variant\s*<|visit\s*\(|get_if\s*<|monostate\b)",
    "vector": r"vector\s*<",
}
PATTERNS = {header: re.compile(r"\bstd::" + names) for header, names in NAMES.items()}
GIVES = {  # what the standard says that a header includes, and std::pair, which every container needs
    "string": {"string_view", "initializer_list", "utility"},
    "vector": {"initializer_list", "utility"}, "map": {"initializer_list", "utility"}, "unordered_map": {"initializer_list", "utility"},
    "set": {"initializer_list", "utility"}, "unordered_set": {"initializer_list", "utility"}, "deque": {"initializer_list"},
    "list": {"initializer_list"}, "algorithm": {"initializer_list", "utility"}, "memory": {"utility"}, "tuple": {"utility"},
    "utility": {"initializer_list"}, "array": {"utility"}, "filesystem": {"string", "string_view"}, "sstream": {"string"}, "fstream": {"string"},
    "iostream": {"string"}, "stdexcept": {"string", "exception"},
}
INCLUDE = re.compile(r"^\s*#\s*include\s*[<\"]([^\">]+)[\">]", re.M)
COMMENT = re.compile(r"//.*|\"(?:\\.|[^\"\\\n])*\"")

root = Path(sys.argv[1]).resolve()
known = {}


def headers_of(path):
    """The headers of the standard library and of third parties that a file includes, also through other files of lrt."""
    if path not in known:
        known[path] = found = set()
        for name in INCLUDE.findall(path.read_text()):
            own = next((p for p in (root / "include" / name, root / name, path.parent / name) if p.is_file()), None)
            found |= headers_of(Path(os.path.normpath(own))) if own else {name} | GIVES.get(name, set())
    return known[path]


files = [path for folder in ("include", "src", "tools", "examples", "tests") for path in sorted((root / folder).rglob("*.[ch]pp"))
         if "compile_fail" not in path.parts]
missing = []
for path in files:
    text = COMMENT.sub("", path.read_text())
    for header, pattern in PATTERNS.items():
        name = pattern.search(text)
        if name and header not in headers_of(path):
            missing.append("%s: %s needs #include <%s>" % (path.relative_to(root), name.group(0).rstrip("(< "), header))
print("\n".join(missing + ["%d files, %d missing includes" % (len(files), len(missing))]))
sys.exit(1 if missing or not files else 0)
