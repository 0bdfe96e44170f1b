// hook.geo - a blunt hook: a round rod that comes down, bends by half a turn and ends in a ball. Lengths in mm.
//
//   gmsh -3 -format msh41 -o meshes/hook.msh meshes/hook.geo                       about 1,900 triangles on its surface
//   gmsh -3 -format msh41 -setnumber size 2 -o fine.msh meshes/hook.geo            finer
//
// Its axis lies in the yz plane; the bend is around (0, 0, bend), its lowest place at the origin.
SetFactory("OpenCASCADE");
DefineConstant[ size = {3, Name "Edge length, mm"} ];

rod = 7;      // radius of the rod
bend = 24;    // radius of its axis in the bend
shank = 45;   // length above the bend

Point(1) = {0, -bend, bend + shank};
Point(2) = {0, -bend, bend};
Point(3) = {0, 0, bend};
Point(4) = {0, 0, 0};
Point(5) = {0, bend, bend};
Line(1) = {1, 2};
Circle(2) = {2, 3, 4};
Circle(3) = {4, 3, 5};
Wire(1) = {1, 2, 3};
Disk(1) = {0, -bend, bend + shank, rod};
swept() = Extrude { Surface{1}; } Using Wire {1};
Sphere(100) = {0, bend, bend, rod};
BooleanUnion{ Volume{swept(0)}; Delete; }{ Volume{100}; Delete; }
Delete { Surface{1}; }
Physical Volume("hook") = Volume{:};
Mesh.CharacteristicLengthMin = size;
Mesh.CharacteristicLengthMax = size;
