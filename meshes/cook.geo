// cook.geo - Cook's membrane, (0,0) (48,44) (48,60) (0,44), as a slab one cell thick for plane strain. Lengths in m.
//
//   gmsh -3 -format msh41 -o meshes/cook.msh meshes/cook.geo
//   gmsh -3 -format msh41 -setnumber size 1 -o fine.msh meshes/cook.geo
//
// Physical groups: volume `membrane`; surfaces `left`, `right`, `back` (z = 0), `front`. The triangles are not in rows: on
// such a mesh linear tets lock. The middle of the right edge is a vertex.
DefineConstant[ size = {4, Name "Edge length, m"} ];

Point(1) = {0, 0, 0, size};
Point(2) = {48, 44, 0, size};
Point(3) = {48, 52, 0, size};
Point(4) = {48, 60, 0, size};
Point(5) = {0, 44, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Curve Loop(1) = {1 : 5};
Plane Surface(1) = {1};
out() = Extrude{0, 0, size}{ Surface{1}; Layers{1}; };

Physical Volume("membrane") = {out(1)};
Physical Surface("back") = {1};
Physical Surface("front") = {out(0)};
Physical Surface("right") = {out(3), out(4)};
Physical Surface("left") = {out(6)};

Mesh.Algorithm = 6;
