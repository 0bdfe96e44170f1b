#!/usr/bin/env bash
# Many bodies from few options: defaults for all, copies on a grid and from a file, what a copy has of its own; how bodies begin; loads and supports that
# come and go. Numbers are those of the same scene written out.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

fail() { check "$1" false; }

# last NAME FOLDER COLUMN VALUE TOLERANCE: of the last row of a history
last() {
  # shellcheck disable=SC2016 # awk's own
  check "$1: $3 in $2 is not $4" awk -F, -v column="$3" -v value="$4" -v tolerance="$5" '
    NR == 1 { for (i = 1; i <= NF; i++) if ($i == column) c = i }
    END { d = $c - value; exit !c || d > tolerance || -d > tolerance }' "$2/history.csv"
}

value() { # FOLDER COLUMN: in the last row
  awk -F, -v column="$2" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == column) c = i } END { print $c }' "$1/history.csv"
}

cat >defaults.opts <<'END'
-body_default_material linear
-body_default_young 1e4
-body_default_poisson 0.3
-body_default_mesh box:0.1,0.1,0.2:1
-ts_dt 0.01
-ts_max_time 0.05
-output_fields none
-quiet
END

# two copies from a file, each twice as large and turned, next to a body of its own: mass, centre and momentum
cat >heap.txt <<'END'
# x y z, axis and degrees, scale, velocity
1 0 0  0 1 0 90  2  0 0 3
0,2,0, 0,1,0,90, 2
END
"$supple" defaults.opts -bodies brick,post -body_brick_copies heap.txt -body_brick_young 2e4 -body_brick2_density 500 -body_post_density 2000 \
  -body_post_translate 5,5,5 -output_dir copies || fail "copies do not run"
# 0.016 m^3 each: 16 kg at (1.2, 0.1, -0.1), 8 kg at (0.2, 2.1, -0.1), 4 kg at (5.05, 5.05, 5.1), with 3 m/s for 0.05 s
last copies copies momentum_z 48 1e-9
last copies copies centre_x "$(awk 'BEGIN { printf "%.12g", (16 * 1.2 + 8 * 0.2 + 4 * 5.05) / 28 }')" 1e-9
last copies copies centre_y "$(awk 'BEGIN { printf "%.12g", (16 * 0.1 + 8 * 2.1 + 4 * 5.05) / 28 }')" 1e-9
last copies copies centre_z "$(awk 'BEGIN { printf "%.12g", (16 * (-0.1 + 0.15) - 8 * 0.1 + 4 * 5.1) / 28 }')" 1e-9
grep -q '"name": "brick2"' copies/run.json || fail "no body brick2 in run.json"

# the complete scenario runs again, with the same numbers
"$supple" copies/scenario.opts -output_dir again || fail "the scenario that was written does not run"
cmp -s <(cut -d, -f1-12 copies/history.csv) <(cut -d, -f1-12 again/history.csv) || fail "the scenario that was written gives other numbers"

# one line for copies that are alike: the third has another modulus, and one twice as large has eight times the mass
printf '0 0 0\n1 0 0 0 0 1 0 2\n2 0 0\n3 0 0\n' >sizes.txt
"$supple" defaults.opts -bodies brick -body_brick_copies sizes.txt -body_brick3_young 2e4 -output_dir alike -quiet no >alike.txt || fail "copies of other sizes do not run"
check "no line for the three that are alike: $(cat alike.txt)" grep -Eq '^3 x brick +linear +1e\+04 .* 2-16$' alike.txt
check "no line for the one that is not: $(cat alike.txt)" grep -Eq '^brick3 +linear +2e\+04 .* 2$' alike.txt
"$supple" defaults.opts -bodies bead -body_bead_mesh "$top/tests/data/bead.obj" -body_bead_tet_size 0.01 -body_bead_copies grid:3,1,1,1,1,1 -output_dir alike -quiet no >alike.txt || fail "copies of a surface do not run"
check "the mesh of copies is told of more than once: $(cat alike.txt)" [ "$(grep -c ' tets of size ' alike.txt)" = 1 ]

# mistakes
printf '0 0 0\n1 2 3 4\n' >bad.txt
error 1 "-body_default_yuong|-body_default_young" defaults.opts -bodies a -body_default_yuong 3
error 1 "default|-body_default_young" defaults.opts -bodies default
error 2 "-body_a_copies|bad.txt|line 2|11" defaults.opts -bodies a -body_a_copies bad.txt
error 1 "-body_a_copies|grid:0,1,1,1,1,1" defaults.opts -bodies a -body_a_copies grid:0,1,1,1,1,1
error 1 "a1" defaults.opts -bodies a,a1 -body_a_copies grid:2,1,1,1,1,1
error 1 "-body_a_velocity|t" defaults.opts -bodies a -body_a_velocity 0,0,t

# a bar that begins in rotation and stretched: v = w x r; strain energy of a stretch e: E e^2 / 2 V with nu = 0
bar="-bodies bar -body_bar_mesh box:0.4,0.1,0.1:4,1,1 -body_bar_poisson 0"
# shellcheck disable=SC2086
"$supple" defaults.opts $bar -body_bar_velocity "0,3*(x-0.2),0" -body_bar_displacement "0.01*x, 0, 0" -ts_max_time 1e-6 -ts_dt 1e-6 -output_dir start ||
  fail "a start by formulas does not run"
row0() { awk -F, -v c="$1" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == c) k = i } NR == 3 { print $k }' start/history.csv; }
awk -v e="$(row0 strain)" 'BEGIN { d = e / (0.5 * 1e4 * 1e-4 * 0.004) - 1; exit d > 1e-6 || d < -1e-6 }' || fail "stretched: $(row0 strain) J"
awk -v e="$(row0 kinetic)" 'BEGIN { m = 4; w = 3; d = e / (0.5 * w * w * m * (0.16 / 12 + 0.16 / (12 * 8))) - 1; exit d > 0.2 || d < -0.2 }' || fail "turning: $(row0 kinetic) J"

# from another run: a static one, released in another element with another integrator, on another mesh: the same energy but for interpolation
# shellcheck disable=SC2086
for n in 1 2; do
  "${mpi[@]}" $n "$supple" defaults.opts $bar -effects hold,pull -effect_hold_type fixed -effect_hold_on xmin -effect_pull_type traction -effect_pull_on xmax \
    -effect_pull_vector 100,0,0 -time static -output_fields displacement -output_precision double -output_dir loaded || fail "a static run to go on from"
  e=$(value loaded strain)
  for more in "-time newmark" "-body_bar_element cr -body_bar_mesh box:0.4,0.1,0.1:8,2,2"; do
    "${mpi[@]}" $n "$supple" defaults.opts $bar -effects hold -effect_hold_type fixed -effect_hold_on xmin $more -body_bar_state loaded -ts_max_time 1e-6 -ts_dt 1e-6 \
      -output_dir start -output_overwrite yes >state.txt 2>&1 || fail "a state of another run: $(cat state.txt)"
    check "strain energy $(row0 strain) J of a state of $e J, $more" awk -v e="$(row0 strain)" -v f="$e" 'BEGIN { d = e / f - 1; exit d > 1e-6 || d < -1e-6 }'
    check "no warning that the run has no velocity" grep -q "no velocity" state.txt
  done
  # it is thrown as it is loaded: kinetic energy of 4 kg that options give a state without velocity
  "${mpi[@]}" $n "$supple" defaults.opts $bar -body_bar_state loaded -body_bar_velocity 0,0,0.5 -ts_max_time 1e-6 -ts_dt 1e-6 -output_dir start -output_overwrite yes || fail "a state that is thrown"
  check "kinetic energy $(row0 kinetic) J of a state that is thrown" awk -v e="$(row0 kinetic)" 'BEGIN { d = e / 0.5 - 1; exit d > 1e-9 || d < -1e-9 }'
done

# between p1 and p2: values at the nodes are those of the other run, those at edges among them
bend="-bodies bar -body_bar_mesh box:0.4,0.1,0.1:4,1,1 -body_bar_poisson 0.3 -ts_max_time 1e-6 -ts_dt 1e-6 -output_precision double -output_fields displacement,velocity -output_overwrite yes"
strain=() kinetic=()
# shellcheck disable=SC2086
for way in "p1 " "p2 -output_quadratic yes" "p2 -output_discontinuous yes" "p2 "; do
  "$supple" defaults.opts $bend -body_bar_element $way -body_bar_displacement "0.01*x^2,0.02*y,0.03*z*x" -body_bar_velocity "y,x*z,0" -output_dir start || fail "$way: a start by formulas does not run"
  cp -r start "state_${way//[ -]/}"
  strain+=("$(row0 strain)") kinetic+=("$(row0 kinetic)")
done
# shellcheck disable=SC2086
for n in 1 3; do
  for way in "p2 p1 0" "p2 p2 1" "p2output_quadraticyes p2 1" "p2output_discontinuousyes p2 1" "p1 p1 0" "p1 p2 0"; do
    set -- $way
    "${mpi[@]}" $n "$supple" defaults.opts $bend -body_bar_element $2 -body_bar_state state_$1,0 -output_dir start || fail "a state of $1 for $2"
    # what comes from p1 has its energy, as its functions are of p2, too
    check "strain energy of $1's state in $2: $(row0 strain)" awk -v e="$(row0 strain)" -v f="${strain[$3]}" 'BEGIN { d = e / f - 1; exit d > 1e-12 || d < -1e-12 }'
    [ $1$2 = p1p2 ] || check "kinetic energy of $1's state in $2: $(row0 kinetic)" awk -v e="$(row0 kinetic)" -v f="${kinetic[$3]}" 'BEGIN { d = e / f - 1; exit d > 1e-12 || d < -1e-12 }'
  done
done

# from a checkpoint, to its last digit on another number of ranks, with another law, integrator and effects; with other elements or meshes from the frame of its step
# shellcheck disable=SC2086
"${mpi[@]}" 2 "$supple" defaults.opts $bar -body_bar_velocity "0,3*(x-0.2),0" -checkpoint_every_steps 3 -output_fields displacement,velocity -output_precision double -output_dir swung || fail "a run with checkpoints"
for n in 1 3; do
  # shellcheck disable=SC2086
  "${mpi[@]}" $n "$supple" defaults.opts $bar -body_bar_state swung/checkpoint_000003.h5 -time newmark -effects g -effect_g_type gravity -body_bar_poisson 0.2 \
    -ts_max_time 1e-6 -ts_dt 1e-6 -output_dir start -output_overwrite yes || fail "a state of a checkpoint"
  for column in kinetic momentum_y angular_z centre_y max_displacement; do
    # shellcheck disable=SC2016
    check "a state of a checkpoint, $column: $(row0 $column)" awk -F, -v value="$(row0 $column)" -v column=$column '
      NR == 1 { for (i = 1; i <= NF; i++) if ($i == column) c = i } $1 == 3 { d = value - $c; exit d > 1e-13 || d < -1e-13 }' swung/history.csv
  done
done
# shellcheck disable=SC2086
for other in "-body_bar_element p2" "-body_bar_mesh box:0.4,0.1,0.1:8,2,2"; do
  "${mpi[@]}" 2 "$supple" defaults.opts $bar -body_bar_state swung/checkpoint_000003.h5 $other -ts_max_time 1e-6 -ts_dt 1e-6 -output_dir start -output_overwrite yes >state.txt 2>&1 ||
    fail "a state of a checkpoint, $other: $(cat state.txt)"
  for column in momentum_y centre_y max_displacement; do
    # shellcheck disable=SC2016
    check "a state of a checkpoint, $other, $column: $(row0 $column)" awk -F, -v value="$(row0 $column)" -v column=$column '
      NR == 1 { for (i = 1; i <= NF; i++) if ($i == column) c = i } $1 == 3 { d = value - $c; exit d > 1e-9 || d < -1e-9 }' swung/history.csv
  done
done
mkdir bare
cp swung/checkpoint_000003.h5 bare/
# shellcheck disable=SC2086
error 1 "-body_bar_state bare,3|bare/fields.h5" defaults.opts $bar -body_bar_state bare/checkpoint_000003.h5 -body_bar_element p2

# dg, whose supports are nodes of their own, with other supports than the checkpoint, beside p2, whose rows in the file follow them
two="-bodies bar,beam -body_bar_mesh box:0.4,0.1,0.1:4,1,1 -body_bar_element dg -body_bar_poisson 0 -body_beam_mesh box:0.4,0.1,0.1:2,1,1 -body_beam_translate 0,1,0 -body_beam_element p2"
spin="-body_bar_velocity 0,3*(x-0.2),0 -body_beam_velocity 0,0,2*y"
hold="-effects hold -effect_hold_type fixed -effect_hold_on"
# shellcheck disable=SC2086
for way in "|$hold bar.xmax" "$hold bar.xmin|" "$hold bar.xmin|$hold bar.ymin"; do
  "${mpi[@]}" 2 "$supple" defaults.opts $two $spin ${way%|*} -checkpoint_every_steps 3 -ts_max_time 0.03 -output_dir swung -output_overwrite yes >state.txt 2>&1 ||
    fail "dg, ${way%|*}: $(cat state.txt)"
  for n in 1 3; do
    "${mpi[@]}" $n "$supple" defaults.opts $two ${way#*|} -body_bar_state swung/checkpoint_000003.h5 -body_beam_state swung/checkpoint_000003.h5 \
      -ts_max_time 1e-6 -ts_dt 1e-6 -output_dir start -output_overwrite yes >state.txt 2>&1 || fail "dg, ${way%|*}, then ${way#*|}: $(cat state.txt)"
    for column in kinetic momentum_x momentum_y momentum_z angular_z centre_y centre_z; do
      # shellcheck disable=SC2016
      check "dg with other supports, $column: $(row0 $column)" awk -v value="$(row0 $column)" -v then="$(value swung $column)" 'BEGIN { d = value - then; exit d > 1e-12 || d < -1e-12 }'
    done
  done
done

# sizes that look like mm: a warning, but not where the scale is given, or densities are not those of SI
for size in "100 1000 1" "100 1000 0 -body_a_scale 1" "100 1e-9 0" "0.1 1000 0"; do
  # shellcheck disable=SC2086
  set -- $size
  printf 'v 0 0 0\nv %s 0 0\nv 0 %s 0\nv 0 0 %s\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n' "$1" "$1" "$1" >tet.obj
  # shellcheck disable=SC2086
  "$supple" defaults.opts -bodies a -body_a_mesh tet.obj -body_a_density "$2" ${4:+$4 $5} -output_dir sizes -output_overwrite yes >sizes.txt 2>&1 || fail "size $size: $(cat sizes.txt)"
  check "size $size: $(cat sizes.txt)" test "$(grep -c -- '-body_a_scale 0.001' sizes.txt)" = "$3"
done

# shellcheck disable=SC2086
error 2 "-body_bar_state nowhere" defaults.opts $bar -body_bar_state nowhere
# shellcheck disable=SC2086
error 1 "-body_bar_state loaded,7|frame" defaults.opts $bar -body_bar_state loaded,7
# shellcheck disable=SC2086
error 1 "-body_bar_state|static" defaults.opts $bar -effects hold -effect_hold_type fixed -effect_hold_on xmin -time static -body_bar_state loaded

# let go at 0.02 s: free fall from there; a load that is there for 0.02 s of the time gives its impulse
# shellcheck disable=SC2086
for n in 1 2; do
  "${mpi[@]}" $n "$supple" defaults.opts $bar -effects gravity,hold -effect_hold_type fixed -effect_hold_on bar -effect_hold_until 0.02 -output_dir "fall$n" -checkpoint_every_steps 3 -checkpoint_keep 9 ||
    fail "a support that lets go does not run"
  last "fall on $n" "fall$n" momentum_z "$(awk 'BEGIN { print -4 * 9.81 * 0.03 }')" 1e-9
  last "fall on $n" "fall$n" hold_reaction_z 0 1e-9
done
# shellcheck disable=SC2086
"$supple" defaults.opts $bar -effects gravity,hold -effect_hold_type fixed -effect_hold_on bar -effect_hold_until 0.02 -restart fall1/checkpoint_000003.h5 -output_dir resumed ||
  fail "no restart after a support was let go"
last resumed resumed momentum_z "$(awk 'BEGIN { print -4 * 9.81 * 0.03 }')" 1e-9
# shellcheck disable=SC2086
"$supple" defaults.opts $bar -effects push -effect_push_type body_force -effect_push_density 0,100,0 -effect_push_from 0.01 -effect_push_until 0.03 -output_dir pushed ||
  fail "a load that comes and goes does not run"
last pushed pushed momentum_y "$(awk 'BEGIN { print 100 * 0.004 * 0.02 }')" 1e-9
error 1 "-effect_push_from 2|-effect_push_until 1" defaults.opts -bodies a -effects push -effect_push_type body_force -effect_push_density 1,0,0 -effect_push_from 2 -effect_push_until 1
error 1 "-effect_calm_from|damping" defaults.opts -bodies a -effects calm -effect_calm_type damping -effect_calm_from 2

finish
