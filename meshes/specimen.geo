// specimen.geo - a flat dumbbell for a tensile test of soft tissue: 60 mm long, 4 mm thick, 10 mm wide in the middle and
// 20 mm at the ends, rounded shoulders. Lengths in m; the long axis is x, the middle is the origin.
//
//   gmsh -3 -format msh41 -o meshes/specimen.msh meshes/specimen.geo
//
// Physical groups: volume `specimen`; surfaces `left` and `right` (the end faces), `surface` (the rest).
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.002, Name "Edge length, m"} ];

half = 0.03;      // half of the length
wide = 0.01;      // half of the width at the ends
thin = 0.005;     // half of the width in the middle
thick = 0.004;
shoulder = 0.016; // x where the ends begin

Rectangle(1) = {-half, -wide, 0, 2 * half, 2 * wide};
// What is cut away on both sides: a slot with round ends.
For side In {0 : 1}
  y = side ? thin : -thin - 2 * wide;
  Rectangle(10 + side) = {-shoulder, y, 0, 2 * shoulder, 2 * wide, wide / 2};
EndFor
flat() = BooleanDifference{ Surface{1}; Delete; }{ Surface{10, 11}; Delete; };
Extrude{0, 0, thick}{ Surface{flat()}; }

Physical Volume("specimen") = Volume{:};
skin() = Abs(Boundary{ Volume{:}; });
e = 1e-5;
left() = Surface In BoundingBox{-half - e, -wide - e, -e, -half + e, wide + e, thick + e};
right() = Surface In BoundingBox{half - e, -wide - e, -e, half + e, wide + e, thick + e};
skin() -= left();
skin() -= right();
Physical Surface("left") = left();
Physical Surface("right") = right();
Physical Surface("surface") = skin();

Mesh.MeshSizeMax = size;
Mesh.MeshSizeMin = size;
Mesh.Algorithm = 6;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = 0.5;
