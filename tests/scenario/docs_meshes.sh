#!/usr/bin/env bash
# The commands of docs/meshes.md do what they are there for: each is run as it stands, in a folder where the repository seems to be; runs
# are made short. The one with a file that is not in the repository is left out.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh
for name in scripts scenarios tests docs; do ln -s "$top/$name" "$name"; done
ln -s "$(dirname "$supple")" bin

ncommand=0
while read -r line; do
  case $line in *liver-surface.obj*) continue ;; *bin/supple\ *) line=${line/scenarios\/hanging.opts/scenarios\/hanging.opts -ts_max_time 0.02} ;; esac
  bash -c "$line" >out.txt 2>&1 </dev/null
  check "$line: exit code $?: $(tail -n 1 out.txt)" test $? = 0
  ncommand=$((ncommand + 1))
done < <(sed -e ':a' -e '/\\$/N; s/\\\n *//; ta' docs/meshes.md | grep -E '^    (bin|scripts)/')
check "only $ncommand commands" test "$ncommand" -ge 9
check "no picture" test -s bead.png
check "no mesh at the end" test -s hung.msh -a -s fine.msh

finish
