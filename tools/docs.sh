#!/usr/bin/env bash
# Writes docs/parameters_<node>.md from the Params structs (the programs' --print-markdown), and the
# headers' pages with doxygen, if it is there, to out/doxygen; a warning of doxygen's fails. Usage: tools/docs.sh
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
use_workspace
for node in gp_localize vector_field_slam gmrf_slap; do
  file=docs/parameters_$node.md
  table=$(rosrun $node ${node}_replay --print-markdown)
  printf '# Parameters of %s\n\n%s\n\n%s\n' $node \
    "Written by \`tools/docs.sh\` from the \`Params\` structs; \`NAME\` and \`NUMBER\` stand for the user's own." \
    "$table" >"$file"
  note "$file"
done
if command -v doxygen >/dev/null; then
  mkdir -p out/doxygen
  # By its whole path: each package has a README.md.
  { cat docs/Doxyfile; echo "USE_MDFILE_AS_MAINPAGE = $root/README.md"; } | doxygen -
  note "out/doxygen/html/index.html"
else
  echo "docs.sh: doxygen is missing, the headers' pages are left out; apt-get install doxygen" >&2
fi
