#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The binary interface of the shared libraries: what they export, and whether a program that was linked with the last release still works.
#
#   tests/abi/check.sh FOLDER            FOLDER is a build with -DBUILD_SHARED_LIBS=ON and debug information
#   tests/abi/check.sh FOLDER --update   writes tests/abi/*.abi.xz anew, from this build: part of a release
#
# tests/abi/NAME.abi.xz is the interface of a release, by abidw. It is taken from the last tag vVERSION if that has this LRT_ABI, and otherwise from
# the tree, for example before the first release and in a copy without git. Exits with 77 if the comparison needs tools that are missing.
set -euo pipefail

here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
root=$(cd -- "$here/../.." && pwd)
if (($# < 1 || $# > 2)) || { (($# == 2)) && [[ $2 != --update ]]; }; then
  echo "usage: $0 FOLDER [--update]" >&2
  exit 2
fi
folder=$(cd -- "$1" && pwd)
update=${2:-}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

abi_of() { sed -n 's/^#define LRT_ABI \([0-9]*\)$/\1/p' "$1/include/lrt/version.hpp"; }
abi=$(abi_of "$root")
libraries=()
for name in lrt lrt_client lrt_check lrt_codegen lrt_mirror lrt_query lrt_urdf lrt_mqtt lrt_protobuf lrt_librdf lrt_ros2; do
  file=$(find "$folder/src" -name "lib$name.so.$abi" -print -quit)
  if [[ -n $file ]]; then libraries+=("$file"); else echo "lib$name.so.$abi is not in this build and is not checked"; fi
done
if ((${#libraries[@]} == 0)); then
  echo "$0: no shared libraries in $folder: configure it with -DBUILD_SHARED_LIBS=ON" >&2
  exit 1
fi

/usr/bin/python3 -B "$here/exports.py" check "${libraries[@]}"

if ! command -v abidw >/dev/null || ! command -v abidiff >/dev/null; then
  echo "skipped: the comparison with the last release needs abidiff; install abigail-tools, or run vendor/install.sh ci"
  exit 77
fi
/usr/bin/python3 -B "$here/exports.py" suppressions >"$work/internal.suppr"

# describe LIBRARY TREE OUT: its interface, as far as the public headers of TREE declare it.
describe() {
  abidw --exported-interfaces-only --headers-dir "$2/include" --suppressions "$work/internal.suppr" --drop-private-types --no-show-locs --no-corpus-path \
    --no-comp-dir-path --no-parameter-names --no-elf-needed --type-id-style hash --out-file "$3" "$1"
}

# The references: of the last release, if git knows its tag and it has this LRT_ABI; else those of the tree.
tag=
mkdir -p "$work/tag/include/lrt"
if [[ -n $update ]]; then
  echo "writing the references of $folder"
elif tag=$(git -C "$root" describe --tags --abbrev=0 --match 'v[0-9]*' 2>/dev/null) &&
  git -C "$root" show "$tag:include/lrt/version.hpp" >"$work/tag/include/lrt/version.hpp" 2>/dev/null; then
  tag_abi=$(abi_of "$work/tag")
  if [[ $tag_abi == "$abi" ]]; then
    echo "compared with $tag"
  else
    echo "compared with the references of the tree: LRT_ABI is $abi and was $tag_abi in $tag"
    tag=
  fi
else
  echo "compared with the references of the tree: git knows no tag of a release"
  tag=
fi

# reference_of NAME OUT: false if there is none.
reference_of() {
  if [[ -z $tag ]]; then
    [[ -f $here/$1.abi.xz ]] && xz -dc "$here/$1.abi.xz" >"$2"
  elif git -C "$root" cat-file -e "$tag:tests/abi/$1.abi.xz" 2>/dev/null; then
    git -C "$root" show "$tag:tests/abi/$1.abi.xz" | xz -dc >"$2"
  else
    return 1
  fi
}

status=0
for library in "${libraries[@]}"; do
  name=$(basename "$library" ".so.$abi")
  reference=$here/$name.abi.xz
  if [[ $update == --update ]]; then
    describe "$library" "$root" "$work/$name.abi"
    xz -9 --stdout "$work/$name.abi" >"$reference"
    echo "$name: written, $(stat -c %s "$reference") bytes"
    continue
  fi
  if ! reference_of "$name" "$work/$name.abi"; then
    echo "$name: new since then, nothing to keep"
    continue
  fi
  if ! grep -q "soname='$name.so.$abi'" "$work/$name.abi"; then
    echo "$name: LRT_ABI is $abi and is another one in the reference: nothing to keep"
    continue
  fi
  # Not abidiff with the library: with --headers-dir2 it overlooks new members, and without it sees the private types.
  describe "$library" "$root" "$work/$name.now.abi"
  if abidiff --no-added-syms "$work/$name.abi" "$work/$name.now.abi" >"$work/$name.diff"; then
    echo "$name: programs that were linked with the last release still work"
  else
    status=1
    cat "$work/$name.diff"
    echo "$name: programs that were linked with the last release would break."
  fi
done
if ((status != 0)); then
  echo "Either undo the change of the interface, or raise LRT_ABI in include/lrt/version.hpp together with the inline namespaces, which have its"
  echo "number, and write the change down in CHANGELOG.md. tests/abi/check.sh FOLDER --update then writes the new reference (docs/packaging.md)."
fi
exit "$status"
