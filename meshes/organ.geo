// organ.geo - a smooth, liver-like body, 0.2 m across, held by a ligament on its top. Lengths in m.
//
//   gmsh -3 -format msh41 -o meshes/organ.msh meshes/organ.geo                     about 20,000 tets
//   gmsh -3 -format msh41 -setnumber size 0.005 -o fine.msh meshes/organ.geo       finer: edges of 5 mm
//
// A loft through closed splines across the x axis: a thick right lobe (x > 0), a flat left one (x < 0), a notch in the lower
// edge between them, a dome on top, the underside hollow. Both ends of the loft are small flat caps.
// Physical groups: volume `organ`; surfaces `ligament` (an oval on the top, where it is held) and `surface` (the rest).
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.006, Name "Edge length, m"} ];

length = 0.1;      // half of the extent along x
nstation = 11;     // sections along x
npoint = 16;       // points of one section
cap = 0.14;        // angle on a circle, rad, at which the loft ends

section() = {};
For i In {0 : nstation - 1}
  phi = cap + (Pi - 2 * cap) * i / (nstation - 1);
  s = -Cos(phi);                           // -1 left .. 1 right
  r = Sin(phi)^0.9;                        // the sections of an ellipsoid, the ends a little fuller
  fat = 0.5 + 0.5 * Tanh(2.5 * s + 0.5);   // 0 in the left lobe, 1 in the right one
  a = r * (0.040 + 0.018 * fat);           // half depth, y
  b = r * (0.021 + 0.036 * fat);           // half height, z
  yc = -0.004 * (1 - fat);
  zc = 0.022 * (1 - fat);
  notch = 0.022 * r * Exp(-((s + 0.12) / 0.16)^2);
  first = newp;
  For k In {0 : npoint - 1}
    theta = 2 * Pi * k / npoint;
    c = Cos(theta);                        // front (negative) to back
    n = Sin(theta);                        // bottom to top
    low = 0.5 * (1 - Tanh(4 * (n + 0.3))); // 1 on the underside
    hollow = 0.4 * b * fat * Exp(-((c - 0.25) / 0.5)^2);
    Point(first + k) = {length * s, yc + a * c * (1 + 0.15 * n) + 0.3 * a * n, zc + b * n + low * (hollow + notch), size};
  EndFor
  curve = newl;
  Spline(curve) = {first : first + npoint - 1, first};
  section() += curve;
  Curve Loop(i + 1) = {curve};
EndFor
ThruSections(1) = {1 : nstation};

// The ligament: the part of the skin inside an upright oval cylinder that begins in the middle of the body. The skin is cut
// along it, and the volume built again from the pieces, so that nothing inside is divided.
skin() = Boundary{ Volume{1}; };
Delete { Volume{1}; }
oval = news;
Disk(oval) = {0.002, 0.014, 0.01, 0.042, 0.025};
tool() = Extrude{0, 0, 0.1}{ Surface{oval}; };
inside() = BooleanIntersection{ Surface{skin()}; }{ Volume{tool(1)}; };
outside() = BooleanDifference{ Surface{skin()}; Delete; }{ Volume{tool(1)}; Delete; };
pieces() = BooleanFragments{ Surface{inside()}; Delete; }{ Surface{outside()}; Delete; };
shell = newsl;
Surface Loop(shell) = pieces();
body = newv;
Volume(body) = {shell};

// Building the volume may have copied a piece: only what bounds the volume counts.
boundary() = Abs(Boundary{ Volume{body}; });
surface() = boundary();
surface() -= inside();
pieces() -= boundary();
Recursive Delete { Surface{pieces()}; Curve{section()}; }
Physical Volume("organ") = {body};
Physical Surface("ligament") = inside();
Physical Surface("surface") = surface();

Mesh.MeshSizeMax = size;
Mesh.OptimizeThreshold = 0.5;   // without it one or two tets come out flat
Mesh.Algorithm = 6;
Mesh.Optimize = 1;
