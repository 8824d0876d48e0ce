#!/bin/sh
# Whether every C++ file is laid out as .clang-format says. `./dev format` mends what is not.
# Exit code 77 = skipped: other versions of clang-format lay out some lines differently.
set -eu
cd "$1"
formatter=
for candidate in clang-format-14 clang-format; do
  if command -v $candidate >/dev/null && $candidate --version | grep -q 'version 14\.'; then
    formatter=$candidate
    break
  fi
done
if [ -z "$formatter" ]; then
  echo "skipped: clang-format 14 is not installed"
  exit 77
fi
find apps bench examples fuzz include src tests \( -name '*.hpp' -o -name '*.cpp' \) -print0 |
  xargs -0 "$formatter" --dry-run -Werror
