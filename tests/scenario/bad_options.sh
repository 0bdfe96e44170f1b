#!/usr/bin/env bash
# Every mistake in the options ends with one clear line, once for all ranks, a non-zero exit code and no trace.
# Also: what the command line answers (-help, -version, -scenario_view) and that a printed scenario runs again.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

cat >bar.opts <<'END'
# a bar that swings
-bodies bar
-body_bar_mesh box:0.4,0.1,0.1:6,2,2
-body_bar_material corotated
-body_bar_young 5e4          # Pa
-body_bar_poisson 0.4
-sets left
-set_left_at plane:1,0,0,0
-effects gravity,hold,pull
-effect_hold_type fixed
-effect_hold_on left
-effect_pull_type traction
-effect_pull_on xmax
-effect_pull_vector "0; 10*sin(2*pi*t); table:load.txt"
-ts_dt 0.01
-ts_max_time 0.03
END
printf '0 0\n0.02 5\n' >load.txt
cat >bar.yml <<'END'
bodies: bar
body:
  bar:
    mesh: box:0.4,0.1,0.1:6,2,2
    material: corotated
    young: 5e4
    poisson: 0.4
sets: [left]
set: {left: {at: "plane:1,0,0,0"}}
effects: [gravity, hold, pull]
effect:
  hold: {type: fixed, on: left}
  pull:
    type: traction
    on: [xmax]
    vector: 0; 10*sin(2*pi*t); table:load.txt
ts_dt: 0.01
ts_max_time: 0.03
END

# misspelt, unknown, doubled, missing
error 1 "-bodies"
error 3 "-body_bar_yuong|-body_bar_young" bar.opts -body_bar_yuong 3
error 1 "-body_bra_young|-body_bar_young" bar.opts -body_bra_young 3
error 1 "-effcts|-effects" bar.opts -effcts gravity
error 1 "-effect_pull_colour|type, on, time, vector" bar.opts -effect_pull_colour 1
error 1 "-bodies|'bar'" bar.opts -bodies bar,bar
error 1 "-body_rod_mesh" bar.opts -bodies bar,rod
error 1 "-body_bar_material|arruda_boyce, corotated, gent, guccione, holmes_mow, holzapfel_gasser_ogden, holzapfel_ogden, isochoric_neohookean, linear, mooney_rivlin, neohookean, ogden, stable_neohookean, stvk, transversely_isotropic, yeoh" -bodies bar -body_bar_mesh box:1,1,1:1
error 1 "-body_bar_material corotatd" bar.opts -body_bar_material corotatd
error 1 "effect gravty|gravity" bar.opts -effects gravty

# values
error 3 "-body_bar_young -5 Pa|(0, inf) Pa" bar.opts -body_bar_young -5
error 1 "-body_bar_young 5e4Pa" bar.opts -body_bar_young 5e4Pa
error 1 "-body_bar_young nan Pa|(0, inf) Pa" bar.opts -body_bar_young nan
error 1 "-body_bar_poisson 0.5|(-1, 0.5)" bar.opts -body_bar_poisson 0.5
error 1 "-body_bar_density 0 kg/m^3|(0, inf) kg/m^3" bar.opts -body_bar_density 0
error 1 "-ts_dt 0 s|(0, inf) s" bar.opts -ts_dt 0
error 1 "-body_bar_translate 1,2|2|3" bar.opts -body_bar_translate 1,2
error 1 "-time newmrk|newmark" bar.opts -time newmrk
error 1 "-effect_pull_vector|column 4|'2 *s'|'s'" bar.opts -effect_pull_vector "0; 0; 2 *s"
error 3 "-effect_pull_vector|nix.txt" bar.opts -effect_pull_vector "0; 0; table:nix.txt"
printf '0 0\n1 2\n1 3\n' >bad.txt
error 3 "-effect_pull_vector|bad.txt|line 3|1 s" bar.opts -effect_pull_vector "0; 0; table:bad.txt"

# files
touch rod.msh
error 3 "-body_bar_mesh rdo.msh|rod.msh" bar.opts -body_bar_mesh rdo.msh
error 3 "nix.opts" nix.opts
error 3 "nix.yml" -options_file nix.yml
printf -- '-ts_dt 0.1 0.2\n' >bad.opts
error 3 "bad.opts" bad.opts
printf 'ts_dt: 1\n  bodies: x\n' >bad.yml
error 3 "bad.yml" -options_file bad.yml
error 1 "-effects" bar.opts -effects
error 1 "'2,'" bar.opts -body_bar_translate 1, 2, 3
error 1 "'ts_dt'|-ts_dt" bar.opts ts_dt 1
error 1 "'bar.yml'|-options_file" bar.opts bar.yml
mkdir -p folder
error 1 "folder" folder
error 1 "-effect_gravity_vector 9.81|1|3 in m/s^2" bar.opts -effect_gravity_vector 9.81
error 1 "-static_steps 2.5|[1, 1000000]" bar.opts -time static -static_steps 2.5
error 1 "-time static" -bodies bar -body_bar_mesh box:1,1,1:1 -body_bar_material linear \
  -body_bar_young 1 -body_bar_poisson 0 -time static
# the path by arc length takes exact tangents, solvers for indefinite matrices, and no contact
arc="-bodies a -body_a_mesh box:1,1,1:1 -body_a_material stvk -body_a_young 1 -body_a_poisson 0 -body_a_density 1 -effects hold,push \
  -effect_hold_type fixed -effect_hold_on zmin -effect_push_type gravity -time static -static_control arc_length -output_fields none"
# shellcheck disable=SC2086
{
  error 1 "-static_control arc_length|-body_a_tangent" $arc -body_a_tangent exact_spd
  error 1 "-static_control arc_length|-solver cholmod" $arc -solver cholmod
  error 2 "-static_control arc_length|-solver cg_gamg" $arc -solver cg_gamg
  error 1 "-static_control arc_length|effect floor" $arc -effects hold,push,floor -effect_floor_type contact -effect_floor_response projected \
    -effect_floor_on zmax -effect_floor_obstacle plane:0,0,1,-1
  error 1 "-static_control arc_length|-remesh_" $arc -remesh_times 0.5
}
error 3 "/nonexistent/view.opts" bar.opts -scenario_view /nonexistent/view.opts

# a disk that fills, while a file is written or standard output
error 3 "/dev/full" bar.opts -scenario_view /dev/full
error 1 "/dev/full" -options_table /dev/full
for print in -scenario_view -options_table -version "-help all"; do
  # shellcheck disable=SC2086
  "$supple" bar.opts $print >/dev/full 2>err.txt
  code=$?
  check "$print: exit code $code on a full disk" test $code = 1
  check "$print: a full disk is not said" grep -q "^supple: error: .*standard output" err.txt
done
"$supple" -help all 2>err.txt | head -1 >out.txt
check "a reader that leaves early is an error: $(cat err.txt)" test "${PIPESTATUS[0]} $(wc -c <err.txt)" = "0 0"

# a PETSc option that nobody reads is reported loudly, but the run goes on
"$supple" bar.opts -quiet -output_dir opts -ksp_nothing 1e-3 >out.txt 2>err.txt
check "-ksp_nothing: exit code $?" test $? = 0
check "-ksp_nothing is not reported" grep -qxF "supple: warning: nobody read the option -ksp_nothing 1e-3" err.txt
# but a slip in one of the common ones ends it
error 2 "-ksp_rtoll|-ksp_rtol" bar.opts -ksp_rtoll 1e-3
error 1 "-pc_tpye|-pc_type" bar.opts -pc_tpye jacobi
error 1 "-snes_monitr|-snes_monitor" bar.opts -snes_monitr
# values with which PETSc's solvers fail, or crash, are named
error 2 "-pc_type mg|-pc_mg_levels 3" bar.opts -output_dir opts_bad -pc_type mg -pc_mg_levels 3
error 2 "-pc_bjacobi_blocks 1000000" bar.opts -output_dir opts_bad -pc_type bjacobi -pc_bjacobi_blocks 1000000
error 1 "-pc_redundant_number 100" bar.opts -output_dir opts_bad -pc_type redundant -pc_redundant_number 100
error 1 "-pc_factor_mat_ordering_type nothing" bar.opts -output_dir opts_bad -pc_type cholesky -pc_factor_mat_ordering_type nothing
error 1 "-ksp_rtol abc" bar.opts -output_dir opts_bad -ksp_rtol abc
error 1 "-snes_type" bar.opts -output_dir opts_bad -snes_type fas
error 2 "-snes_lag_jacobian 0" bar.opts -output_dir opts_bad -snes_lag_jacobian 0
error 1 "-ksp_type fcg|-ksp_fcg_mmax 0|signal 8" bar.opts -output_dir opts_bad -ksp_type fcg -ksp_fcg_mmax 0
error 2 "-ksp_type fcg|-ksp_fcg_mmax 0|signal 8" bar.opts -output_dir opts_bad -ksp_type fcg -ksp_fcg_mmax 0
# tolerances that any iterate meets, or none; no iteration; packages and methods that are not there; with any prefix
error 2 "-snes_rtol 2|[0, 1)" bar.opts -snes_rtol 2
error 1 "-snes_rtol nan|[0, 1)" bar.opts -snes_rtol nan
error 1 "-snes_stol -1e-3|[0, 1)" bar.opts -snes_stol -1e-3
error 1 "-snes_atol inf|[0, inf)" bar.opts -snes_atol inf
error 1 "-snes_max_it 0|[1, inf)" bar.opts -snes_max_it 0
error 1 "-ksp_rtol 3|[0, 1)" bar.opts -ksp_rtol 3
error 1 "-ksp_atol -1|[0, inf)" bar.opts -ksp_atol -1
error 1 "-ksp_max_it 0|[1, inf)" bar.opts -ksp_max_it 0
error 1 "-ksp_divtol 0.1|(1, inf]" bar.opts -ksp_divtol 0.1
error 1 "-snes_divergence_tolerance 0.5|(1, inf]" bar.opts -snes_divergence_tolerance 0.5
error 1 "-snes_linesearch_damping 0|(0, 1]" bar.opts -snes_linesearch_damping 0
error 2 "-body_bar_mesh_step 3" bar.opts -body_bar_mesh_step 3
error 1 "-ksp_gmres_restart 0|[1, inf)" bar.opts -ksp_gmres_restart 0
error 2 "-ts_atol 1e+09 m" bar.opts -ts_atol 1e9
error 1 "-ts_adapt_safety 2|(0, 1]" bar.opts -ts_adapt_safety 2
error 2 "-mg_levels_ksp_rtol 1|[0, 1)" bar.opts -mg_levels_ksp_rtol 1
error 1 "-ts_rtol 1.5|[0, 1)" bar.opts -ts_rtol 1.5
error 1 "-pc_factor_mat_solver_type mumsp|did you mean mumps?" bar.opts -pc_factor_mat_solver_type mumsp
error 1 "-sub_pc_factor_mat_solver_type nosuch|petsc" bar.opts -sub_pc_factor_mat_solver_type nosuch
error 1 "-pc_factor_mat_solver_type petsc|-pc_type" bar.opts -pc_factor_mat_solver_type petsc
for type in vinewtonrsls ms nosuch; do error 2 "-snes_type $type|newtonls|ksponly" bar.opts -snes_type $type; done
# an absolute tolerance above all loads is one thing that only a run can tell; at rest it says nothing
for atol in "-snes_atol 1e9" "-snes_type ksponly -ksp_atol 1e9" "-body_bar_material linear -ksp_atol 1e9"; do
  for n in 1 2; do
    # shellcheck disable=SC2086
    "${mpi[@]}" $n "$supple" bar.opts -quiet -output_dir idle $atol >out.txt 2>err.txt
    check "$atol on $n: exit code $?" test $? = 0
    check "$atol on $n: $(cat err.txt)" test "$(grep -cE "^supple: warning: .*-[a-z]*_atol .*without an iteration" err.txt) $(wc -l <err.txt)" = "1 1"
  done
done
"$supple" bar.opts -quiet -output_dir idle -effects hold -snes_atol 1e9 >out.txt 2>err.txt
check "nothing to solve: $(cat err.txt)" test "$(grep -c atol err.txt)" = 0

# as does what begins or ends like one of ours
error 1 "-solver_type|-solver?" bar.opts -solver_type mumps
error 1 "-solver hypre|did you mean cg_hypre" bar.opts -solver hypre
error 2 "-history_every|-output_history_every" bar.opts -history_every 2

# options that are right and of no use in this run are warned of by name, and the run goes on
unused() { # RANKS OPTION ARGUMENT...
  "${mpi[@]}" "$1" "$supple" bar.opts -quiet -output_dir unused "${@:3}" >out.txt 2>err.txt
  check "$2: exit code $?" test $? = 0
  check "$2 is not the one warning: $(cat err.txt)" test "$(grep -c "^supple: warning: $2 " err.txt) $(wc -l <err.txt)" = "1 1"
}
unused 1 -static_steps -static_steps 3
unused 2 -saddle_solver -saddle_solver direct
unused 1 -time_spectral_radius -time newmark -time_spectral_radius 0.3
"$supple" bar.opts -quiet -output_dir unused -body_bar_material holzapfel_ogden -body_bar_a 1e4 -body_bar_b 1 -body_bar_b_f 3 >out.txt 2>err.txt
check "an exponent without its stiffness: $(cat err.txt)" test "$(grep -c "^supple: warning: -body_bar_b_f is unused" err.txt)" = 1
unused 1 -effect_pull_displacement -effect_pull_displacement 1          # of another type
unused 1 -body_bar_tangent -body_bar_material linear -body_bar_tangent warped
unused 2 "-effect_pull_[a-z]* and 2 more" -effects gravity,hold              # left out by the command line
error 1 "-effect_pull_vectr|-effect_pull_vector" bar.opts -effects gravity,hold -effect_pull_vectr 1
error 1 "-effect_grvity_vector|-effect_gravity_vector" bar.opts -effect_grvity_vector 0,0,1

# settings that may gain energy without bound are warned of; with another tangent, method or solver they do not
grow() { # output of a run with these options
  # shellcheck disable=SC2086
  "$supple" bar.opts -quiet -output_dir grow -body_bar_material corotated $1 2>&1
  check "$1: exit code $?" test $? = 0
}
one="-snes_type ksponly -body_bar_tangent warped"
for more in "-time_predictor velocity" "-time newmark"; do
  check "growth is not warned of: $more" test "$(grow "$one $more" | grep -c "ksponly with $more and a warped tangent may gain energy without bound: give -body_<name>_tangent exact_spd")" = 1
done
for more in "-snes_type ksponly -body_bar_tangent exact_spd -time newmark -time_predictor velocity" "$one" "$one -time genalpha" "-body_bar_tangent warped -time newmark"; do
  check "a warning without a reason: $more" test -z "$(grow "$more")"
done
swing="-body_bar_mesh box:0.4,0.1,0.1:2 -body_bar_element cr -body_bar_young 1e5 -body_bar_poisson 0.4 -body_bar_density 1000 -ts_dt 0.005 -ts_max_time 0.5"
check "the tangent is not blamed for energy gained" test "$(grow "$one -time newmark $swing" | grep -c "the integrator gave .* or -body_<name>_tangent exact_spd: one solve with a warped tangent")" = 1

# the same scene from YAML, and from the printed scenario
"$supple" bar.yml -quiet -output_dir yml && check "YAML differs" cmp -s opts/history.csv yml/history.csv
"$supple" bar.opts -scenario_view view.opts && "$supple" view.opts -quiet -output_dir view &&
  check "the printed scenario differs" cmp -s opts/history.csv view/history.csv
check "no history" test -s view/history.csv
"${mpi[@]}" 2 "$supple" bar.opts -scenario_view >view2.opts && check "two views differ" cmp -s view.opts view2.opts
check "-scenario_view ran the scenario" test ! -e out/bar/history.csv
"$supple" opts/scenario.opts -quiet -output_dir again 2>/dev/null
check "scenario.opts differs" cmp -s opts/history.csv again/history.csv
"$supple" bar.opts -time static -quiet -output_dir static && "$supple" static/scenario.opts -quiet -output_dir again -output_overwrite
check "scenario.opts of a static run differs" cmp -s static/history.csv again/history.csv

# a body deep in another one: no look can tell which way it came in
cat >inside.opts <<'END'
-bodies big,small
-body_big_mesh box:1,1,1:9
-body_small_mesh box:0.1,0.1,0.1:1
-body_big_material linear
-body_small_material linear
-body_big_young 1e5
-body_big_poisson 0.3
-body_small_young 1e5
-body_small_poisson 0.3
-body_big_translate -0.5,-0.5,-0.5
-body_small_translate -0.05,-0.05,-0.05
-effects meet
-effect_meet_type contact
-ts_dt 1e-3
-ts_max_time 1e-3
END
for n in 1 2; do
  error $n "body small|body big" inside.opts -quiet
  check "beside it on $n: exit code $?" "${mpi[@]}" $n "$supple" inside.opts -quiet -body_small_translate 0.45,0.6,0 -output_dir in
  check "half out on $n: exit code $?" "${mpi[@]}" $n "$supple" inside.opts -quiet -body_small_translate 0.45,-0.05,-0.05 -output_dir in
done

# answers
check "-version" grep -q '^supple [0-9]' <<<"$("$supple" -version)"
check "-version names no commit" grep -qE '^commit ([0-9a-f]{12,40}|not known)' <<<"$("$supple" -version)"
check "-version names no flags" grep -qE ' -(O|g)' <<<"$("$supple" -version)"
check "-help | head" test "$("$supple" -help 2>&1 | head -n 1 | cut -c 1-7)" = "supple "
check "-help lacks -body_<name>_young" grep -qF -- '-body_<name>_young' <<<"$("${mpi[@]}" 2 "$supple" -help)"
check "-help body has options of effects" test "$("$supple" -help body | grep -c -- '-effect_<name>_')" = 0
check "-help solver" test "$("$supple" -help solver | grep -c '^  -')" = 1
check "-help friction lacks -effect_<name>_friction" grep -qF -- '-effect_<name>_friction:' <<<"$("$supple" -help friction)"
check "-help all is shorter than the table" test "$("$supple" -help all | grep -c '^  -')" -gt 140
error 1 "-help nonsense" -help nonsense
check "nothing at all prints no usage" grep -q 'supple SCENARIO.opts' <<<"$("$supple" 2>nothing.txt)"
check "nothing at all is no error" grep -q '^supple: error: -bodies' nothing.txt

# where a file goes wrong: the line of YAML, an option without its dash; the launcher without a number of ranks
printf 'bodies: bar\nbody:\n  bar:\n    mesh: box:0.4,0.1,0.1:6,2,2\n    material: linear\n   young: 5e4\n' >indent.yml
error 2 "indent.yml|line 6|young: 5e4" indent.yml
printf 'bodies: bar\nbody:\n\tbar: {mesh: "box:1,1,1:1"}\n' >tab.yml
error 1 "tab.yml|line 3|tab" tab.yml
printf -- '-bodies bar\nbody_bar_young 3\n' >dash.opts
error 1 "dash.opts|line 2|body_bar_young|dash" dash.opts
for ranks in 0 bin/supple -2 ""; do
  "$top/scripts/mpi" "$ranks" "$supple" -version >out.txt 2>err.txt
  code=$?
  check "scripts/mpi '$ranks': exit code $code" test "$code" -ne 0
  check "scripts/mpi '$ranks': $(cat err.txt)" grep -q "'$ranks' is no number of ranks" err.txt
done
# a planned stop (75) is followed by nothing of the launcher's, an error by one line
for code in 75 3; do
  "$top/scripts/mpi" 2 sh -c "exit $code" 2>err.txt
  ended=$?
  check "exit code $code became $ended" test $ended = $code
  check "after exit code $code: $(cat err.txt)" test "$(wc -l <err.txt)" = $((code == 3))
done
"$top/scripts/mpi" 2 bin/nothing -version >out.txt 2>err.txt
code=$?
check "scripts/mpi 2 bin/nothing: exit code $code" test "$code" = 127
check "scripts/mpi 2 bin/nothing: $(cat err.txt)" grep -q "'bin/nothing'" err.txt

finish
