#!/usr/bin/env bash
# The ledger as a user meets it: the table and its words, ledger.csv, columns of history.csv, the field, the adaptive tolerances, and what is refused.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

cat >bar.opts <<'END'
-bodies bar
-body_bar_mesh box:0.4,0.1,0.1:3
-body_bar_material linear
-body_bar_young 1e6
-body_bar_poisson 0.3
-effects gravity,hold
-effect_hold_type fixed
-effect_hold_on xmin
-time static
-progress no
END
cat >swing.opts <<'END'
-bodies bar
-body_bar_mesh box:0.4,0.1,0.1:2
-body_bar_material corotated
-body_bar_young 1e5
-body_bar_poisson 0.3
-effects gravity,hold
-effect_hold_type fixed
-effect_hold_on xmin
-ts_dt 0.01
-ts_max_time 0.1
-progress no
END

column() { # FILE ROW COLUMN: a number of ledger.csv
  awk -F, -v row="$2" -v col="$3" '$1 == row && $2 == "" { print $col }' "$1"
}
near() { # A B TOLERANCE (relative)
  awk -v a="$1" -v b="$2" -v t="$3" 'BEGIN { d = a - b; if (d < 0) d = -d; m = b < 0 ? -b : b; exit !(d <= t * m) }'
}

# the table, its last words and the file, the same on any number of ranks
for n in 1 2 3; do
  "${mpi[@]}" $n "$supple" bar.opts -ledger yes -ledger_quantity displacement -ledger_at 0.4,0,0 -output_dir "led$n" >"out$n.txt" 2>&1
  check "$n ranks: exit code $?" test $? = 0
  check "$n ranks: no row for the mesh" grep -q '^space  *[0-9.]*e' "out$n.txt"
  check "$n ranks: no last words" grep -q 'the mesh is the largest' "out$n.txt"
  check "$n ranks: space differs" near "$(column led$n/ledger.csv space 4)" "$(column led1/ledger.csv space 4)" 1e-6
  check "$n ranks: of the quantity" near "$(column led$n/ledger.csv space 5)" "$(column led1/ledger.csv space 5)" 1e-3
done
check "the quantity by a finer run" grep -q 'The displacement is .* here, and .* by p2 with 648 tets' <<<"$(tr '\n' ' ' <out1.txt)"
for n in 1 3; do
  "${mpi[@]}" $n "$supple" bar.opts -body_bar_element cr -ledger yes -ledger_quantity displacement -ledger_at 0.4,0,0 -output_dir "cr$n" >"cr$n.txt" 2>&1
  check "cr, $n ranks: exit code $?" test $? = 0
  check "cr, $n ranks: no finer run" grep -q 'by p2 with 5184 tets' <<<"$(tr '\n' ' ' <"cr$n.txt")"
  check "cr, $n ranks: of the quantity" near "$(column cr$n/ledger.csv space 5)" "$(column cr1/ledger.csv space 5)" 1e-3
done
"$supple" bar.opts -body_bar_element cr -ledger yes -ledger_quantity displacement -ledger_at 0.4,0,0 -ledger_finer_most 1000 -output_dir dual >dual.txt 2>&1
check "no word of a finer run that is too large" grep -q 'takes more than -ledger_finer_most tets.*UNRELIABLE' <<<"$(tr '\n' ' ' <dual.txt)"
check "the error of the mesh, $(column led1/ledger.csv space 4)" near "$(column led1/ledger.csv space 4)" 0.45 0.3
check "columns of the history" grep -q 'error_space,error_time,error_nonlinear,error_linear,error_contact,error_rounding$' <<<"$(head -n 1 led1/history.csv)"
for n in 1 3; do
  "${mpi[@]}" $n "$supple" bar.opts -body_bar_element p2 -ledger yes -output_dir "quadratic$n" >"quadratic$n.txt" 2>&1
  check "p2, $n ranks: exit code $?" test $? = 0
  check "p2, $n ranks: space differs" near "$(column quadratic$n/ledger.csv space 4)" "$(column quadratic1/ledger.csv space 4)" 1e-6
done
check "p2 is more accurate" awk -v a="$(column quadratic1/ledger.csv space 4)" -v b="$(column led1/ledger.csv space 4)" 'BEGIN { exit !(a < 0.4 * b) }'
# advice of p2: not to itself; where P1 locks; beside -accuracy; with a length of edges that does halve the error
words() { tr '\n' ' ' <"$1"; }
check "p2 is advised to p2" test -z "$(grep 'element p2' <<<"$(words quadratic1.txt)")"
"$supple" bar.opts -body_bar_poisson 0.4999 -ledger yes -output_dir locked >locked.txt 2>&1
check "no word of locking" grep -q 'P1 locks.*-body_bar_element p2' <<<"$(words locked.txt)"
check "an invalid estimate is not said" grep -q 'estimate is INVALID' <<<"$(words locked.txt)"
"$supple" bar.opts -body_bar_poisson 0.47 -ledger yes -output_dir nearly >nearly.txt 2>&1
check "an estimate at nu 0.47 is called invalid" test -z "$(grep INVALID nearly.txt)"
check "no word of locking at nu 0.47" grep -q 'P1 locks.*-body_bar_element p2' <<<"$(words nearly.txt)"
"$supple" bar.opts -body_bar_mesh box:0.4,0.1,0.1:6 -ledger yes -output_dir six >six.txt 2>&1
longer=$(sed -n 's/.*body_bar_element p2 does it with edges of \([0-9.]*\) times.*/\1/p' <<<"$(words six.txt)")
across=$(awk -v k="$longer" 'BEGIN { print (k > 1 ? int(6 / k + 0.5) : 0) }')
check "no length of edges for p2" test "$across" -gt 0
"$supple" bar.opts -body_bar_mesh "box:0.4,0.1,0.1:$across" -body_bar_element p2 -ledger yes -output_dir longer >longer.txt 2>&1
check "p2 with edges $longer times as long has no half of the error" awk -v a="$(column longer/ledger.csv space 4)" -v b="$(column six/ledger.csv space 4)" 'BEGIN { exit !(a < 0.5 * b) }'
"$supple" bar.opts -output_dir plain >plain.txt 2>&1
check "without -ledger there is one" test ! -e plain/ledger.csv
check "columns without -ledger" test -z "$(head -n 1 plain/history.csv | grep error_)"
"$supple" bar.opts -ledger yes -ledger_quantity reaction -ledger_on xmin -ledger_direction 0,0,1 -output_dir react >react.txt 2>&1
check "a reaction that statics tell has an error" awk -v e="$(column react/ledger.csv space 5)" 'BEGIN { exit !(e < 1e-3 * 39.24) }'
"$supple" swing.opts -ledger yes -ledger_every 5 -output_fields space_error -quiet -output_dir field
check "the field space_error: exit code $?" test $? = 0
check "no field" grep -q space_error field/fields.xmf

# -accuracy asks for steps far shorter than -ts_dt: a hundredth is the least, said once, and the run ends
"$supple" swing.opts -accuracy 1e-6 -ts_max_time 0.02 -quiet -output_dir short >short.txt 2>&1
check "steps that -accuracy bounds: exit code $?" test $? = 0
check "a bound on steps is said once" test "$(grep -c 'asks for steps' short.txt)" = 1

# nothing can move, so Newton's method solves nothing before the error of its solves is asked for
for n in 1 2; do
  "${mpi[@]}" $n "$supple" swing.opts -body_bar_mesh box:0.1,0.1,0.1:1 -effect_hold_on boundary -solver rotated -ledger yes -output_dir still >still.txt 2>&1
  check "everything fixed, $n ranks: exit code $?" test $? = 0
  check "everything fixed, $n ranks: an error" grep -q 'No error was found' still.txt
done

# errors go on over a restart, on any number of ranks
swing="-ledger yes -time newmark -ts_max_time 0.2 -ledger_quantity volume"
# shellcheck disable=SC2086
"$supple" swing.opts $swing -checkpoint_every_steps 10 -output_dir whole >whole.txt 2>&1
for n in 1 2; do
  # shellcheck disable=SC2086
  "${mpi[@]}" $n "$supple" swing.opts $swing -restart whole/checkpoint_000010.h5 -output_dir "half$n" >"half$n.txt" 2>&1
  check "restart on $n ranks: exit code $?" test $? = 0
  for source in space time; do
    check "$source after a restart on $n ranks: $(column half$n/ledger.csv $source 4), whole $(column whole/ledger.csv $source 4)" \
      near "$(column half$n/ledger.csv $source 4)" "$(column whole/ledger.csv $source 4)" 0.1
  done
done
"$supple" swing.opts -time newmark -checkpoint_every_steps 10 -quiet -output_dir none
"$supple" swing.opts -time newmark -ts_max_time 0.2 -ledger yes -restart none/checkpoint_000010.h5 -output_dir late >late.txt 2>&1
check "a checkpoint without errors goes unsaid" grep -q 'was written without -ledger: they count from there' late.txt

# the adaptive tolerances
"$supple" swing.opts -accuracy 0.5 -output_dir coarse >coarse.txt 2>&1
check "-accuracy 0.5 says nothing" grep -q -- '-accuracy 0.5 was' coarse.txt
"$supple" swing.opts -accuracy 0.01 -output_dir fine >fine.txt 2>&1
check "-accuracy 0.01 on two cells" grep -q 'NOT met' fine.txt
check "no advice of p2 beside -accuracy" grep -q -- '-body_bar_element p2' <<<"$(words fine.txt)"
check "no mesh size" grep -q 'too coarse for it: tets of about' <<<"$(tr '\n' ' ' <fine.txt)"
"$supple" swing.opts -step_time_budget 100 -output_dir slow >slow.txt 2>&1
check "100 s for a step" grep -q '10 of 10 steps kept it' <<<"$(tr '\n' ' ' <slow.txt)"
"$supple" swing.opts -step_time_budget 1e-7 -output_dir fast >fast.txt 2>&1
check "0.1 us for a step" grep -q 'It is too small for this mesh' <<<"$(tr '\n' ' ' <fast.txt)"

# what is refused
error 1 "-accuracy 0.1|-step_time_budget 0.03 s" swing.opts -accuracy 0.1 -step_time_budget 0.03
error 2 "-step_time_budget 0.03 s|-time static|-accuracy" bar.opts -step_time_budget 0.03
error 1 "-ledger|-time alpha2|-time genalpha" swing.opts -time alpha2 -ledger yes
error 1 "-output_fields space_error|-ledger yes" bar.opts -output_fields space_error
error 2 "-ledger_on 'floor'" bar.opts -ledger yes -ledger_quantity reaction -ledger_on floor
error 1 "-ledger_direction 0,0,0" bar.opts -ledger yes -ledger_quantity displacement -ledger_direction 0,0,0

finish
