/*
  triangles_poly.c - reader of TetGen's .poly and .smesh surfaces (TetGen 1.5 manual, section 5.2).

  Four parts: points (if their number is 0, they are in NAME.node), facets, holes, regions. A facet
  of .smesh is one polygon; one of .poly may have several nested polygons, and hole points. A #
  begins a comment. Point numbers begin at 0 or 1, as the first one.

  Kept: a nonzero facet marker N is the group surface_N; a hole is a cavity; the attribute N of a
  region gives its tets the group volume_N (its largest volume is ignored: sizes are set by
  -body_<name>_tet_size). Errors: polygons of one or two corners, which mark points and edges of a
  facet.
*/
#include <strings.h>
#include "surface_impl.h"

typedef struct {
  SbScan *s;
  SbTriangleFile *f;
  PetscInt nloop, nvert; /* polygons of one facet */
  PetscInt *start;       /* [nloop + 1] first corner of each polygon */
  PetscInt *vert;
} Poly;

/* Reads the counts at the beginning of a part; omitted ones are 0. */
static PetscErrorCode read_counts(SbScan *s, const char *what, int n, int64_t count[])
{
  PetscFunctionBeginUser;
  for (int i = 1; i < n; i++)
    count[i] = 0;
  PetscCall(SbScanText(s, what, &count[0]));
  for (int i = 1; i < n && SbScanMore(s, '#'); i++)
    PetscCall(SbScanText(s, what, &count[i]));
  SbScanEndOfLine(s);
  PetscCall(SbScanRoom(s, what, count[0], 4, 4));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads points from this file, or from NAME.node. */
static PetscErrorCode read_points(Poly *p, int64_t n)
{
  SbNumbers *index = &p->f->im->nodes;
  int64_t number;

  PetscFunctionBeginUser;
  for (int64_t i = 0; i < n; i++) {
    PetscReal x[3];

    PetscCall(SbScanText(p->s, "number of a point", &number));
    PetscCheck(SbNumbersFind(index, number) < 0, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "%s: point %lld is there twice", p->f->where, (long long)number);
    PetscCall(SbNumbersAdd(index, number));
    PetscCall(SbScanPoint(p->s, "coordinate of a point", 0, x));
    SbScanEndOfLine(p->s);
    PetscCall(SbTrianglesAddVertex(p->f, x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a polygon of a facet: the number of corners, and these, on one or more lines. */
static PetscErrorCode read_polygon(Poly *p, const char *what, int64_t facet)
{
  int64_t n, number;

  PetscFunctionBeginUser;
  PetscCall(SbScanText(p->s, what, &n));
  if (n < 3)
    SB_SCAN_ERROR(
      p->s,
      "facet %lld has a polygon of %lld corners; it needs three: supple takes no points or edges "
      "within facets, cut the facet there",
      (long long)facet, (long long)n);
  PetscCall(SbScanRoom(p->s, "corners", n, 2, 2));
  PetscCall(SbImportScratch(p->f->im, (size_t)(p->nloop + 2) * sizeof(*p->start), &p->start));
  PetscCall(SbImportScratch(p->f->im, (size_t)(p->nvert + n) * sizeof(*p->vert), &p->vert));
  p->start[p->nloop] = p->nvert;
  for (int64_t i = 0; i < n; i++) {
    PetscCall(SbScanText(p->s, "corner of a polygon", &number));
    p->vert[p->nvert] = SbNumbersFind(&p->f->im->nodes, number);
    if (p->vert[p->nvert++] < 0)
      SB_SCAN_ERROR(p->s, "facet %lld uses the point %lld, which is not there", (long long)facet,
                    (long long)number);
  }
  p->start[++p->nloop] = p->nvert;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads hole or region points; the part may be missing at the end of the file. */
static PetscErrorCode read_seeds(Poly *p, const char *what, PetscBool attribute, PetscInt *n,
                                 SbSeed **seed)
{
  int64_t count[1] = {0};

  PetscFunctionBeginUser;
  SbScanNext(p->s);
  if (p->s->at < p->s->end)
    PetscCall(read_counts(p->s, what, 1, count));
  PetscCall(SbImportScratch(p->f->im, (size_t)count[0] * sizeof(**seed), seed));
  for (*n = 0; *n < count[0]; (*n)++) {
    SbSeed *one = &(*seed)[*n];
    PetscReal value = 0;

    PetscCall(SbScanText(p->s, what, &one->number));
    PetscCall(SbScanPoint(p->s, what, 0, one->x));
    if (attribute && SbScanMore(p->s, '#'))
      PetscCall(SbScanReal(p->s, "attribute of a region", 0, &value));
    if (value != PetscFloorReal(value) || PetscAbsReal(value) > 1e15)
      SB_SCAN_ERROR(p->s,
                    "the attribute %g of a region is no whole number; it becomes the name volume_N",
                    (double)value);
    one->attribute = (int64_t)value;
    SbScanEndOfLine(p->s);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead_Poly(SbScan *s, SbTriangleFile *f)
{
  const PetscBool smesh = (PetscBool)!strcasecmp(strrchr(f->path, '.'), ".smesh");
  const char *corners = smesh ? "number of corners of a facet" : "number of corners of a polygon";
  Poly poly = {.s = s, .f = f};
  Poly *p = &poly;
  int64_t count[4];
  PetscReal *hole = NULL; /* [][3] hole points of a facet */
  SbScan scan;
  char name[PETSC_MAX_PATH_LEN + 8];
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  s->comment = '#';
  PetscCall(read_counts(s, "number of points", 4, count));
  if (count[0] && count[1] != 3)
    SB_SCAN_ERROR(s, "points of %lld dimensions; expected 3", (long long)count[1]);
  if (count[0])
    PetscCall(read_points(p, count[0]));
  else {
    // the points are in NAME.node
    (void)snprintf(name, sizeof(name), "%.*s.node", (int)(strrchr(f->path, '.') - f->path),
                   f->path);
    ierr = SbScanOpen(f->where, name, &scan);
    scan.comment = '#';
    p->s = &scan;
    if (!ierr)
      ierr = read_counts(&scan, "number of points in the .node file", 4, count);
    if (!ierr)
      ierr = read_points(p, count[0]);
    p->s = s;
    PetscCall(PetscFree(scan.data));
    PetscCall(ierr);
  }
  PetscCall(read_counts(s, "number of facets", 2, count));
  for (int64_t i = 1; i <= count[0]; i++) {
    int64_t facet[3] = {1, 0, 0};
    int64_t number;
    PetscInt group;

    // numbers of polygons and holes, and marker; one of .smesh is a single polygon with the marker
    // behind it
    if (!smesh)
      PetscCall(read_counts(s, "number of polygons of a facet", 3, facet));
    p->nloop = p->nvert = 0;
    for (int64_t k = 0; k < facet[0]; k++) {
      PetscCall(read_polygon(p, corners, i));
      if (smesh && count[1] && SbScanMore(s, '#'))
        PetscCall(SbScanText(s, "marker of a facet", &facet[2]));
      SbScanEndOfLine(s);
    }
    PetscCall(SbScanRoom(s, "holes of a facet", facet[1], 4, 4));
    PetscCall(SbImportScratch(f->im, 3 * (size_t)facet[1] * sizeof(*hole), &hole));
    for (int64_t k = 0; k < facet[1]; k++) {
      PetscCall(SbScanText(s, "number of a hole", &number));
      PetscCall(SbScanPoint(s, "coordinate of a hole", 0, hole + 3 * k));
      SbScanEndOfLine(s);
    }

    // the triangles of the facet, in the group of its marker
    if (facet[2])
      PetscCall(SbImportGroup(f->im, 2, facet[2], NULL, &group));
    PetscCall(SbImportTagSet(f->im, facet[2] != 0, &group, &f->now));
    PetscCall(SbTrianglesAddLoops(s, p->nloop, p->start, p->vert, (PetscInt)facet[1], hole, i, f));
  }
  PetscCall(read_seeds(p, "hole", PETSC_FALSE, &f->nhole, &f->hole));
  PetscCall(read_seeds(p, "region", PETSC_TRUE, &f->nregion, &f->region));
  PetscFunctionReturn(PETSC_SUCCESS);
}
