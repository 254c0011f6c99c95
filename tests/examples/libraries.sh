#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A program loads neither libraptor nor libwebsockets: libraries.sh PROGRAM
set -eu

libraries=$(ldd "$1")
case $libraries in
  *libc.*so*) ;;
  *) echo "ldd does not show the C library of $1:" && echo "$libraries" && exit 1 ;;
esac
if echo "$libraries" | grep -E 'libraptor|libwebsockets'; then exit 1; fi
