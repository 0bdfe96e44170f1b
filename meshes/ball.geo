// ball.geo - a ball of 20 mm radius around the origin, in m.
//
//   gmsh -3 -format msh41 -o meshes/ball.msh meshes/ball.geo                       about 200 triangles on its surface
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.009, Name "Edge length, m"} ];

Sphere(1) = {0, 0, 0, 0.02};
Physical Volume("ball") = {1};
Mesh.CharacteristicLengthMin = size;
Mesh.CharacteristicLengthMax = size;
