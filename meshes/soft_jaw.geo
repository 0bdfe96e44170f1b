// soft_jaw.geo - the jaw of a gripper, 14 x 30 x 46 mm, that hangs from z = 0, with a chamber behind its soft side, x = 0, in m.
//
//   gmsh -3 -format msh41 -o meshes/soft_jaw.msh meshes/soft_jaw.geo
//
// Physical groups: volume `jaw`; surfaces `chamber`, the wall of the chamber, `back` (x = 14 mm) and `skin`, the rest of the outside.
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.008, Name "Edge length, m"} ];

Box(1) = {0, -0.015, -0.046, 0.014, 0.03, 0.046};
Box(2) = {0.002, -0.012, -0.043, 0.006, 0.024, 0.04};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };

e = 1e-6;
back() = Surface In BoundingBox {0.014 - e, -1, -1, 0.014 + e, 1, 1};
chamber() = Surface In BoundingBox {0.002 - e, -0.012 - e, -0.043 - e, 0.008 + e, 0.012 + e, -0.003 + e};
skin() = Surface In BoundingBox {-1, -1, -1, 1, 1, 1};
skin() -= back();
skin() -= chamber();
Physical Volume("jaw") = {3};
Physical Surface("back") = {back()};
Physical Surface("chamber") = {chamber()};
Physical Surface("skin") = {skin()};
Mesh.CharacteristicLengthMin = size;
Mesh.CharacteristicLengthMax = size;
