#!/usr/bin/env bash
# The same run again has the same bytes, in history.csv and in fields.h5: on one rank always, on several with -reproducible yes, also where matrices are
# factored and where contact comes and slides. What cannot repeat is refused then.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

cat >bodies.opts <<'END'
-bodies a,b
-body_a_mesh box:0.2,0.1,0.05:3
-body_a_material corotated
-body_a_young 1e5
-body_a_poisson 0.3
-body_b_mesh box:0.08,0.06,0.05:3
-body_b_translate 0.06,0.021,0.05
-body_b_material corotated
-body_b_young 1e5
-body_b_poisson 0.3
-sets bottom,top
-set_bottom_at plane:0,0,1,0
-set_top_at plane:0,0,1,0.1
-effects hold,push,meet
-effect_hold_type fixed
-effect_hold_on bottom
-effect_push_type prescribed_displacement
-effect_push_on top
-effect_push_displacement 0.1*t;0;-0.1*t
-effect_meet_type contact
-effect_meet_friction 0.1
-ts_dt 0.01
-ts_max_time 0.03
-output_precision double
-quiet
END
# the same, pressed together at rest
sed -e '/friction/d' -e 's/^-ts_.*//' -e 's/^-effect_push_disp.*/-effect_push_displacement 0.0005*t;0.0001*t;-0.002*t/' bodies.opts >pressed.opts
echo '-time static' >>pressed.opts

# algebraic multigrid, whose coarse matrices are summed up from parts of the ranks
cat >bar.opts <<'END'
-bodies a
-body_a_mesh box:0.4,0.1,0.1:3
-body_a_material stable_neohookean
-body_a_young 1e6
-body_a_poisson 0.45
-effects gravity,clamp
-effect_clamp_type fixed
-effect_clamp_on xmin
-time static
-output_precision double
-quiet
END

# repeats RANKS ARGUMENT...: three runs, the same bytes
repeats() {
  local k
  for k in 1 2 3; do
    "${mpi[@]}" "$1" "$supple" "${@:2}" -output_dir "run$k" >out.txt 2>err.txt
    check "$*: exit code $?" test $? = 0
    check "$*: run $k has another history.csv" cmp -s run1/history.csv "run$k/history.csv"
    check "$*: run $k has another fields.h5" cmp -s run1/fields.h5 "run$k/fields.h5"
  done
}

repeats 1 bodies.opts
repeats 1 pressed.opts
repeats 1 bar.opts -reproducible yes -solver cg_gamg
repeats 1 bar.opts -reproducible yes -solver pressure -body_a_element cr
for n in 2 3; do
  repeats $n bodies.opts -reproducible yes
  repeats $n bodies.opts -reproducible yes -solver direct
  repeats $n bodies.opts -reproducible yes -solver direct -body_a_tangent exact -body_b_tangent exact
  repeats $n bodies.opts -reproducible yes -solver cg_two_level
  repeats $n bar.opts -reproducible yes -solver cg_gamg
  repeats $n bar.opts -reproducible yes -solver pressure -body_a_element cr
  repeats $n pressed.opts -reproducible yes
done
case " $SB_PACKAGES " in *" mumps "*) error 2 "-reproducible" bodies.opts -reproducible yes -solver mumps ;; esac
error 2 "-reproducible" bodies.opts -reproducible yes -pc_type lu
finish
