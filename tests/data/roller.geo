// roller.geo - a roller on a block, half of both by symmetry, one layer of tets. Lengths in mm.
//   gmsh -3 -format msh41 -setnumber part 1 -o roller.msh roller.geo          the roller; part 2: the block
DefineConstant[ size = {0.8, Name "Edge length where they touch"}, part = {1, Name "1: roller, 2: block"} ];
near = 12;   // half width of the fine part
If (part == 1)
  a = Asin(near/50);
  Point(1) = {0, 0, 0, size};
  Point(2) = {0, 50, 0, 12};
  Point(3) = {50, 50, 0, 12};
  Point(4) = {50*Sin(a), 50 - 50*Cos(a), 0, size};
  Line(1) = {1, 2}; Line(2) = {2, 3}; Circle(3) = {3, 2, 4}; Circle(4) = {4, 2, 1};
  Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
  e[] = Extrude {0, 0, size} { Surface{1}; Layers{1}; };
  Physical Surface("middle") = {e[2]};
  Physical Surface("top") = {e[3]};
  Physical Surface("arc") = {e[4], e[5]};
Else
  Point(1) = {0, 0, 0, size};
  Point(2) = {near, 0, 0, size};
  Point(3) = {100, 0, 0, 20};
  Point(4) = {100, -200, 0, 30};
  Point(5) = {0, -200, 0, 30};
  Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 1};
  Curve Loop(1) = {1, 2, 3, 4, 5}; Plane Surface(1) = {1};
  e[] = Extrude {0, 0, size} { Surface{1}; Layers{1}; };
  Physical Surface("top") = {e[2], e[3]};
  Physical Surface("bottom") = {e[5]};
  Physical Surface("middle") = {e[6]};
EndIf
Physical Volume("inside") = {e[1]};
Physical Surface("sides") = {1, e[0]};
