#!/bin/sh
# Write the tested versions of a set of extras, with the hashes of their files.
# tools/lock.sh UV OUTPUT EXTRA...
set -eu
uv=$1 output=$2
shift 2
for extra in "$@"; do
  set -- "$@" --extra "$extra"
  shift
done
partial=$output.partial
{
  echo "# Made by \`make lock\` from pyproject.toml and constraints.txt; change these, not this."
  "$uv" pip compile --quiet --universal --generate-hashes --no-header --no-annotate \
    --python-version 3.11 --constraint constraints.txt "$@" pyproject.toml
} > "$partial"
mv "$partial" "$output"
