#!/usr/bin/env bash
# Values that go bad while a run goes on: each is an error that names the option and the time or the place.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

cat >block.opts <<'END2'
-bodies block
-body_block_mesh box:0.1,0.1,0.1:1
-body_block_material neohookean
-body_block_young 1e5
-body_block_poisson 0.3
-sets top
-set_top_at plane:0,0,1,0.1
-ts_dt 0.01
-ts_max_time 0.04
-output_overwrite yes
-quiet
END2
hold=(-effect_hold_type fixed -effect_hold_on zmin)
plate=(-effects "hold,plate" "${hold[@]}" -effect_plate_type contact -effect_plate_obstacle "box:-0.1,-0.1,0.101,0.2,0.2,0.13")
pull=(-effects "hold,pull" "${hold[@]}" -effect_pull_on top -effect_pull_type)
move=(-effects "hold,move" "${hold[@]}" -effect_move_type prescribed_displacement -effect_move_on top)
cat >tet.off <<'END2'
OFF
4 4 0
-0.5 -0.5 0.101
1 -0.5 0.101
-0.5 1 0.101
0 0 1
3 0 2 1
3 0 1 3
3 1 2 3
3 2 0 3
END2

# paths of an obstacle, for each response and shape: not a number after 0.015 s
nan="sqrt(0.015-t)"
for response in penalty augmented projected multiplier barrier; do
  for obstacle in box:-0.1,-0.1,0.101,0.2,0.2,0.13 sphere:0.05,0.05,0.2,0.09 mesh:tet.off; do
    error 1 "-effect_plate_displacement|$nan|t = 0.02 s" block.opts "${plate[@]}" -effect_plate_response $response \
      -effect_plate_obstacle "$obstacle" -effect_plate_displacement "0;0;$nan"
  done
done
error 2 "-effect_plate_angle|log(0.015-t)|t = 0.02 s" block.opts "${plate[@]}" -effect_plate_response barrier -effect_plate_angle "log(0.015-t)"
error 1 "-effect_plate_displacement|1e15 m|t = 0.01 s" block.opts "${plate[@]}" -effect_plate_displacement "0;0;1e38*t"

# loads, their amplitudes, supports, tables; what depends on the place has the place
printf '0 0\n0.01 1e308\n0.011 -1e308\n' >wild.txt
error 1 "-effect_pull_vector|$nan|t = 0.02 s|x,y,z = 0" block.opts "${pull[@]}" traction -effect_pull_vector "x;0;$nan+x"
error 1 "-effect_pull_vector|1/(t-0.02)|infinite|t = 0.02 s" block.opts "${pull[@]}" point_force -effect_pull_vector "0;0;1/(t-0.02)"
error 1 "-effect_pull_density|log(x-1)|x,y,z = 0." block.opts "${pull[@]}" body_force -effect_pull_on block -effect_pull_density "log(x-1);0;0"
error 3 "-effect_pull_value|$nan|t = 0.02 s" block.opts "${pull[@]}" pressure -effect_pull_value "$nan"
error 1 "-effect_gravity_time|$nan|t = 0.02 s" block.opts "${hold[@]}" -effects hold,gravity -effect_gravity_time "$nan"
error 1 "-effect_move_displacement|$nan|t = 0.02 s" block.opts "${move[@]}" -effect_move_displacement "0;0;$nan"
error 1 "-effect_move_displacement|table:wild.txt|1e15 m|t = 0.01 s" block.opts "${move[@]}" -effect_move_displacement "0;0;table:wild.txt"
error 2 "-effect_move_angle|$nan|t = 0.02 s" block.opts "${move[@]}" -effect_move_angle "$nan"
error 1 "-effect_pull_vector|$nan|t = 0.25" block.opts -time static -static_steps 4 "${pull[@]}" traction -effect_pull_vector "0;0;$nan"
error 1 "-body_block_velocity|0/0" block.opts -body_block_velocity "0;0/0;0"
error 1 "-body_block_velocity|log(x)|infinite|x,y,z = 0" block.opts -body_block_velocity "log(x);0;0"
error 1 "-body_block_displacement|1e38*z|1e15 m" block.opts -body_block_displacement "0;0;1e38*z"
error 1 "-body_block_translate|1e38|1e15 m" block.opts -body_block_translate 0,0,1e38

finish
