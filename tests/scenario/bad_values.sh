#!/usr/bin/env bash
# Values that go bad while a run goes on: each is an error that names the option and the time or the place.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

cat >block.opts <<'END2'
-bodies block
-body_block_mesh box:0.1,0.1,0.1:1
-body_block_material stable_neohookean
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

# an explicit run beyond its stable step ends before its numbers overflow
error 2 "step|stable" block.opts -time euler_symplectic -ts_dt 0.01 -ts_max_time 1 -body_block_velocity "x^2;0;0" -output_dir wild
check "a number that is not finite in wild/history.csv" test "$(grep -ciE 'nan|inf[^o]' <(tail -n +3 wild/history.csv))" = 0

# coordinates whose squares overflow
for size in 1e16 1e154 1e170; do
  sed "s/^0 0 1$/0 0 $size/" tet.off >huge.off
  printf 'solid a\n%s\nendsolid a\n' "$(for k in 1 2 3 4; do printf 'facet normal 0 0 0\nouter loop\nvertex 0 0 %s\nvertex 1 0 %s\nvertex 0 1 0\nendloop\nendfacet\n' "$size" "$k"; done)" >huge.stl
  printf '4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 %s\n' "$size" >huge.node
  printf '1 4 0\n1 1 2 3 4\n' >huge.ele
  for file in huge.off huge.stl huge.node; do error 1 "$file|1e+15 m" block.opts -body_block_mesh $file; done
  error 1 "huge.off|1e+15 m" block.opts "${plate[@]}" -effect_plate_response penalty -effect_plate_obstacle mesh:huge.off
done

# option files: one that names itself, two that name each other, more options than PETSc holds
printf -- '-options_file self.opts\n' >self.opts
printf -- '-options_file second.opts\n' >first.opts
printf 'options_file: first.opts\n' >second.yml
printf -- '-options_file first.opts\n' >second.opts
error 1 "self.opts|-options_file" self.opts
error 2 "first.opts|-options_file" first.opts
error 1 "first.opts|-options_file" block.opts -options_file first.opts
error 1 "second.yml|-options_file" second.yml
for k in $(seq 560); do echo "-body_b${k}_young 1"; done >many.opts
"${mpi[@]}" 1 "$supple" many.opts -version >out.txt 2>err.txt || check "many.opts: $(cat err.txt)" grep -qF -- "-body_default_" err.txt

# lines of tables and copies: whole, without zero bytes and lone carriage returns
{ printf '0 0 0 #'; printf 'x%.0s' $(seq 2000); printf ' 5 5 5\n1 0 0\n'; } >long.txt
"${mpi[@]}" 1 "$supple" block.opts -body_block_copies long.txt -output_history_bodies yes -output_dir long >out.txt 2>&1
code=$?
check "long.txt: $(cat out.txt)" test $code = 0
check "two copies in long.txt" grep -q ',block2_kinetic,' long/history.csv
check "no third copy in long.txt" test "$(grep -c ',block3_kinetic,' long/history.csv)" = 0
printf '0 0 0\r1 1 1\r2 2 2' >cr.txt
printf '0 0 0\n1 0 0\0 5\n' >zero.txt
error 1 "-body_block_copies|cr.txt|line 1|carriage" block.opts -body_block_copies cr.txt
error 3 "-body_block_copies|zero.txt|line 2|zero" block.opts -body_block_copies zero.txt
error 1 "-bodies|block1" block.opts -bodies block,block1 -body_block_copies "grid:2,1,1,1,1,1" -body_block1_mesh box:1,1,1:1 -body_block1_material linear -body_block1_young 1 -body_block1_poisson 0
{ printf '0 0 #'; printf 'x%.0s' $(seq 2000); printf '\n0.01 0\n'; } >long_table.txt
"${mpi[@]}" 1 "$supple" block.opts "${move[@]}" -effect_move_displacement "0;0;table:long_table.txt" >out.txt 2>&1
code=$?
check "long_table.txt: $(cat out.txt)" test $code = 0
printf '0 0\r1 1\r' >cr_table.txt
error 1 "-effect_move_displacement|cr_table.txt|line 1|carriage" block.opts "${move[@]}" -effect_move_displacement "0;0;table:cr_table.txt"

# what is said: warns NAMES ARGUMENT...: one line of a run that succeeds names all of NAMES
warns() {
  local line name code
  local -a names
  IFS='|' read -ra names <<<"$1"
  shift
  "${mpi[@]}" 2 "$supple" "$@" >out.txt 2>err.txt
  code=$?
  check "$*: exit code $code, $(cat err.txt)" test $code = 0
  line=$(grep -F -- "${names[0]}" err.txt)
  check "$*: '$line' is not one warning" test "$(grep -c '^supple: warning: ' <<<"$line")" = 1
  for name in "${names[@]}"; do check "$*: '$line' does not name $name" grep -qF -- "$name" <<<"$line"; done
}
warns "-effect_damp_alpha|-effect_damp_beta" block.opts -effects damp -effect_damp_type damping
warns "-body_block_poisson|0.4999|p2" block.opts -body_block_poisson 0.4999
warns "-body_block_poisson|-0.95" block.opts -body_block_poisson -0.95
warns "-body_block_poisson|-0.999" block.opts -body_block_poisson -0.999 -body_block_material linear
core=(-body_block_inclusions core -sets core -set_core_at "halfspace:1,0,0,1" -inclusion_core_material linear -inclusion_core_young 1e5
  -inclusion_core_density 1000)
warns "-inclusion_core_poisson|0.4999|p2" block.opts "${core[@]}" -inclusion_core_poisson 0.4999
warns "-inclusion_core_poisson|-0.999" block.opts "${core[@]}" -inclusion_core_poisson -0.999
for name in boundary all; do
  # shellcheck disable=SC2016 # gmsh's own
  printf '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 "%s"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 0.1 0 0\n3 0 0.1 0\n4 0 0 0.1
$EndNodes\n$Elements\n2\n1 2 2 1 1 1 2 3\n2 4 2 2 1 1 2 3 4\n$EndElements\n' $name >named.msh
  warns "group:$name|block" block.opts -body_block_mesh named.msh "${hold[@]}" -effects hold -effect_hold_on $name
done
warns "-probe_tip_at|0.9 m" block.opts -probes tip -probe_tip_at 1,0,0
warns "-ledger_at|0.9 m" block.opts -ledger -ledger_quantity displacement -ledger_at 1,0,0

# Lines longer than any buffer: they are read whole, and counted as one.
repeat() { head -c 300000 /dev/zero | tr '\0' "$1"; } # bash takes a minute to change the letters of such a line
long=$(repeat x)
printf '# %s\n0 0 0\n1 0 0 oops\n' "$long" >copies.txt
error 2 "-body_block_copies|copies.txt|line 3" block.opts -body_block_copies copies.txt
printf '0 0 0%s\n1 0 0 oops\n' "$(repeat " ")" >copies.txt
error 2 "-body_block_copies|copies.txt|line 2" block.opts -body_block_copies copies.txt
printf '# %s\n0 0.%s\n1 1\n2\n' "$long" "$(repeat 1)" >table.txt
error 2 "-effect_gravity_time|table.txt|line 4" block.opts -effects gravity -effect_gravity_time table:table.txt
warns "-ts_max_steps|step 2|0.02 s|0.04 s" block.opts -ts_max_steps 2 -output_dir cut
check "cut/run.json: $(tail -n 3 cut/run.json)" grep -q '"status": "cut short"' cut/run.json
"${mpi[@]}" 1 "$supple" block.opts -ts_max_steps 4 -output_dir whole >out.txt 2>&1
check "whole/run.json: $(tail -n 3 whole/run.json)" grep -q '"status": "completed"' whole/run.json
turn=(-body_block_material linear -body_block_poisson 0 -effects turn -effect_turn_type prescribed_displacement -effect_turn_on top -effect_turn_angle)
warns "-body_NAME_material linear|10 degrees" block.opts "${turn[@]}" "1500*t"
"${mpi[@]}" 2 "$supple" block.opts "${turn[@]}" "200*t" >out.txt 2>err.txt
check "8 degrees: $(cat err.txt)" test $? = 0 -a ! -s err.txt
for name in all boundary block; do
  sed "s/\"low\"/\"$name\"/" "$top/meshes/cushion.msh" >named.msh
  warns "'$name'|group:$name" block.opts -body_block_mesh named.msh -ts_max_time 0.01 -effects push -effect_push_type traction -effect_push_vector "0;0;0" -effect_push_on "$name"
done
error 1 "-probes|'a#b'" block.opts -probes "'a#b'" -probe_a#b_at 0,0,0
error 1 "-probes|tip" block.opts -probes tip,tip -probe_tip_at 0,0,0

finish
