/*
  info.c - supple-mesh info: contents and quality of a mesh, whether a run accepts it, its memory in
  a run.

  The estimate uses counts of the mesh. N nodes of the element: vertices (p1), faces (cr), four in
  every tet (dg), vertices and edges (p2). A row of the matrix has a block of 3 x 3 numbers for its
  node and for each node coupled with it; total number of blocks:

    p1  N + 2 edges
    cr  N + 12 per tet (six pairs of faces, each pair in one tet only) + 18 per interior face, whose
    jump term
        couples the three other faces of one side with those of the other
    dg  16 per tet + 32 per interior face
    p2  N + 6 per edge + 12 per face + 6 per tet (the three edges of a triangle are coupled with
    each other
        and each with the opposite corner; a tet has three pairs of opposite edges)

  The other constants were measured, see below. docs/reference/meshes.md gives the accuracy.
*/
#include "tool.h"

#define PROCESS 43e6 /* memory of a run with a very small mesh, bytes */
#define TET 600.     /* memory of a tet in mesh and geometry, with vertices and boundary, bytes */
#define FACTOR 4096. /* memory of a factorisation per unknown, bytes */
#define FACTORED \
  60000 /* largest number of unknowns that -solver auto factorises in a dynamic run */

static PetscErrorCode groups(const SbImport *mesh)
{
  static const char *const title[4] = {"points", "curves", "surfaces", "regions"};
  static const char *const item[4] = {"points", "lines", "triangles", "tets"};
  static const char *const unit[4] = {"", "m", "m^2", "m^3"};

  PetscFunctionBeginUser;
  for (int d = 3; d >= 0; d--) {
    PetscBool titled = PETSC_FALSE;

    for (PetscInt g = 0; g < mesh->ngroup; g++) {
      const SbGroup *group = &mesh->group[g];
      char number[32];
      PetscReal size;
      PetscInt n;

      if (group->dim != d)
        continue;
      PetscCall(SbMeshFileGroup(mesh, g, &n, &size));
      if (!titled)
        (void)printf("%s\n", title[d]);
      titled = PETSC_TRUE;
      (void)printf("  %-26s %12s %s", group->name, SbToolNumber(n, number), item[d]);
      if (d)
        (void)printf(", %.6g %s", (double)size, unit[d]);

      /* formats with names only have no group numbers */
      if (group->tag > 0 && group->tag <= INT32_MAX)
        (void)printf(" (number %lld)", (long long)group->tag);
      (void)printf("\n");
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints a histogram; a bar has at most 40 signs, at least one if n > 0. */
static void bars(int nbin, const char label[][32], const PetscInt64 n[])
{
  const char *signs = "########################################";
  PetscInt64 most = 1;
  char number[32];

  for (int i = 0; i < nbin; i++)
    most = PetscMax(most, n[i]);
  for (int i = 0; i < nbin; i++)
    (void)printf("  %-14s %14s %.*s\n", label[i], SbToolNumber(n[i], number),
                 n[i] ? (int)PetscMax(1, 40 * n[i] / most) : 0, signs);
}

/* Memory in bytes of a run of one step on one rank, by element. */
static PetscReal memory(const SbMeshStatistics *f, const char *element, PetscInt *unknowns,
                        PetscReal *matrix)
{
  const PetscReal inner = f->nface - f->body.nfacet;
  const PetscReal ncell = f->body.ncell;
  PetscReal nodes = f->body.nvert;
  PetscReal blocks = nodes + 2. * f->nedge;
  PetscReal times = 1.9; /* matrix, assembly plan, preconditioner */

  if (!strcmp(element, "cr")) {
    nodes = f->nface;
    blocks = nodes + 12 * ncell + 18 * inner;
  } else if (!strcmp(element, "dg")) {
    nodes = 4 * ncell;
    blocks = 16 * ncell + 32 * inner;
    times = 2.45;
  } else if (!strcmp(element, "p2")) {
    nodes = f->body.nvert + f->nedge;
    blocks = nodes + 6. * f->nedge + 12. * f->nface + 6 * ncell;
    times = 2.3;
  }
  *unknowns = (PetscInt)(3 * nodes);
  *matrix = 72 * blocks;
  return PROCESS + TET * ncell + times * *matrix + (*unknowns <= FACTORED ? FACTOR * *unknowns : 0);
}

PetscErrorCode SbToolInfo(SbTool *tool, SbImport *mesh)
{
  SbMeshStatistics facts;
  char number[32], label[SB_ANGLE_BINS][32]; /* of both histograms */
  const PetscReal *b = facts.body.bbox;
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};
  static const char *const what[4] = {"points of groups", "lines of groups", "triangles of groups",
                                      "tets"};

  PetscFunctionBeginUser;
  (void)printf("%s\n  %-26s %12s\n", tool->in, "vertices", SbToolNumber(mesh->nvert, number));
  for (int d = 3; d >= 0; d--)
    if (d == 3 || mesh->item[d].n)
      (void)printf("  %-26s %12s\n", what[d], SbToolNumber(mesh->item[d].n, number));
  PetscCall(groups(mesh));
  (void)fflush(stdout);
  SB_TOOL_PHASE(tool, "measuring", SbMeshFileMeasure(mesh, &facts));

  // dimensions and counts
  (void)printf("size (coordinates in m)\n");
  (void)printf("  from (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g)\n", (double)b[0], (double)b[1],
               (double)b[2], (double)b[3], (double)b[4], (double)b[5]);
  (void)printf("  %-26s %12.6g m^3\n", "volume", (double)facts.body.volume);
  (void)printf("  %-26s %12.6g m^2, %s facets\n", "surface", (double)facts.area,
               SbToolNumber(facts.body.nfacet, number));
  (void)printf("  %-26s %12s\n", "parts", SbToolNumber(facts.body.npart, number));
  (void)printf("  %-26s %12s: shortest %.4g m, mean %.4g m, longest %.4g m\n", "edges",
               SbToolNumber(facts.nedge, number), (double)facts.edge[0], (double)facts.edge[1],
               (double)facts.edge[2]);
  (void)printf("  %-26s %12s\n", "faces", SbToolNumber(facts.nface, number));
  if (facts.body.note[0])
    (void)printf("  to know: %s\n", facts.body.note);

  // shape quality of the tets
  (void)printf("dihedral angles, degrees: %.3g to %.4g (70.5 in the regular tet)\n",
               (double)facts.body.min_dihedral, (double)facts.max_dihedral);
  for (int i = 0; i < SB_ANGLE_BINS; i++)
    (void)snprintf(label[i], sizeof(label[i]), "%3d to %3d", 180 / SB_ANGLE_BINS * i,
                   180 / SB_ANGLE_BINS * (i + 1));
  bars(SB_ANGLE_BINS, (const char(*)[32])label, facts.angle);
  (void)printf("radius ratio, circumradius / (3 inradius): up to %.4g (1 in the regular tet)\n",
               (double)facts.body.max_radius_ratio);
  for (int i = 0; i < SB_RATIO_BINS; i++)
    (void)snprintf(
      label[i], sizeof(label[i]), i + 1 < SB_RATIO_BINS ? "%4.4g to %.4g" : "%4.4g and more",
      (double)SbRatioBinEdges[i], (double)SbRatioBinEdges[PetscMin(i + 1, SB_RATIO_BINS - 1)]);
  bars(SB_RATIO_BINS, (const char(*)[32])label, facts.ratio);

  // memory of a run
  (void)printf("a dynamic run on one rank, estimated\n  %-8s %14s %14s %14s\n", "element",
               "unknowns", "matrix MiB", "memory MiB");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(elements); i++) {
    PetscInt unknowns;
    PetscReal matrix;
    const PetscReal bytes = memory(&facts, elements[i], &unknowns, &matrix);

    (void)printf("  %-8s %14s %14.0f %14.0f\n", elements[i], SbToolNumber(unknowns, number),
                 (double)matrix / 1048576, (double)bytes / 1048576);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
