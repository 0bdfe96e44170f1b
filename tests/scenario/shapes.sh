#!/usr/bin/env bash
# Long and flat cells of cr and dg bend as they should up to 10 times as long as wide, 6 times as wide as high; beyond, a warning says
# how many there are and where the worst one is, on any number of ranks the same. Other cells and p2 have no warning.
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
  bar $ranks cr 2,2,2 >/dev/null
  line=$(grep '^supple: warning: ' err.txt)
  for text in 'body a, element cr: 48 of 48 tets' '20 times as long as wide' '10 times only' 'p2'; do
    check "$ranks ranks: '$line' does not say $text" grep -qF -- "$text" <<<"$line"
  done
  test "$ranks" = 1 && first=$line
  check "$ranks ranks: '$line', one rank: '$first'" test "$line" = "$first"
done
bar 1 dg 2,2,2 >/dev/null
check "dg: $(cat err.txt)" grep -qF 'body a, element dg: 48 of 48 tets' err.txt
bar 1 cr 20,1,8 >/dev/null
check "flat: $(cat err.txt)" grep -qF 'times as wide as high' err.txt
for cells in 40,2,2 10,2,2; do
  energy=$(bar 1 cr $cells)
  check "$cells: $(cat err.txt)" test ! -s err.txt
  check "$cells: energy $energy, of p2 $true" awk -v a="$energy" -v b="$true" 'BEGIN { exit !(a > 0.86 * b && a < 1.01 * b) }'
done
# of laws for large strains cells are verified to 2.4 times
"$supple" -bodies a -body_a_mesh box:0.4,0.1,0.1:4,4,4 -body_a_element cr -body_a_material neohookean -body_a_young 5e6 \
  -body_a_poisson 0.3 -body_a_density 1000 -effects hold -effect_hold_type fixed -effect_hold_on xmin -time static -output_fields none \
  >out.txt 2>err.txt
check "4 times: $(cat err.txt)" grep -qF '4 times as long as wide: bending is verified to 2 times only' err.txt
finish
