#!/usr/bin/env bash
# Five million tets from a .msh of gmsh on two ranks: both ranks together stay below 2 GiB at any time (1.2 GiB measured).
# @long
# @cpu 900
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh
tool=$(dirname "$supple")/supple-mesh
case $SB_BUILD in /*) measure=$SB_BUILD/tests/perf/mesh ;; *) measure=$top/$SB_BUILD/tests/perf/mesh ;; esac
trap 'rm -f big.msh big.msh.part' EXIT

# Kept free beside what the test takes: 0.3 GiB of disk, 2 GiB of memory.
disk=$(df -Pm . | awk 'NR == 2 { print $4 }')
memory=$(awk '/^MemAvailable/ { print int($2 / 1024) }' /proc/meminfo)
[ "$disk" -ge 1024 ] || skip "$disk MiB of disk are free, this needs 1024"
[ "$memory" -ge 5120 ] || skip "$memory MiB of memory are free, this needs 5120"

"$tool" convert box:1,1,1:94 big.msh -quiet >out.txt 2>&1
check "the mesh is not written: $(cat out.txt)" test -s big.msh
"${mpi[@]}" 2 "$measure" -mesh big.msh >out.txt 2>&1
check "exit code $?: $(tail -n 3 out.txt)" test "$(awk '$1 == "fact" && $2 == "tets" { print $3 }' out.txt)" = 4983504
peak=$(awk '$2 == "peak_rank0" || $2 == "peak_others" { sum += $4 } END { print int(sum) }' out.txt)
check "$peak MiB on both ranks, from 600 to 2048 expected" test "$peak" -ge 600 -a "$peak" -le 2048
grep -E "^sample (read|distribute|number|peak_[a-z0-9]*) " out.txt

finish
