#!/usr/bin/env bash
# supple-mesh from the command line: what info says, that formats keep a mesh, that refined and repaired meshes simulate,
# that a run's output is a mesh again, exit codes and messages.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh
data=$top/tests/data
tool=$(dirname "$supple")/supple-mesh

# ok ARGUMENT...: must succeed and say nothing on standard error
ok() {
  "$tool" "$@" >out.txt 2>err.txt
  check "supple-mesh $*: exit code $?: $(cat err.txt)" test $? = 0
  check "supple-mesh $*: on standard error: $(cat err.txt)" test ! -s err.txt
}
# says TEXT: what the last command printed holds the text, blanks counting as one
says() {
  check "no '$1' in: $(cat out.txt)" grep -qF -- "$1" <(tr -s ' ' <out.txt)
}
# refuses NAMES ARGUMENT...: must fail with one line that names all of NAMES, with | between them
refuses() {
  local code name
  local -a names
  IFS='|' read -ra names <<<"$1"
  shift
  "$tool" "$@" >out.txt 2>err.txt
  code=$?
  check "supple-mesh $*: exit code $code" test "$code" -ne 0
  check "supple-mesh $*: no error line" grep -q '^supple-mesh: error: ' err.txt
  for name in "${names[@]}"; do check "supple-mesh $*: '$(cat err.txt)' does not name $name" grep -qF -- "$name" err.txt; done
  check "supple-mesh $*: $(wc -l <err.txt) lines" test "$(wc -l <err.txt)" = 1
}
# same FILE FILE: the two hold the same mesh, written as text of version 4.1
same() {
  "$tool" convert "$1" one.msh -quiet
  "$tool" convert "$2" two.msh -quiet
  check "$1 and $2 differ" cmp -s one.msh two.msh
}

# info: numbers of a known mesh
ok info "$data/two_cubes_41.msh"
for text in " vertices 23" " tets 48" " left 24 tets, 1 m^3 (number 1)" " both ends 8 triangles, 2 m^2 (number 4)" " volume 2 m^3" \
  " surface 10 m^2, 40 facets" " edges 90: " " faces 116" " parts 1" " p1 69 " " cr 348 " " dg 576 " " p2 339 " \
  "dihedral angles, degrees: 54.7 to 109.5" " 50 to 60 128 #" " 1 to 1.25 48 #"; do
  says "$text"
done
ok info "$data/two_cubes_41.msh" -scale 0.1 -translate 1,2,3
says "from (1, 2, 3) to (1.2, 2.1, 3.1)"
says " volume 0.002 m^3"
ok info box:1,2,3:2 -quiet
"$tool" info box:1,2,3:2 >/dev/full 2>err.txt
code=$?
check "info: exit code $code on a full disk: $(cat err.txt)" test "$code $(grep -c '^supple-mesh: error: .*standard output' err.txt)" = "1 1"
says " volume 6 m^3"
ok info "$data/odd.msh"
says " to know: unused vertices left out: 2, inverted tets turned: 1, parts that share no vertex: 2"
# a tet of second order whose edge 1 2 goes through the others folds over itself: where, and that repair makes it straight
# shellcheck disable=SC2016 # gmsh's own
printf '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0.5 0.9 0.9\n6 0.5 0.5 0\n7 0 0.5 0
8 0 0 0.5\n9 0 0.5 0.5\n10 0.5 0 0.5\n$EndNodes\n$Elements\n1\n7 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n$EndElements\n' >fold.msh
ok info fold.msh
says "made straight: 1 (the first: tetrahedron 7 at (0.25, 0.25, 0.25) m)"
ok repair fold.msh unfolded.msh
says "made straight, the first tetrahedron 7"
ok info unfolded.msh
check "a repaired mesh folds" test "$(grep -c straight out.txt)" = 0
refuses "$data/bad_twice.msh|1 and 3" info "$data/bad_twice.msh"
says " tets 3"

# convert: every format and back
for format in msh41 msh41_binary msh22 msh22_binary; do
  ok convert "$data/two_cubes_41.msh" "$format.msh" -format "$format"
  says "$format.msh: 23 vertices, 48 tets, "
done
ok convert msh41_binary.msh cubes.h5
says "cubes.h5: 23 vertices, 48 tets, 12 triangles, 1 lines, 1 points"
check "no index for ParaView" grep -q "cubes.h5:/mesh/cells" cubes.xmf
cat >read.py <<'END_PYTHON'
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

reader = vtkXdmfReader()
reader.SetFileName("cubes.xmf")
reader.Update()
grids = reader.GetOutputDataObject(0)
print([(g.GetNumberOfPoints(), g.GetNumberOfCells(), g.GetCellData().GetArrayName(0)) for g in map(grids.GetBlock, range(2))])
END_PYTHON
check "what ParaView's reader finds: $("$top/.venv/bin/python" read.py 2>&1)" \
  test "$("$top/.venv/bin/python" read.py 2>&1)" = "[(23, 48, 'tag_set'), (23, 12, 'tag_set')]"
same "$data/two_cubes_41.msh" msh41.msh
same "$data/two_cubes_41.msh" msh41_binary.msh
same "$data/two_cubes_41.msh" cubes.h5
same cubes.h5 cubes.xmf
same msh22.msh msh22_binary.msh
ok convert cubes.h5 cubes.h5
same "$data/two_cubes_41.msh" cubes.h5

# refine: volume, groups, and it simulates; one and two ranks give the same
ok refine cubes.h5 fine.h5 -levels 2
says "fine.h5: 689 vertices, 3,072 tets, 192 triangles, 4 lines, 1 points"
ok info fine.h5
for text in " tets 3,072" " left 1,536 tets, 1 m^3" " both ends 128 triangles, 2 m^2" " volume 2 m^3" " surface 10 m^2, 640 facets"; do
  says "$text"
done
cat >body.opts <<'END_OPTIONS'
-bodies it
-body_it_material linear
-body_it_young 1e5     # Pa
-body_it_poisson 0.3
-effects gravity,hold
-effect_gravity_vector 0,0,-9.81
-effect_hold_type fixed
-effect_hold_on wall
-time static
-output_precision double
END_OPTIONS
# run FOLDER RANKS ARGUMENT...
run() {
  "${mpi[@]}" "$2" "$supple" body.opts -output_dir "$1" "${@:3}" >log.txt 2>&1
  check "$*: exit code $?: $(tail -n 3 log.txt)" test $? = 0
}
strain() { # last strain energy of a run, with the name of its column found in the head
  awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /^strain/) k = i } END { print $k }' "$1/history.csv"
}
close() { # two numbers and a relative tolerance
  awk -v a="$1" -v b="$2" -v t="$3" 'BEGIN { exit !(a != 0 && (a - b) ^ 2 <= (t * a) ^ 2) }'
}
run coarse 1 -body_it_mesh cubes.h5
run gmsh 1 -body_it_mesh "$data/two_cubes_41.msh"
run fine 1 -body_it_mesh fine.h5
run fine2 2 -body_it_mesh fine.h5
check "strain energy $(strain coarse) from .h5, $(strain gmsh) from .msh" test "$(strain coarse)" = "$(strain gmsh)"
check "strain energy on one rank $(strain fine), on two $(strain fine2)" close "$(strain fine)" "$(strain fine2)" 1e-5
check "strain energy falls when refined: $(strain coarse), $(strain fine)" awk -v a="$(strain coarse)" -v b="$(strain fine)" 'BEGIN { exit !(b > a) }'

# a program tetgen that hangs is ended
mkdir -p hangs
printf '#!/bin/sh\nexec sleep 100\n' >hangs/tetgen
chmod +x hangs/tetgen
PATH=$PWD/hangs:$PATH refuses "tetgen|0.5 s|-seconds" tet "$data/bead.obj" never.msh -tetrahedralizer tetgen -seconds 0.5

# a run's output is a mesh: at rest the one that went in, at its end the deformed one
ok info coarse/fields.h5
says " it 48 tets, 2 m^3 (number 1)"
ok convert coarse/fields.xmf end.msh -step -1
ok info end.msh
check "the deformed mesh has the volume of the one at rest" test -z "$(tr -s ' ' <out.txt | grep -x ' volume 2 m^3')"
refuses "coarse/fields.h5|step 99" convert coarse/fields.h5 end.msh -step 99
run again 2 -body_it_mesh coarse/fields.h5 -body_it_mesh_step -1 -effect_hold_on low -sets low -set_low_at plane:1,0,0,0,0.01

# repair
refuses "$data/bad_flat.msh" repair "$data/bad_flat.msh" never.msh
check "a file was left" test ! -e never.msh -a ! -e never.msh.part
ok repair "$data/bad_twice.msh" once.msh
says "tets given again, dropped: 1"
ok info once.msh
says " tets 2"
refuses "$data/bad_vertex_twice.msh" repair "$data/bad_vertex_twice.msh" never.msh
sed 's/^2 4 0 2 3 4 5/&\n3 4 0 2 3 3 5/; s/^2$/3/' "$data/two_tets.msh" >vertex_twice.msh
ok repair vertex_twice.msh mended.msh
says "tets that used a vertex twice, dropped: 1"
ok repair "$data/odd.msh" even.msh
says "inverted tets turned: 1"
says "unused vertices dropped: 2"
ok repair even.msh even2.msh
says "nothing to repair"
same even.msh even2.msh

# a surface becomes tets, with its area and volume, and is drawn
cat >cube.off <<'END_OFF'
OFF
8 6 0
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
4 3 2 1 0
4 4 5 6 7
4 0 1 5 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
END_OFF
ok tet cube.off cube.h5 -size 0.5 -quiet
ok info cube.h5
says " volume 1 m^3"
says " surface 6 m^2, "
says " region_1 "
"$tool" convert cube.h5 cube.msh -view cube.png >out.txt 2>err.txt
check "a picture: exit code $?: $(cat err.txt)" test "$(head -c 4 cube.png | tail -c 3)" = PNG
refuses "cube.msh" tet cube.msh x.h5
refuses "cube.off|0.0001 m|8.5e+12 tets|0.00554 m|-size" tet cube.off x.h5 -size 1e-4
refuses "cube.off|-merge_tolerance 0.9 m" tet cube.off x.h5 -merge_tolerance 0.9
error 2 "body 'it'|cube.off|0.0001 m|8.5e+12 tets|0.00554 m|-body_it_tet_size" \
  body.opts -body_it_mesh cube.off -body_it_tet_size 1e-4 -output_dir new
refuses "-size -1 m|(0, inf) m" tet cube.off x.h5 -size -1
refuses "-view cube.gif|.png" info cube.h5 -view cube.gif

# mistakes
refuses "command"
refuses "'inof'|info, convert, " inof cubes.h5
check "no near name: $(cat err.txt)" grep -q "did you mean info?" err.txt
refuses "convert FILE OUT|2|1" convert cubes.h5
refuses "-levles|-levels" refine cubes.h5 x.h5 -levles 2
refuses "-levels|info|refine" info cubes.h5 -levels 2
refuses "-levels 9|[1, 8]" refine cubes.h5 x.h5 -levels 9
refuses "nix.msh" info nix.msh
refuses "x.doc|.msh|.h5" convert cubes.h5 x.doc
refuses "/proc/x.msh" convert cubes.h5 /proc/x.msh
head -c 3000 cubes.h5 >cut.h5
refuses "cut.h5|3000 bytes" info cut.h5
error 2 "body 'it'|cut.h5|3000 bytes" body.opts -body_it_mesh cut.h5 -output_dir new
ok -help
says "supple-mesh refine FILE OUT"
ok -version
says "supple-mesh "
"${mpi[@]}" 2 "$tool" info cubes.h5 >out.txt 2>err.txt
check "on two ranks: $(cat err.txt)" grep -qF "runs on one process, not on 2" err.txt

finish
