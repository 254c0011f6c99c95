#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The reference builds without a warning: every public member is documented, and every link resolves. Also: the check itself would find an
# undocumented member, the output shows neither the inline namespace of the ABI nor detail namespaces, and docs/reference/README.md names every header.
#
#   check.sh ROOT    77: doxygen is missing
set -eu

root=$1
if ! command -v doxygen >/dev/null; then
  echo "skipped: doxygen is not installed (vendor/install.sh ci)"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$root"
faults=0
fault() {
  echo "$1"
  faults=$((faults + 1))
}

# build NAME INPUT...: the configuration with XML instead of HTML; its warnings in NAME.warnings
build() {
  name=$1
  shift
  mkdir "$work/$name"
  {
    cat docs/reference/Doxyfile
    echo "OUTPUT_DIRECTORY = $work/$name"
    echo "GENERATE_HTML = NO"
    echo "GENERATE_XML = YES"
    echo "XML_PROGRAMLISTING = NO"
    echo "WARN_LOGFILE = $work/$name.warnings"
    [ $# -eq 0 ] || echo "INPUT = $*"
  } >"$work/$name.doxyfile"
  doxygen "$work/$name.doxyfile" >"$work/$name.log" 2>&1 || fault "doxygen failed: $(cat "$work/$name.log")"
}

build reference
if [ -s "$work/reference.warnings" ]; then
  sed "s|^$PWD/||" "$work/reference.warnings"
  fault "the reference has $(grep -c 'warning:' "$work/reference.warnings") warnings"
fi
classes=$(grep -c 'kind="\(class\|struct\)"' "$work/reference/xml/index.xml")
[ "$classes" -ge 150 ] || fault "expected at least 150 classes in the reference, found $classes"
for name in lrt::Server lrt::model::PropertyHandle lrt::ActionPolicy lrt::rdf::traits lrt::vocab::hybrit lrt::http::Request; do
  grep -q "<name>$name<" "$work/reference/xml/index.xml" || fault "the reference does not have $name"
done
if grep -E '<compound.*<name>lrt(::.*)?::(v[0-9]+|detail)(::|<)' "$work/reference/xml/index.xml"; then fault "names that users do not write are in the reference"; fi

cat >"$work/probe.hpp" <<'PROBE'
/// A class.
class Probe {
 public:
  void undocumented();
};
PROBE
build probe "$work/probe.hpp"
grep -q 'undocumented.*is not documented' "$work/probe.warnings" || fault "the check does not find an undocumented member"

for header in include/lrt/*.hpp include/lrt/*/; do
  name=lrt/${header#include/lrt/}
  grep -qF "\`$name\`" docs/reference/README.md || fault "docs/reference/README.md does not name $name"
done

echo "doxygen $(doxygen --version): $classes classes, $faults faults"
[ "$faults" -eq 0 ]
