/*
  import_surface.c - import of a body or a rigid obstacle from a closed surface: read, repaired,
  checked, divided into regions; a body is tetrahedralized.

  Each step with its repairs and errors is described in triangles*.c (readers), clean.c,
  self_intersection.c, region.c and tetrahedralize.c. The surface is scaled to metres right after it
  is read.
*/
#include "surface_impl.h"

#define WELD 1e-7 /* default merge tolerance over the diagonal: the precision of text files */

const SbOption SbTetRows[] = {
  {"tet_size", SB_OPTION_REAL, 1, "m", "", "(0, inf)",
   "edge length of the tets made from a surface; default: the mean edge of its triangles"},
  {"tet_surface", SB_OPTION_CHOICE, 1, "", "auto", "auto|keep|remesh",
   "keep the triangles of the surface, or remesh it: auto keeps them when their mean edge is "
   "within a factor "
   "of 1.5 of tet_size"},
  {"tet_feature_angle", SB_OPTION_REAL, 1, "degrees", "40", "(0, 180)",
   "feature angle: edges where the normals of the surface differ by more are kept when it is "
   "remeshed"},
  {"tet_near", SB_OPTION_STRING, 1, "m", "", "",
   "places with finer tets, where the body is placed: sphere:x,y,z,r,size or "
   "box:x0,y0,z0,x1,y1,z1,size, several "
   "separated by semicolons; sizes grow away from them"},
  {"tetrahedralizer", SB_OPTION_CHOICE, 1, "", "auto", "auto|gmsh|tetgen",
   "program that fills a surface with tets: auto tries gmsh, then tetgen"},
  {"tet_seconds", SB_OPTION_REAL, 1, "s", "600", "(0, inf)",
   "time limit of gmsh, and then of tetgen"},
  {"merge_tolerance", SB_OPTION_REAL, 1, "m", "", "[0, inf)",
   "vertices of a surface closer than this are merged; default: 1e-7 of the diagonal of its "
   "bounding box"},
  {"untangle", SB_OPTION_REAL, 1, "m", "", "[0, inf)",
   "largest displacement of vertices that removes small self-intersections of a surface; default: "
   "half its "
   "mean edge"},
  {0},
};

PetscBool SbMeshFileIsSurface(const char *path)
{
  const SbTriangleFormat *format = strncmp(path, "box:", 4) ? SbTrianglesFormat(path) : NULL;

  return (PetscBool)(format && format->read);
}

PetscErrorCode SbTetOptionsRead(const SbScope *scope, const char *mesh, SbTetOptions *o)
{
  PetscFunctionBeginUser;
  SbTetDefaults(o);
  if (!SbMeshFileIsSurface(mesh))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbOptionReal(scope, "tet_size", &o->size));
  PetscCall(SbOptionChoice(scope, "tet_surface", &o->surface));
  PetscCall(SbOptionReal(scope, "tet_feature_angle", &o->angle));
  PetscCall(SbTetNearRead(scope, "tet_near", o));
  PetscCall(SbOptionChoice(scope, "tetrahedralizer", &o->backend));
  PetscCall(SbOptionReal(scope, "tet_seconds", &o->seconds));
  PetscCall(SbOptionReal(scope, "merge_tolerance", &o->merge_tolerance));
  PetscCall(SbOptionReal(scope, "untangle", &o->untangle));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void write_repairs(const SbTriangles *t, const SbSurfaceRepairs *m, size_t size, char text[])
{
  if (t->turned)
    SbAppend(size, text, "surface inverted: taken turned");
  if (m->nwelded)
    SbAppend(size, text, "%svertices joined within %.2g m: %" PetscInt_FMT " (by up to %.2g m)",
             text[0] ? ", " : "", (double)m->tolerance, m->nwelded, (double)m->moved);
  if (m->npairs)
    SbAppend(size, text,
             "%spairs of triangles that cut each other smoothed apart: %" PetscInt_FMT
             " (%" PetscInt_FMT " vertices moved by up to %.2g m)",
             text[0] ? ", " : "", m->npairs, m->nuntangled, (double)m->untangled);
  SbNoteCount(size, text, "triangles with two corners at one place left out", m->ncollapsed);
  SbNoteCount(size, text, "triangles given twice left out", m->ndoubled);
  SbNoteCount(size, text, "triangles back to back kept once as a wall", m->nwall);
  SbNoteCount(size, text, "triangles without area taken into their neighbours", m->nflat);
  SbNoteCount(size, text, "triangles turned to the side of their neighbours", m->nturned);
  SbNoteCount(size, text, "cavities", m->ncavity);
  SbNoteCount(size, text, "triangles without material on a side left out", m->nidle);
  SbNoteCount(size, text, "triangles within the obstacle left out", m->ninner);
}

/* Surface of a body, or of an obstacle translated to `at`, with its regions; the repairs become a
   note. */
static PetscErrorCode make_surface(const char *path, const PetscReal at[3], SbTriangleFile *f,
                                   SbSurface *s, SbSurfaceRepairs *repairs)
{
  const SbImport *im = f->im;
  SbTriangles *t = f->t;
  const PetscReal given = im->tet.merge_tolerance;
  PetscReal box[6], tolerance, edge;
  char option[SB_IMPORT_OPTION_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbTrianglesReadFile(path, f));

  // scale and translate; check for invalid numbers
  for (PetscInt i = 0; i < 3 * t->nvert; i++) {
    t->x[i] = im->scale * t->x[i] + at[i % 3];
    PetscCheck(PetscAbsReal(t->x[i]) <= SB_LENGTH_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: vertex %" PetscInt_FMT
               " is beyond %g m, the largest length, when scaled by %g; check the file and %s",
               f->where, i / 3 + 1, (double)SB_LENGTH_MAX, (double)im->scale,
               f->body ? SbImportOption(im, "scale", option) : "the scale");
  }
  for (PetscInt i = 0; i < 3 * f->nhole; i++)
    f->hole[i / 3].x[i % 3] *= im->scale;
  for (PetscInt i = 0; i < 3 * f->nregion; i++)
    f->region[i / 3].x[i % 3] *= im->scale;
  PetscCall(SbDropUnusedPoints(&t->nvert, t->x, 3 * t->ntri, t->tri));

  // the merge tolerance must be far below the mean edge length
  SbBoxClear(box);
  for (PetscInt v = 0; v < t->nvert; v++)
    SbBoxAdd(box, t->x + 3 * v);
  tolerance = given >= 0 ? given : WELD * SbBoxDiagonal(box);
  edge = SbTrianglesMeanEdge(t->x, t->ntri, t->tri);
  PetscCheck(given < 0.5 * edge, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: %s %g m would join corners of one triangle: the mean edge is %.3g m; give less "
             "than half of it",
             f->where, SbImportOption(im, "merge_tolerance", option), (double)given, (double)edge);

  // repair; triangles of an obstacle may intersect each other away from their edges
  PetscCall(SbSurfaceMergeVertices(f, tolerance, repairs));
  PetscCheck(t->ntri, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: no triangle is left when vertices within %g m are one; %s%s, or check the scale",
             f->where, (double)tolerance, f->body ? "give a smaller " : "repair the file",
             f->body ? SbImportOption(im, "merge_tolerance", option) : "");
  PetscCall(SbSurfaceRepairTriangles(f, repairs));
  if (f->body)
    PetscCall(SbSurfaceUntangle(f, im->tet.untangle >= 0 ? im->tet.untangle : 0.5 * edge, repairs));
  PetscCall(SbSurfaceFindRegions(f, repairs, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the boundary triangles (material on one side only), oriented outwards, and finds their
   neighbours. */
static PetscErrorCode take_boundary(const SbTriangleFile *f, const SbSurface *s, PetscInt *nwall)
{
  SbTriangles *t = f->t;
  SbKey *edge = NULL;

  PetscFunctionBeginUser;

  // triangles with material on both sides are walls, which an obstacle does not need
  PetscCall(PetscArraycpy(t->x, s->x, 3 * (size_t)s->nvert));
  t->nvert = s->nvert;
  t->ntri = 0;
  for (PetscInt i = 0; i < s->ntri; i++) {
    const PetscBool front = (PetscBool)(s->side[2 * i] >= 0);
    const PetscBool back = (PetscBool)(s->side[2 * i + 1] >= 0);
    PetscInt *v = t->tri + 3 * t->ntri;

    if (front == back) {
      (*nwall)++;
      continue;
    }
    for (int k = 0; k < 3; k++)
      v[k] = s->tri[3 * i + (front ? 2 - k : k)];
    f->number[t->ntri++] = s->number[i];
  }
  PetscCall(SbDropUnusedPoints(&t->nvert, t->x, 3 * t->ntri, t->tri));
  t->volume = 0;
  for (PetscInt i = 0; i < t->ntri; i++)
    t->volume += SbTetVolumeTo(t->x, t->tri + 3 * i, t->x);

  // neighbour across each edge; an edge of more than two triangles is an error
  PetscCall(PetscMalloc1(3 * (size_t)t->ntri, &t->across));
  PetscCall(SbImportScratch(f->im, 3 * (size_t)t->ntri * sizeof(*edge), &edge));
  SbTrianglesEdges(t, edge);
  for (PetscInt i = 0; i < 3 * t->ntri; i += 2) {
    const PetscInt n = SbKeysAlike(3 * t->ntri, edge, i);
    const PetscInt a = edge[i].slot;
    const PetscReal *p = t->x + 3 * t->tri[a];
    const PetscReal *q = t->x + 3 * t->tri[SbSlotNext(a)];

    PetscCheck(n == 2, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: %lld triangles meet at the edge from (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g) "
               "m, triangle "
               "%lld among them; an edge of an obstacle has two, take parts that touch apart",
               f->where, (long long)n, (double)p[0], (double)p[1], (double)p[2], (double)q[0],
               (double)q[1], (double)q[2], (long long)f->number[a / 3]);
    t->across[a] = edge[i + 1].slot / 3;
    t->across[edge[i + 1].slot] = a / 3;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0: reads an obstacle, repaired and checked as the surface of a body; walls are removed. */
static PetscErrorCode read_obstacle(const char *path, const PetscReal at[3], SbTriangleFile *f)
{
  const SbTriangleFormat *format = SbTrianglesFormat(path);
  SbSurfaceRepairs repairs = {0};
  SbSurface s = {0};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCheck(format && format->read != SbTrianglesRead_Poly, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: is a file of no known kind; give one that ends in .stl, .obj, .off, .ply or .msh",
             f->where);
  ierr = make_surface(path, at, f, &s, &repairs);
  if (!ierr)
    ierr = take_boundary(f, &s, &repairs.ninner);
  PetscCall(SbSurfaceDestroy(&s));
  PetscCall(ierr);
  repairs.ncavity = 0; /* cavities of an obstacle need no note */
  write_repairs(f->t, &repairs, sizeof(f->im->note), f->im->note);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead(MPI_Comm comm, const char *option, const char *path, PetscReal scale,
                               const PetscReal at[3], SbTriangles *t)
{
  SbImport im = {.scale = scale, .tet.merge_tolerance = -1};
  SbCaughtError caught = {0, ""};
  PetscMPIInt rank, n[2];
  PetscInt none;
  char note[sizeof(im.note)]; /* rank 0 prints warnings only */

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  (void)snprintf(im.where, sizeof(im.where), "%s: %s", option, path);
  PetscCall(SbImportTagSet(&im, 0, NULL, &none));

  // rank 0 reads; an error is raised on all ranks
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    SbTriangleFile file = {.im = &im, .where = im.where, .t = t};

    SB_CATCH(&caught, read_obstacle(path, at, &file));
    if (caught.code)
      PetscCall(SbTrianglesDestroy(t));
  }
  (void)snprintf(note, sizeof(note), "%s", im.note);
  PetscCall(SbImportDestroy(&im));
  PetscCall(SbCaughtRaise(comm, &caught));

  // broadcast the surface
  PetscCallMPI(MPI_Bcast(t, (int)sizeof(*t), MPI_BYTE, 0, comm));
  if (rank) {
    PetscCall(PetscMalloc1(3 * (size_t)t->nvert, &t->x));
    PetscCall(PetscMalloc1(3 * (size_t)t->ntri, &t->tri));
    PetscCall(PetscMalloc1(3 * (size_t)t->ntri, &t->across));
  }
  PetscCall(PetscMPIIntCast(3 * t->nvert, &n[0]));
  PetscCall(PetscMPIIntCast(3 * t->ntri, &n[1]));
  PetscCallMPI(MPI_Bcast(t->x, n[0], MPIU_REAL, 0, comm));
  PetscCallMPI(MPI_Bcast(t->tri, n[1], MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(t->across, n[1], MPIU_INT, 0, comm));
  if (note[0])
    PetscCall(SbWarning(comm, "%s: %s: %s", option, path, note));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfaceRead(const char *path, SbImport *im, SbSurface *s)
{
  SbTriangles t = {0};
  SbTriangleFile file = {.im = im, .where = im->where, .body = PETSC_TRUE, .t = &t};
  SbSurfaceRepairs repairs = {0};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(s, sizeof(*s)));
  ierr = make_surface(path, (const PetscReal[3]){0, 0, 0}, &file, s, &repairs);
  if (ierr)
    PetscCall(SbSurfaceDestroy(s));
  else
    write_repairs(&t, &repairs, sizeof(im->note), im->note);
  PetscCall(SbTrianglesDestroy(&t));
  PetscCall(ierr);
  im->scale = 1; /* the surface is in metres now */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Surface(const char *path, SbImport *im)
{
  SbSurface s;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(SbSurfaceRead(path, im, &s));
  ierr = SbTetrahedralize(im->where, &s, &im->tet, im);
  PetscCall(SbSurfaceDestroy(&s));
  PetscFunctionReturn(ierr);
}
