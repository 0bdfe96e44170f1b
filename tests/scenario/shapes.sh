#!/usr/bin/env bash
# Long or flat cells of cr and dg are too stiff in bending: a warning says how many, where the worst one is, and by how much, on any
# number of ranks the same; the stiffness of a bar is as it says. Cubes and p2 have no warning.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

# bar RANKS ELEMENT CELLS: bends a slender bar; prints its strain energy
bar() {
  "${mpi[@]}" "$1" "$supple" -bodies a -body_a_mesh "box:2,0.1,0.1:$3" -body_a_element "$2" -body_a_material linear -body_a_young 5e6 \
    -body_a_poisson 0.3 -body_a_density 1000 -effects hold,pull -effect_hold_type fixed -effect_hold_on xmin -effect_pull_type traction \
    -effect_pull_on xmax -effect_pull_vector '0;3;7' -time static -output_fields none >out.txt 2>err.txt
  awk -F, 'NR == 1 { for (k = 1; k <= NF; k++) if ($k == "strain") column = k } END { print $column }' out/run/history.csv
}

true=$(bar 1 p2 40,2,2)
check "p2: $(cat err.txt)" test ! -s err.txt
for ranks in 1 2 3; do
  long=$(bar $ranks cr 10,2,2)
  line=$(grep '^supple: warning: ' err.txt)
  for text in 'body a, element cr: 240 of 240 tets' '4 times as long as wide' 'by 58 %' 'by 30 %' 'p2'; do
    check "$ranks ranks: '$line' does not say $text" grep -qF -- "$text" <<<"$line"
  done
  test "$ranks" = 1 && first=$line
  check "$ranks ranks: '$line', one rank: '$first'" test "$line" = "$first"
  check "energy $long, of p2 $true" awk -v a="$long" -v b="$true" 'BEGIN { exit !(a > 0.38 * b && a < 0.44 * b) }'
done
bar 1 dg 10,2,2 >/dev/null
check "dg: $(cat err.txt)" grep -qF 'body a, element dg: 240 of 240 tets' err.txt
bar 1 cr 20,1,4 >/dev/null
check "flat: $(cat err.txt)" grep -qF 'times as wide as high' err.txt
cube=$(bar 1 cr 40,2,2)
check "cubes: $(cat err.txt)" test ! -s err.txt
check "cubes: energy $cube, of p2 $true" awk -v a="$cube" -v b="$true" 'BEGIN { exit !(a > 0.96 * b && a < 1.01 * b) }'
finish
