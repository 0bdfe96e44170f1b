/*
  tetrahedralize.c - tetrahedralization of a surface with regions by gmsh or else tetgen, and checks
  of the result.

  A backend returns vertices, tets with region numbers, and triangles with the number of the surface
  triangle at their position. Both are checked here (every region exists and has its volume: up to
  rounding if the surface was kept, else within ten percent), groups are assigned to tets and
  triangles, and slivers are counted.
*/
#include "surface_impl.h"

#define NEAR 1.5 /* largest ratio of target size and mean edge for which the surface is kept */
#define EXACT \
  1e-9 /* tolerance of region volumes relative to those of the surface, if the surface is kept */
#define ROUGH 0.1 /* the same if it is remeshed: a coarse mesh of a curved surface loses volume */
#define SLIVER 5. /* degrees */

PetscErrorCode SbSurfaceCreate(PetscInt nvert, PetscInt ntri, PetscInt nregion, SbSurface *s)
{
  PetscFunctionBeginUser;
  *s = (SbSurface){.nvert = nvert, .ntri = ntri, .nregion = nregion};
  PetscCall(PetscCalloc6(3 * (size_t)nvert, &s->x, 3 * (size_t)ntri, &s->tri, ntri, &s->tags, ntri,
                         &s->number, 2 * (size_t)ntri, &s->side, nregion, &s->region_tags));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfaceDestroy(SbSurface *s)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree6(s->x, s->tri, s->tags, s->number, s->side, s->region_tags));
  PetscCall(PetscMemzero(s, sizeof(*s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbSurfaceMeasure(const SbSurface *s, PetscReal volume[])
{
  for (PetscInt r = 0; volume && r < s->nregion; r++)
    volume[r] = 0;
  for (PetscInt f = 0; volume && f < s->ntri; f++) {
    const PetscReal cone = SbTetVolumeTo(s->x, s->tri + 3 * f, s->x);

    if (s->side[2 * f] >= 0)
      volume[s->side[2 * f]] -= cone;
    if (s->side[2 * f + 1] >= 0)
      volume[s->side[2 * f + 1]] += cone;
  }
  return SbTrianglesMeanEdge(s->x, s->ntri, s->tri);
}

static const struct {
  const char *name;
  PetscErrorCode (*run)(const SbTetJob *job, SbImport *tets);
} backends[] = {{"gmsh", SbTetRun_Gmsh},
                {"tetgen", SbTetRun_TetGen}}; /* order: SB_TET_GMSH - 1, SB_TET_TETGEN - 1 */

static PetscErrorCode run_checked(int backend, const SbTetJob *job, SbImport *tets)
{
  const SbSurface *s = job->surface;
  PetscReal *want = NULL;
  PetscReal *got = NULL;

  PetscFunctionBeginUser;
  PetscCall((*backends[backend].run)(job, tets));
  PetscCheck(tets->item[3].n, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "it made no tets");

  // the vertices of a kept surface must come first and unchanged
  if (!job->remesh) {
    PetscCheck(tets->nvert >= s->nvert, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "vertices of the surface are gone");
    for (PetscInt i = 0; i < 3 * s->nvert; i++)
      PetscCheck(tets->x[i] == s->x[i], PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                 "vertex %" PetscInt_FMT " of the surface was moved", i / 3 + 1);
  }

  // volume of each region, compared with that of its surface
  PetscCall(SbImportScratch(tets, (size_t)s->nregion * sizeof(*want), &want));
  PetscCall(SbImportScratch(tets, (size_t)s->nregion * sizeof(*got), &got));
  PetscCall(PetscArrayzero(got, s->nregion));
  (void)SbSurfaceMeasure(s, want);
  for (PetscInt c = 0; c < tets->item[3].n; c++)
    got[tets->item[3].tags[c]] +=
      PetscAbsReal(SbTetDeterminant(tets->x, tets->item[3].vert + 4 * c)) / 6;
  for (PetscInt r = 0; r < s->nregion; r++)
    PetscCheck(PetscAbsReal(got[r] - want[r]) <= (job->remesh ? ROUGH : EXACT) * want[r],
               PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "its tets fill %.4g percent of the volume of region %" PetscInt_FMT,
               (double)(100 * got[r] / want[r]), r + 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbTetDefaults(SbTetOptions *o)
{
  memset(o, 0, sizeof(*o)); /* its padding, too: copies are compared by their bytes */
  o->merge_tolerance = o->untangle = -1;
  o->angle = 40;
  o->seconds = 600;
}

/* Runs the first backend that works; the body gets its mesh. An error about the input becomes a
   reason. */
static PetscErrorCode run_backends(const SbTetJob *job, PetscReal factor, PetscBool *done,
                                   size_t size, char reasons[], SbImport *body)
{
  const size_t n = strlen(job->where);
  SbImport tets;

  PetscFunctionBeginUser;
  for (int backend = 0; backend < 2 && !*done; backend++) {
    SbCaughtError caught = {0, ""};
    SbItems *tri = &body->item[2];
    PetscInt kept = 0;
    const char *surface;
    const char *why = caught.text;
    SbShape shape;
    char slivers[96] = "";

    if (job->options.backend != SB_TET_AUTO && (int)job->options.backend != backend + 1)
      continue;
    PetscCall(PetscMemzero(&tets, sizeof(tets)));
    (void)snprintf(tets.where, sizeof(tets.where), "%s", job->where);
    SB_CATCH(&caught, run_checked(backend, job, &tets));
    *done = (PetscBool)!caught.code;
    if (caught.code) {
      PetscCall(SbImportDestroy(&tets));
      PetscCheck(caught.code == PETSC_ERR_USER_INPUT || caught.code == PETSC_ERR_FILE_OPEN ||
                   caught.code == PETSC_ERR_FILE_READ || caught.code == PETSC_ERR_FILE_UNEXPECTED,
                 PETSC_COMM_SELF, (PetscErrorCode)caught.code, "%s: %s", job->where, caught.text);

      // remove the prefix that our message has too
      if (!strncmp(why, job->where, n))
        why += n + strspn(why + n, ": ");
      SbAppend(size, reasons, "%s%s: %s", reasons[0] ? "; " : "", backends[backend].name, why);
      continue;
    }

    // the body keeps its groups and tag sets
    body->nvert = tets.nvert;
    body->x = tets.x;
    body->vert_number = tets.vert_number;
    PetscCall(PetscArraycpy(body->item, tets.item, 4));
    tets.x = NULL;
    tets.vert_number = NULL;
    PetscCall(PetscArrayzero(tets.item, 4));
    PetscCall(SbImportDestroy(&tets));
    for (PetscInt i = 0; i < 3 * body->nvert; i++)
      body->x[i] *= (1 / factor);
    for (PetscInt v = 0; v < body->nvert; v++)
      body->vert_number[v] = v + 1;

    // region and triangle numbers become tag sets; triangles without groups are dropped
    for (PetscInt c = 0; c < body->item[3].n; c++) {
      body->item[3].number[c] = c + 1;
      body->item[3].tags[c] = job->surface->region_tags[body->item[3].tags[c]];
    }
    for (PetscInt i = 0; i < tri->n; i++) {
      const PetscInt f = tri->tags[i];

      if (!job->surface->tags[f])
        continue;
      PetscCall(PetscArraymove(tri->vert + 3 * kept, tri->vert + 3 * i, 3));
      tri->tags[kept] = job->surface->tags[f];
      tri->number[kept++] = job->surface->number[f];
    }
    tri->n = kept;

    // note which program made the tets
    surface = job->remesh ? "remeshed" : "kept";
    if (job->remesh && backend + 1 == SB_TET_TETGEN)
      surface = job->size < job->edge ? "split" : "kept";
    SbImportShape(body, SLIVER, &shape);
    if (shape.nsliver)
      (void)snprintf(slivers, sizeof(slivers),
                     ", %" PetscInt_FMT " slivers (dihedral below %g degrees, smallest %.2g)",
                     shape.nsliver, (double)SLIVER,
                     acos(PetscMin((double)shape.most[0], 1)) * 180 / PETSC_PI);
    SbAppend(sizeof(body->note), body->note,
             "%s%" PetscInt_FMT " tets of size %.3g m%s by %s, surface %s%s%s%.200s%s",
             body->note[0] ? ", " : "", body->item[3].n, (double)(job->size / factor),
             job->options.nnear ? ", finer near places," : "", backends[backend].name, surface,
             slivers, reasons[0] ? " (before that " : "", reasons, reasons[0] ? ")" : "");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTetrahedralize(const char *where, const SbSurface *s, const SbTetOptions *o,
                                SbImport *body)
{
  SbTetJob job;
  SbSurface scaled;
  PetscReal factor;
  PetscBool done = PETSC_FALSE;
  char reasons[640] = "";
  char size_option[SB_IMPORT_OPTION_MAX], surface_option[SB_IMPORT_OPTION_MAX];
  int exponent;
  PetscErrorCode ierr;
  PetscReal *volume, edge, expected, least;
  PetscReal all = 0;
  PetscReal last = 1;
  PetscInt region = 0;

  PetscFunctionBeginUser;

  // target size, whether the surface is kept, expected number of tets
  PetscCheck(s->ntri > 3 && s->nregion > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: %" PetscInt_FMT " triangles around %" PetscInt_FMT " regions enclose nothing",
             where, s->ntri, s->nregion);
  PetscCall(PetscMalloc1(s->nregion, &volume));
  edge = SbSurfaceMeasure(s, volume);
  for (; region < s->nregion && last > 0; region++) {
    last = volume[region];
    all += last;
  }
  PetscCall(PetscFree(volume));
  PetscCheck(last > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: region %" PetscInt_FMT
             " has the volume %g; its triangles are turned, or not closed",
             where, region, (double)last);
  job = (SbTetJob){.where = where, .body = body, .surface = s, .options = *o, .edge = edge};
  job.size = o->size > 0 ? o->size : edge;
  least = job.size;
  for (PetscInt k = 0; k < o->nnear; k++)
    least = PetscMin(least, o->near[k].size);
  job.remesh =
    (PetscBool)(o->surface == SB_TET_REMESH || (o->surface == SB_TET_SURFACE_AUTO &&
                                                (job.size > NEAR * edge || edge > NEAR * least)));

  /* a regular tet of edge h has the volume h^3 / (6 sqrt(2)) */
  expected = 6 * PETSC_SQRT2 * all / (job.size * job.size * job.size);
  PetscCall(SbTetNearCheck(&job, all, &expected));
  PetscCheck(
    expected < SB_TET_MOST, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: a size of %g m makes about %.2g tets out of %.4g m^3; give a size of at least %.3g m (%s)",
    where, (double)job.size, (double)expected, (double)all,
    (double)(job.size * PetscPowReal(expected / SB_TET_MOST, 1. / 3)),
    SbImportOption(body, "tet_size", size_option));
  (void)frexp(job.size, &exponent);
  factor = ldexp(1, 1 - exponent);

  // backends have absolute tolerances: scaling by a power of two, which is exact, to a size from 1
  // to 2
  scaled = *s;
  PetscCall(PetscMalloc1(3 * (size_t)s->nvert, &scaled.x));
  for (PetscInt i = 0; i < 3 * s->nvert; i++)
    scaled.x[i] = factor * s->x[i];
  job.surface = &scaled;
  job.size *= factor;
  job.edge *= factor;
  for (PetscInt k = 0; k < o->nnear; k++) {
    SbTetNear *near = &job.options.near[k];

    near->size *= factor;
    near->radius *= factor;
    for (int i = 0; i < 3; i++) {
      near->x[i] *= factor;
      near->half[i] *= factor;
    }
  }
  ierr = run_backends(&job, factor, &done, sizeof(reasons), reasons, body);
  PetscCall(PetscFree(scaled.x));
  PetscCall(ierr);
  PetscCheck(done, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: no tets could be made of the surface. %s. Try another %s, %s keep or remesh, or "
             "repair the "
             "surface where it is thinner than its triangles",
             where, reasons, SbImportOption(body, "tet_size", size_option),
             SbImportOption(body, "tet_surface", surface_option));
  PetscFunctionReturn(PETSC_SUCCESS);
}
