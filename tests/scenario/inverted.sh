#!/usr/bin/env bash
# A bar whose ends are pushed through each other: its tets are inverted, and one line behind the run says so. A bar that is not: no such
# line.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

run() { # displacement of the end in m
  "$supple" -bodies a -body_a_mesh box:0.1,0.1,0.1:1 -body_a_material linear -body_a_young 1e5 -body_a_poisson 0.3 \
    -body_a_density 1000 -effects left,right -effect_left_type fixed -effect_left_on xmin -effect_right_type prescribed_displacement \
    -effect_right_on xmax -effect_right_displacement "$1;0;0" -time static -output_fields none -quiet >out.txt 2>err.txt
}

run -0.12
check "pushed through: exit code" test $? = 0
check "pushed through: $(cat err.txt)" grep -q 'supple: warning: 6 tetrahedra are inverted or flat at the end (det F down to -0.2)' err.txt
run -0.05
check "pushed half: exit code" test $? = 0
check "pushed half: $(cat err.txt)" test ! -s err.txt
finish
