// lobe.geo - the body of organ.geo with a coarse mesh, about 2,200 tets: for scenes of contact. Lengths in m.
//
//   gmsh -3 -format msh41 -o meshes/lobe.msh meshes/lobe.geo
size = 0.014; // edges; organ.geo keeps what is set before
Include "organ.geo";
