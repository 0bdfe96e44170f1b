// Two unit cubes side by side, with physical groups of every dimension, several per entity, overlapping volumes, one
// inner surface and one group without a name. The four two_cubes_*.msh were made from it by
//   gmsh -3 -format msh22 [-bin] two_cubes.geo -o two_cubes_22[_bin].msh   and the same with 41.
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1};
Box(2) = {1, 0, 0, 1, 1, 1};
BooleanFragments{ Volume{1, 2}; Delete; }{}
Mesh.CharacteristicLengthMin = 1;
Mesh.CharacteristicLengthMax = 1;
low() = Surface In BoundingBox{-0.1, -0.1, -0.1, 0.1, 1.1, 1.1};
high() = Surface In BoundingBox{1.9, -0.1, -0.1, 2.1, 1.1, 1.1};
inner() = Surface In BoundingBox{0.9, -0.1, -0.1, 1.1, 1.1, 1.1};
Physical Volume("left") = {1};
Physical Volume("all") = {1, 2};
Physical Surface("wall") = {low()};
Physical Surface("both ends") = {low(), high()};
Physical Surface("inner") = {inner()};
Physical Surface(77) = {high()};
Physical Curve("edge") = Curve In BoundingBox{-0.1, -0.1, -0.1, 0.1, 0.1, 1.1};
Physical Point("corner") = Point In BoundingBox{-0.1, -0.1, -0.1, 0.1, 0.1, 0.1};
