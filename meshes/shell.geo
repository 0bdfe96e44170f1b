// shell.geo - an eighth of a thick-walled sphere, radii 1 and 2, between the planes x = 0, y = 0 and z = 0. Lengths in m.
//
//   gmsh -3 -format msh41 -o meshes/shell.msh meshes/shell.geo
//   gmsh -3 -format msh41 -setnumber size 0.15 -o fine.msh meshes/shell.geo
//
// Physical groups: volume `shell`; surfaces `inside`, `outside`, and `x0`, `y0`, `z0` in the planes of symmetry.
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.3, Name "Edge length, m"} ];

Sphere(1) = {0, 0, 0, 2, 0, Pi / 2, Pi / 2};
Sphere(2) = {0, 0, 0, 1, 0, Pi / 2, Pi / 2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };

e = 1e-4;
x() = Surface In BoundingBox{-e, -e, -e, e, 2 + e, 2 + e};
y() = Surface In BoundingBox{-e, -e, -e, 2 + e, e, 2 + e};
z() = Surface In BoundingBox{-e, -e, -e, 2 + e, 2 + e, e};
i() = Surface In BoundingBox{-e, -e, -e, 1 + e, 1 + e, 1 + e};
skin() = Abs(Boundary{ Volume{3}; });
skin() -= x();
skin() -= y();
skin() -= z();
skin() -= i();
Physical Volume("shell") = {3};
Physical Surface("x0") = x();
Physical Surface("y0") = y();
Physical Surface("z0") = z();
Physical Surface("inside") = i();
Physical Surface("outside") = skin();

Mesh.MeshSizeMax = size;
Mesh.MeshSizeMin = size;
Mesh.Algorithm = 6;
Mesh.Optimize = 1;
