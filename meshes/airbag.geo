// airbag.geo - a cushion of 120 x 120 x 60 mm with walls of 10 mm around a chamber, in m.
//
//   gmsh -3 -format msh41 -o meshes/airbag.msh meshes/airbag.geo
//
// Physical groups: volume `cushion`; surfaces `chamber`, the wall of the chamber, `bottom` (z = 0) and `outside`, the rest of the outside.
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.02, Name "Edge length, m"} ];

Box(1) = {0, 0, 0, 0.12, 0.12, 0.06};
Box(2) = {0.01, 0.01, 0.01, 0.1, 0.1, 0.04};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };

e = 1e-6;
bottom() = Surface In BoundingBox {-e, -e, -e, 0.12 + e, 0.12 + e, e};
chamber() = Surface In BoundingBox {0.01 - e, 0.01 - e, 0.01 - e, 0.11 + e, 0.11 + e, 0.05 + e};
outside() = Surface In BoundingBox {-1, -1, -1, 1, 1, 1};
outside() -= bottom();
outside() -= chamber();
Physical Volume("cushion") = {3};
Physical Surface("bottom") = {bottom()};
Physical Surface("chamber") = {chamber()};
Physical Surface("outside") = {outside()};
Mesh.CharacteristicLengthMin = size;
Mesh.CharacteristicLengthMax = size;
