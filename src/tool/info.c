/*
  info.c - supple-mesh info: what is in a mesh, whether a run accepts it, and what a run will take.
*/
#include "tool.h"

static PetscErrorCode print(const char *format, ...) PETSC_ATTRIBUTE_FORMAT(1, 2);

static PetscErrorCode print(const char *format, ...)
{
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  (void)vfprintf(stdout, format, args);
  va_end(args);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ parts of the report */

static PetscErrorCode groups(const SbImport *mesh)
{
  static const char *const title[4] = {"points", "curves", "surfaces", "regions"};
  static const char *const item[4] = {"points", "lines", "triangles", "tets"};
  static const char *const unit[4] = {"", "m", "m^2", "m^3"};

  PetscFunctionBeginUser;
  for (int d = 3; d >= 0; d--) {
    PetscBool found = PETSC_TRUE, titled = PETSC_FALSE;

    for (PetscInt g = 0; found; g++) {
      SbMeshGroup group;
      char number[32];

      PetscCall(SbMeshFileGroup(mesh, g, &group, &found));
      if (!found || group.dim != d) continue;
      if (!titled) PetscCall(print("%s\n", title[d]));
      titled = PETSC_TRUE;
      PetscCall(print("  %-26s %12s %s", group.name, SbToolNumber(group.n, number), item[d]));
      if (d) PetscCall(print(", %.6g %s", (double)group.size, unit[d]));
      /* readers of formats that have names only make up numbers */
      if (group.tag > 0 && group.tag <= INT32_MAX) PetscCall(print(" (number %lld)", (long long)group.tag));
      PetscCall(print("\n"));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A line of a histogram: at most 40 signs; what is there has at least one. */
static PetscErrorCode bar(const char *label, PetscInt64 n, PetscInt64 most)
{
  char signs[41], number[32];
  const int length = n ? (int)PetscMax(1, 40 * n / most) : 0;

  PetscFunctionBeginUser;
  memset(signs, '#', sizeof(signs));
  signs[length] = 0;
  PetscCall(print("  %-14s %14s %s\n", label, SbToolNumber(n, number), signs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode quality(const SbMeshFacts *f)
{
  PetscInt64 most = 1;
  char label[32];

  PetscFunctionBeginUser;
  PetscCall(print("dihedral angles, degrees: %.3g to %.4g (70.5 in the regular tet)\n",
                  (double)f->body.min_dihedral, (double)f->max_dihedral));
  for (int i = 0; i < SB_ANGLE_BINS; i++) most = PetscMax(most, f->angle[i]);
  for (int i = 0; i < SB_ANGLE_BINS; i++) {
    (void)snprintf(label, sizeof(label), "%3d to %3d", 180 / SB_ANGLE_BINS * i,
                   180 / SB_ANGLE_BINS * (i + 1));
    PetscCall(bar(label, f->angle[i], most));
  }
  PetscCall(print("radius ratio, circumradius / (3 inradius): up to %.4g (1 in the regular tet)\n",
                  (double)f->body.max_radius_ratio));
  most = 1;
  for (int i = 0; i < SB_RATIO_BINS; i++) most = PetscMax(most, f->ratio[i]);
  for (int i = 0; i < SB_RATIO_BINS; i++) {
    if (i + 1 < SB_RATIO_BINS)
      (void)snprintf(label, sizeof(label), "%4.4g to %.4g", (double)SbRatioBounds[i],
                     (double)SbRatioBounds[i + 1]);
    else
      (void)snprintf(label, sizeof(label), "%4.4g and more", (double)SbRatioBounds[i]);
    PetscCall(bar(label, f->ratio[i], most));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbToolInfo(SbTool *tool, SbImport *mesh)
{
  SbMeshFacts facts;
  PetscErrorCode ierr;
  PetscInt nvert, n[4];
  char number[32];
  const PetscReal *b;
  static const char *const elements[] = {"p1", "cr", "dg"};

  PetscFunctionBeginUser;
  SbMeshFileCount(mesh, &nvert, n);
  PetscCall(print("%s\n", tool->in));
  PetscCall(print("  %-26s %12s\n", "vertices", SbToolNumber(nvert, number)));
  PetscCall(print("  %-26s %12s\n", "tets", SbToolNumber(n[3], number)));
  if (n[2]) PetscCall(print("  %-26s %12s\n", "triangles of groups", SbToolNumber(n[2], number)));
  if (n[1]) PetscCall(print("  %-26s %12s\n", "lines of groups", SbToolNumber(n[1], number)));
  if (n[0]) PetscCall(print("  %-26s %12s\n", "points of groups", SbToolNumber(n[0], number)));
  PetscCall(groups(mesh));
  (void)fflush(stdout);
  PetscCall(SbToolBegin(tool, "measuring"));
  ierr = SbMeshFileMeasure(mesh, &facts);
  PetscCall(SbToolEnd(tool));
  PetscCall(ierr);
  // size and counts
  b = facts.body.bbox;
  PetscCall(print("size (coordinates in m)\n"));
  PetscCall(print("  from (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g)\n", (double)b[0], (double)b[1],
                  (double)b[2], (double)b[3], (double)b[4], (double)b[5]));
  PetscCall(print("  %-26s %12.6g m^3\n", "volume", (double)facts.body.volume));
  PetscCall(print("  %-26s %12.6g m^2, %s facets\n", "surface", (double)facts.area,
                  SbToolNumber(facts.body.nfacet, number)));
  PetscCall(print("  %-26s %12s\n", "parts", SbToolNumber(facts.body.npart, number)));
  PetscCall(print("  %-26s %12s: shortest %.4g m, mean %.4g m, longest %.4g m\n", "edges",
                  SbToolNumber(facts.nedge, number), (double)facts.edge[0], (double)facts.edge[1],
                  (double)facts.edge[2]));
  PetscCall(print("  %-26s %12s\n", "faces", SbToolNumber(facts.nface, number)));
  if (facts.body.note[0]) PetscCall(print("  to know: %s\n", facts.body.note));
  PetscCall(quality(&facts));
  // what a run of it needs
  PetscCall(print("a dynamic run on one rank, estimated\n  %-8s %14s %14s %14s\n", "element", "unknowns",
                  "matrix MiB", "memory MiB"));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(elements); i++) {
    PetscInt unknowns;
    PetscReal matrix;
    const PetscReal bytes = SbToolMemory(&facts, elements[i], &unknowns, &matrix);

    PetscCall(print("  %-8s %14s %14.0f %14.0f\n", elements[i], SbToolNumber(unknowns, number),
                    (double)matrix / 1048576, (double)bytes / 1048576));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
