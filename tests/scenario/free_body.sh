#!/usr/bin/env bash
# A body that only contact without friction holds in a static run: it can slide, and every solver ends with one line that names it and
# the motion that nothing resists; no trace, and no displacement of a billion metres instead. Held by a support the same scene is solved.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

cat >bodies.opts <<'END'
-bodies a,b
-body_a_mesh box:0.1,0.1,0.05:2
-body_a_material linear
-body_a_young 1e5
-body_a_poisson 0.3
-body_a_density 1000
-body_b_mesh box:0.05,0.05,0.05:2
-body_b_translate 0.02,0.02,0.05
-body_b_material linear
-body_b_young 1e5
-body_b_poisson 0.3
-body_b_density 1000
-sets low,under
-set_low_at plane:0,0,1,0
-set_under_at plane:0,0,1,0.05
-effects gravity,hold,meet
-effect_gravity_vector 0.5,0.2,-9.81
-effect_hold_type fixed
-effect_hold_on low
-time static
-output_fields none
END
floor="-effect_meet_type contact -effect_meet_response projected -effect_meet_on b.zmin -effect_meet_obstacle plane:0,0,1,0.0505"
slides="body b|(1.00, 0.00, 0.00)"

solvers="auto direct"
for package in cholmod umfpack mumps; do
  case " $SB_PACKAGES " in *" $package "*) solvers+=" $package" ;; esac
done

# free RANKS ARGUMENT...: one line says that it slides
free() {
  error "$1" "0.000976562|$slides" -options_file bodies.opts "${@:2}"
}

# on an obstacle
for solver in $solvers cg_icc cg_two_level; do
  # shellcheck disable=SC2086
  free 1 $floor -solver "$solver"
done
# on another body
for solver in $solvers cg_icc; do free 1 -effect_meet_type contact -solver "$solver"; done
# CHOLMOD met a zero pivot there, and ended the program
for element in cr dg; do free 1 -effect_meet_type contact -body_a_element $element -body_b_element $element; done
free 1 -effect_meet_type contact -body_a_material stable_neohookean -body_b_material stable_neohookean
# multipliers as unknowns
for way in direct iterative; do
  # shellcheck disable=SC2086
  free 1 $floor -effect_meet_response multiplier -saddle_solver $way
done
# shellcheck disable=SC2086
for solver in $solvers; do free 2 $floor -solver "$solver"; done
free 2 -effect_meet_type contact
# constrained at the nodes of one axis, it turns about that
# shellcheck disable=SC2086
error 1 "0.000976562|body b|(0.00, 0.00, 1.00)|(0.045, 0.045, 0.075) m" \
  -options_file bodies.opts $floor -effects gravity,hold,pin,turn,meet -sets low,under,pin \
  -set_pin_at box:0.0449,0.0449,0.05,0.0451,0.0451,0.1 -effect_pin_type fixed -effect_pin_on pin \
  -effect_pin_components xy -effect_turn_type body_force -effect_turn_density "(0.045-y)*1e5;(x-0.045)*1e5;0"
# cr and dg are constrained at the centres of facets: two of them are a hinge, one holds less; with p1 the same supports hold
cat >bar.opts <<'END'
-bodies a
-body_a_mesh box:0.3,0.1,0.1:2
-body_a_material linear
-body_a_young 1e5
-body_a_poisson 0.3
-body_a_density 1000
-sets part
-effects gravity,clamp
-effect_clamp_type fixed
-effect_clamp_on part
-time static
-output_fields none
END
two="-set_part_at box:-0.001,0.049,-0.001,0.001,0.101,0.051"
hinge="body a|(0.00, 0.71, 0.71)|(0, 0.075, 0.025) m"
for more in "-body_a_element cr" "-body_a_element dg" "-body_a_element cr -solver pressure" "-body_a_element cr -solver cg_jacobi"; do
  # shellcheck disable=SC2086
  error 1 "load factor 1.|$hinge" -options_file bar.opts $two $more
done
# shellcheck disable=SC2086
error 2 "load factor 1.|$hinge" -options_file bar.opts $two -body_a_element cr
# a follower load makes the tangent of a hinge regular wherever Newton's method may be, but not where the step began
cat >follower.opts <<'END'
-body_a_material stable_neohookean
-effects push,clamp
-sets part,top
-set_top_at plane:0,0,1,0.1
-effect_push_type pressure
-effect_push_on top
-effect_push_value 100
END
for more in "cr -static_steps 3" "dg"; do
  # shellcheck disable=SC2086
  error 2 "load factor |$hinge" -options_file bar.opts -options_file follower.opts $two -body_a_element $more
  check "shorter steps do not help: $(grep rejected out/bar/run.json)" grep -Eq '"rejected[a-z_]*": 1\b' out/bar/run.json
done
# shellcheck disable=SC2086
error 1 "load factor 1.|body a|(0.00, 0.00, 1.00)" -options_file bar.opts $two \
  -body_a_element p1 -effect_clamp_components xy
# stiffness that differs by 1e8 is no reason to say so: the bar is clamped, and the user's solver is what failed
cat >stiff.opts <<'END'
-body_a_inclusions hard
-inclusion_hard_material linear
-inclusion_hard_young 1e13
-inclusion_hard_poisson 0.3
-sets part,hard
-set_hard_at box:0.1,-1,-1,1,1,1
-set_part_at plane:1,0,0,0
END
for ranks in 1 2; do
  error $ranks "load factor 1.|DIVERGED_LINEAR_SOLVE|DIVERGED_ITS" -options_file bar.opts \
    -options_file stiff.opts -solver cg_jacobi -ksp_type cg -ksp_max_it 20
  check "the ratio of stiffness is not named: $(cat err.txt)" grep -q "1e+08 times" err.txt
done
"$supple" -options_file bar.opts -options_file stiff.opts -solver cg_jacobi -ksp_max_it 20 >out.txt 2>err.txt
code=$?
check "another solver takes over: exit code $code" test "$code" = 0
# what holds: the weight, where a body hangs from a hinge, in steps that are short enough
# shellcheck disable=SC2086
"$supple" -options_file bar.opts -body_a_material stable_neohookean -body_a_young 3e3 -set_part_at box:-1,0.0499,0.0999,1,0.0501,0.101 \
  -snes_max_it 3 >out.txt 2>err.txt
code=$?
check "hangs from a hinge: exit code $code, $(cat err.txt)" test "$code" = 0
check "in steps that were shortened: $(grep rejected out/bar/run.json)" grep -Eq '"rejected[a-z_]*": [1-9]' out/bar/run.json
# what holds: a support of the sides
# shellcheck disable=SC2086
"$supple" -options_file bodies.opts $floor -effects gravity,hold,side,meet -sets low,under,side \
  -set_side_at plane:1,0,0,0.02 -effect_side_type fixed -effect_side_on side -effect_side_components xy >out.txt 2>err.txt
code=$?
check "held at a side: exit code $code" test "$code" = 0
finish
