#!/usr/bin/env bash
# A mesh file that is broken, or is no mesh for this program, ends with one clear line on any number of ranks, and no
# result is written or replaced. What is odd but sound runs. Also: output folders that cannot be written.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh
data=$top/tests/data

cat >body.opts <<'END_OPTIONS'
-bodies it
-body_it_material linear
-body_it_young 1e5     # Pa
-body_it_poisson 0.3
-effects gravity,hold
-effect_hold_type fixed
-effect_hold_on low
-sets low
-set_low_at plane:0,0,1,0
-ts_dt 0.01
-ts_max_time 0.02
END_OPTIONS

# mesh RANKS FILE NAMES: a run with this mesh must fail, naming the body, the file and NAMES
mesh() {
  error "$1" "body 'it'|$2${3:+|$3}" body.opts -body_it_mesh "$2" -output_dir new
  check "$2: something was written: $(ls new)" test -z "$(ls -A new 2>/dev/null)"
  rm -rf new
}

# runs RANKS FILE VERTICES TEXT: a run with this mesh must work, with so many vertices, and report TEXT
runs() {
  "${mpi[@]}" "$1" "$supple" body.opts -body_it_mesh "$2" -output_dir "run$1" >out.txt 2>err.txt
  check "$2 on $1 ranks: exit code $?" test $? = 0
  check "$2 on $1 ranks: no '$4'" grep -qF -- "$4" out.txt
  check "$2 on $1 ranks: not $3 vertices" grep -qE "^it +p1 +[0-9]+ +$3 " out.txt
  check "$2 on $1 ranks: $(tail -n +2 "run$1/history.csv" 2>/dev/null | wc -l) rows" test -s "run$1/history.csv" -a -s "run$1/fields.h5"
}

# edit OLD NEW: two_tets.msh with OLD replaced
edit() {
  local text
  text=$(cat "$data/two_tets.msh")
  echo "${text/"$1"/"$2"}"
}

# an earlier result that no failing run may touch
mkdir kept
echo precious >kept/history.csv
kept() {
  error "$1" "$2" body.opts -body_it_mesh "$3" -output_dir kept
  check "$3: the earlier results are gone" test "$(ls -A kept) $(cat kept/history.csv)" = "history.csv precious"
}

# nothing, or the beginning
: >empty.msh
mesh 2 empty.msh "0 bytes"
mesh 3 empty.msh "0 bytes"
head -n 3 "$data/two_tets.msh" >header.msh
mesh 1 header.msh "\$Nodes"
mesh 2 header.msh "\$Nodes"
for size in 1 40 90 130; do
  head -c "$size" "$data/two_tets.msh" >cut.msh
  mesh 2 cut.msh
done
edit $'2 4 0 2 3 4 5\n$EndElements' 2 >cut.msh
mesh 3 cut.msh "line 16"
for file in two_cubes_22_bin two_cubes_41_bin; do
  for size in 60 1900 3600; do
    head -c "$size" "$data/$file.msh" >cut.msh
    mesh 2 cut.msh
  done
done
head -c 2000 "$data/two_cubes_41_bin.msh" >cut.msh
mesh 3 cut.msh "byte 1996"
kept 2 "body 'it'|cut.msh|byte 1996" cut.msh
printf 'solid cube\n' >text.msh
mesh 2 text.msh "line 1"

# numbers that cannot be
edit '4 0 0 1' '4 0 0 nan' >nan.msh
mesh 1 nan.msh "line 9|node 4"
mesh 2 nan.msh "line 9|node 4"
edit '4 0 0 1' '4 0 0 -inf' >inf.msh
mesh 2 inf.msh "line 9|node 4"
edit '2 3 4 5' '2 3 4 6' >missing.msh
mesh 2 missing.msh
edit '4 0 0 1' '4 0.5 0.5 1e-14' >flat.msh
mesh 2 flat.msh "tetrahedron 1"
mesh 3 flat.msh "tetrahedron 1"
kept 2 "body 'it'|flat.msh|tetrahedron 1" flat.msh

# sound meshes that are not of tetrahedra
mesh 2 "$data/bad_hexes.msh" "1 hexahedra"
edit $'1 4 0 1 2 3 4\n2 4 0 2 3 4 5' $'1 2 0 1 2 3\n2 2 0 2 3 4' >surface.msh
mesh 1 surface.msh "2 3-node triangles|gmsh -3"
mesh 2 surface.msh "2 3-node triangles|gmsh -3"

# a format that ends too soon, and one of a finite-element program
printf '%s\n' "\$MeshFormat" '4.0 0 8' "\$EndMeshFormat" >version4.msh
mesh 2 version4.msh "version4.msh"
printf '1 4 0\n1 1 2 3 5\n' >thing.ele
printf '4 3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n' >thing.node
error 2 "body 'it'|thing.ele|line 2|point 5|1 to 4" body.opts -body_it_mesh thing.ele -output_dir new
error 2 "body 'it'|thing.ele|line 2|point 5|1 to 4" body.opts -body_it_mesh thing -output_dir new
runs 2 "$data/two_cubes.bdf" 23 "supple "

# no file
error 2 "-body_it_mesh nix.msh" body.opts -body_it_mesh nix.msh
mkdir folder folder.msh meshes
touch meshes/lobe.geo
error 2 "-body_it_mesh meshes/lobe.msh|make meshes/lobe.msh" body.opts -body_it_mesh meshes/lobe.msh
mesh 2 folder.msh
error 2 "body 'it'|'folder'|.msh" body.opts -body_it_mesh folder

# no place for the results: a file is in the way, and also root writes nothing below /proc
touch file
error 2 "-output_dir file" body.opts -body_it_mesh box:1,1,1:1 -output_dir file
error 3 "-output_dir file/out" body.opts -body_it_mesh box:1,1,1:1 -output_dir file/out
error 2 "-output_dir /proc/out" body.opts -body_it_mesh box:1,1,1:1 -output_dir /proc/out
check "the file in the way has changed" test -f file -a ! -s file

# odd, but sound: more ranks than tets, numbers with gaps, vertices that nothing uses, an inverted tet, a double tet
runs 1 "$data/two_tets.msh" 5 "supple "
runs 3 "$data/two_tets.msh" 5 "supple "
runs 4 "$data/one_tet.msh" 4 "supple "
edit $'4 0 0 1\n5 1 1 1' $'70 0 0 1\n50000000000 1 1 1' | sed 's/1 2 3 4$/1 2 3 70/; s/2 3 4 5$/2 3 70 50000000000/' >gaps.msh
runs 2 gaps.msh 5 "supple "
edit $'5\n1 0 0 0' $'7\n8 9 9 9\n9 8 8 8\n1 0 0 0' >unused.msh
runs 1 unused.msh 5 "body 'it': unused.msh: unused vertices left out: 2"
runs 3 unused.msh 5 "body 'it': unused.msh: unused vertices left out: 2"
runs 2 "$data/odd.msh" 8 "unused vertices left out: 2, inverted tets turned: 1, parts that share no vertex: 2"

finish
