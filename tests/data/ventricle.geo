// ventricle.geo - the wall between two half ellipsoids of revolution about the z axis, cut at a height: the left ventricle of Land et al. (2015). Lengths in mm.
//
//   gmsh -3 -format msh41 -setnumber across 4 -o ventricle.msh tests/data/ventricle.geo
//
// A section of the wall is divided into `across` layers, three times as many along it, and turned in four times as many steps: fibres turn across the wall, and need layers. (gmsh folds tets
// of second order at the axis; scripts/ventricle bends the edges.)
// Physical groups: volume `wall`; surfaces `endo` (inside), `epi` (outside), `base` (the cut). Both apices are vertices.
DefineConstant[
  across = {3, Name "Layers of the wall"}, short_endo = {7, Name "Half axis of the inside across"}, long_endo = {17, Name "Half axis of the inside along z"},
  short_epi = {10, Name "Half axis of the outside across"}, long_epi = {20, Name "Half axis of the outside along z"}, cut = {5, Name "z of the base"}
];
along = 3 * across;
quarter = across;

// the section in the half plane of x, from the apices to the base
Point(1) = {0, 0, 0};
Point(2) = {0, 0, -long_endo};
Point(3) = {0, 0, -long_epi};
Point(4) = {short_endo * Sqrt(1 - (cut / long_endo)^2), 0, cut};
Point(5) = {short_epi * Sqrt(1 - (cut / long_epi)^2), 0, cut};
Ellipse(1) = {2, 1, 2, 4};
Ellipse(2) = {3, 1, 3, 5};
Line(3) = {2, 3};
Line(4) = {4, 5};
Curve Loop(1) = {3, 2, -4, -1};
Plane Surface(1) = {1};
Transfinite Curve {1, 2} = along + 1;
Transfinite Curve {3, 4} = across + 1;
Transfinite Surface {1} = {2, 3, 5, 4};

// four quarters; of each the surfaces that the curves epi, base and endo sweep
section = 1;
wall() = {};
epi() = {};
base() = {};
endo() = {};
For k In {1 : 4}
  swept() = Extrude {{0, 0, 1}, {0, 0, 0}, Pi / 2} { Surface{section}; Layers{quarter}; };
  section = swept(0);
  wall() += swept(1);
  epi() += swept(2);
  base() += swept(3);
  endo() += swept(4);
EndFor
Physical Surface("endo") = {endo()};
Physical Surface("epi") = {epi()};
Physical Surface("base") = {base()};
Physical Volume("wall") = {wall()};
