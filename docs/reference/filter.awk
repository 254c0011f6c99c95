# SPDX-License-Identifier: Apache-2.0
# What doxygen reads instead of a header, line for line, so that its line numbers are the header's:
#   - without the inline namespace of the ABI, which users do not write;
#   - with a sentence for members that need none in the header: moves and copies, and what each specialisation of rdf::traits has;
#   - with comments behind a member closed, because doxygen would add the next member's comment to them;
#   - with `@par Threads` as a heading and the rest of the line as its text;
#   - with the terms of the vocabularies, which a macro declares.
function documented() { return (previous ~ /^ *\/\/\/ / && previous !~ /@}/) || grouped }
function describe(text) { sub(/[^ ]/, "/** " text " */ &") }

{ line = $0 }
/ \/\/\/< / && !/\*\// { sub(/\/\/\/< /, "/**< "); $0 = $0 " */" }
/^ *\/\/\/ @\{/ { grouped = 1 }
/^ *\/\/\/ @\}/ { grouped = 0 }
/^inline namespace v[0-9]+ \{$/ || /^}  \/\/ namespace v[0-9]+$/ { $0 = "" }

match($0, /@par [A-Z][a-z]+ +/) {
  split(substr($0, RSTART, RLENGTH), word, " ")
  $0 = substr($0, 1, RSTART - 1) "@heading{" word[2] "} " substr($0, RSTART + RLENGTH)
}

/^  +[A-Za-z]+\([A-Za-z]+&&( [a-z]+)?\)/ && !documented() { describe("Moves. The moved-from object may only be assigned or destroyed.") }
/^  +[A-Za-z]+& operator=\([A-Za-z]+&&( [a-z]+)?\)/ && !documented() { describe("Moves. The moved-from object may only be assigned or destroyed.") }
/^  +[A-Za-z]+\(const [A-Za-z]+&( [a-z]+)?\);/ && !documented() { describe("Copies.") }
/^  +[A-Za-z]+& operator=\(const [A-Za-z]+&( [a-z]+)?\);/ && !documented() { describe("Copies.") }

/^  using Sentence =/ { describe("Makes the static_assert that says what to write.") }
/^(struct|class) / { in_traits = /^struct traits</ || /^class (Record|Enumeration|Variant) / }
in_traits && /^  using [A-Z][a-z]* =/ && !/Sentence/ && !documented() { describe("The C++ type, or a part of it.") }
in_traits && /^  static const Type& type\(/ && !documented() { describe("Structure of the values, see rdf::traits.") }
in_traits && /^  static Value encode\(/ && !documented() { describe("Converts a value for its representations, see rdf::traits.") }
in_traits && /^  static Result<.*> decode\(/ && !documented() { describe("Converts a value from a client, see rdf::traits.") }
in_traits && /^  static bool runs_user_code\(/ && !documented() { describe("Whether user code takes part in encode().") }
in_traits && /^  static bool same\(/ && !documented() { describe("Whether two values have the same representations, see rdf::traits.") }

/^#define LRT_VOCAB_/ { vocabulary = $3; gsub(/"/, "", vocabulary) }
/^namespace [a-z_]+ \{$/ && vocabulary != "" { describe("Terms of <" vocabulary ">.") }
/^LRT_TERM\(/ {
  split($0, part, /[(,) ]+/)
  $0 = "/** <" vocabulary part[3] "> */ inline constexpr Iri " part[3] "{\"" vocabulary part[3] "\"};"
}
/^LRT_TERM_AS\(/ {
  split($0, part, /[(,) "]+/)
  $0 = "/** <" vocabulary part[4] "> */ inline constexpr Iri " part[3] "{\"" vocabulary part[4] "\"};"
}

{ print }
line !~ /^ *$/ { previous = line }
