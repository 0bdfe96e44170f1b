// A cube of 0.1 m whose surface has finer triangles than its core has tets: what it is for is told in scenarios/knead.opts.
SetFactory("Built-in");
L = 0.1; h = 0.02;
Point(1) = {0, 0, 0, h}; Point(2) = {L, 0, 0, h}; Point(3) = {L, L, 0, h}; Point(4) = {0, L, 0, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
out[] = Extrude {0, 0, L} { Surface{1}; };
Field[1] = MathEval;
Field[1].F = "0.1";
Mesh.MeshSizeExtendFromBoundary = -2;
Physical Volume("soft") = {out[1]};
Physical Surface("low") = {1};
Physical Surface("high") = {out[0]};
