#!/usr/bin/env bash
# 663,552 tets from an .h5 of supple-mesh in slabs: what a rank needs while the mesh comes in falls with the ranks (90 MiB on two, 49 on four measured, 115 when rank 0 reads).
# @cpu 120
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh
tool=$(dirname "$supple")/supple-mesh
case $SB_BUILD in /*) measure=$SB_BUILD/tests/perf/mesh ;; *) measure=$top/$SB_BUILD/tests/perf/mesh ;; esac
trap 'rm -f slab.h5 slab.xmf' EXIT

# Largest peak of a rank, KiB, on so many ranks.
peak() {
  "${mpi[@]}" "$1" "$measure" -mesh slab.h5 "${@:2}" >out.txt 2>&1
  check "exit code $?: $(tail -n 3 out.txt)" test "$(awk '$1 == "fact" && $2 == "tets" { print $3 }' out.txt)" = 663552
  most=$(awk '$2 == "peak_rank0" || $2 == "peak_others" { if ($4 > most) most = $4 } END { print int(1024 * most) }' out.txt)
}

"$tool" convert box:1,1,1:48 slab.h5 -quiet >out.txt 2>&1
check "the mesh is not written: $(cat out.txt)" test -s slab.h5
peak 4
whole=$most
peak 2 -slabs
two=$most
peak 4 -slabs
echo "KiB: rank 0 alone $whole, slabs on two ranks $two, on four $most"
check "four ranks take $most KiB each, two $two" test "$((10 * most))" -le "$((8 * two))"
check "four ranks take $most KiB each in slabs, rank 0 alone $whole" test "$((10 * most))" -le "$((7 * whole))"

finish
