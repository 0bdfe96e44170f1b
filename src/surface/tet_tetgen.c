/*
  tet_tetgen.c - tets by the program tetgen (Hang Si 2015), called as a process in a folder of its own that is removed afterwards.

  Every triangle of the surface is a facet with its number as marker. The program gives back tets and facets; the regions are found here: a
  tet at a facet lies in the region on that side of its triangle, and the others follow from tet to tet without crossing a facet. What
  lies in no region, a cavity, is left out. So neither points in holes nor points in regions are needed.

  Kept, the surface stays as it is (-Y). Else tetgen may split its triangles, where the size asks for it; it cannot make it coarser.
*/
#include <dirent.h>
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <fcntl.h>
#ifdef __linux__
  #include <sys/prctl.h>
#endif
#include "sbkernel.h"
#include "sbtet.h"
#include "tet_backends.h"

#define UNKNOWN (-2) /* region of a tet that is not found yet */
#define PATH_LENGTH (PETSC_MAX_PATH_LEN + 300)

/* ------------------------------------------------------------------ the folder */

static PetscErrorCode write_surface(const char *folder, const SbSurface *s)
{
  char path[PATH_LENGTH];
  FILE *f;

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/s.smesh", folder);
  f = fopen(path, "w");
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write %s (%s)", path, strerror(errno));
  fprintf(f, "%" PetscInt_FMT " 3 0 0\n", s->nvert);
  for (PetscInt v = 0; v < s->nvert; v++)
    fprintf(f, "%" PetscInt_FMT " %.17g %.17g %.17g\n", v + 1, (double)s->x[3 * v], (double)s->x[3 * v + 1],
            (double)s->x[3 * v + 2]);
  fprintf(f, "%" PetscInt_FMT " 1\n", s->ntri);
  for (PetscInt t = 0; t < s->ntri; t++)
    fprintf(f, "3 %" PetscInt_FMT " %" PetscInt_FMT " %" PetscInt_FMT " %" PetscInt_FMT "\n",
            s->tri[3 * t] + 1, s->tri[3 * t + 1] + 1, s->tri[3 * t + 2] + 1, t + 1);
  fprintf(f, "0\n0\n");
  PetscCheck(!fclose(f), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write %s (%s); is the disk full?",
             path, strerror(errno));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the process */

static double now(void)
{
  struct timespec t;

  (void)clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* In the child: never returns. 127 says that there is no such program. */
static void become_tetgen(const char *folder, const char *flags)
{
  sigset_t none;
  int log;

#ifdef __linux__
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
  for (int s = 1; s < 32; s++) (void)signal(s, SIG_DFL);
  (void)sigemptyset(&none);
  (void)sigprocmask(SIG_SETMASK, &none, NULL);
  if (chdir(folder)) _exit(126);
  log = open("log", O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (log < 0 || dup2(log, 1) < 0 || dup2(log, 2) < 0) _exit(126);
  (void)close(0);
  execlp("tetgen", "tetgen", flags, "s.smesh", (char *)NULL);
  _exit(127);
}

static PetscErrorCode check_end(const char *folder, int status)
{
  char said[256];
  char path[PATH_LENGTH], line[256];
  FILE *f;

  PetscFunctionBeginUser;
  PetscCheck(!WIFEXITED(status) || WEXITSTATUS(status) != 127, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "there is no program tetgen; install the package tetgen (Debian, Ubuntu)");
  if (WIFEXITED(status) && !WEXITSTATUS(status)) PetscFunctionReturn(PETSC_SUCCESS);
  // the last lines of the log as one line
  said[0] = 0;
  (void)snprintf(path, sizeof(path), "%s/log", folder);
  f = fopen(path, "r");
  while (f && fgets(line, (int)sizeof(line), f)) {
    const size_t n = strlen(said);

    line[strcspn(line, "\r\n")] = 0;
    if (!line[0] || strstr(line, "@") || strstr(line, "report this bug")) continue;
    (void)snprintf(said + n, sizeof(said) - n, "%s%s", n ? " / " : "", line + strspn(line, " "));
  }
  if (f) (void)fclose(f);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "it %s %d%s%s",
          WIFSIGNALED(status) ? "was ended by signal" : "gave up with code",
          WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status), said[0] ? ", saying: " : "", said);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode run_tetgen(const char *folder, const char *flags, const SbTetJob *job)
{
  const double end = now() + job->options.seconds;
  const pid_t pid = fork();
  int status = 0, pause = 1;
  char option[SB_OPTION_NAME_MAX];

  PetscFunctionBeginUser;
  if (!pid) become_tetgen(folder, flags);
  PetscCheck(pid > 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "no process for tetgen (%s)", strerror(errno));
  for (;;) {
    const pid_t done = waitpid(pid, &status, WNOHANG);

    if (done == pid) break;
    if (now() > end || (done < 0 && errno != EINTR)) {
      (void)kill(pid, SIGKILL);
      (void)waitpid(pid, &status, 0);
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "it was not done after %g s (%s)",
              (double)job->options.seconds, SbImportOption(job->body, "tet_seconds", option));
    }
    (void)poll(NULL, 0, pause);
    pause = PetscMin(2 * pause, 50);
  }
  PetscCall(check_end(folder, status));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ what it wrote */

/* Calls take() with each line of numbers of a file of tetgen: a count, then the number of the item and its values. */
static PetscErrorCode read_items(const char *folder, const char *name, int n,
                                 PetscErrorCode (*take)(SbScan *, SbImport *), SbImport *im)
{
  char path[PATH_LENGTH];
  SbScan scan;
  int64_t count, number;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/%s", folder, name);
  ierr = SbScanOpen(name, path, &scan);
  if (!ierr) ierr = SbScanText(&scan, "count", &count);
  if (!ierr) ierr = SbScanRoom(&scan, "items", count, 2 * n, 1);
  if (!ierr) ierr = SbScanEndOfLine(&scan);
  if (!ierr && n == 3) ierr = SbImportSetVertices(im, (PetscInt)count);
  if (!ierr && n == 3) im->nvert = 0;
  for (int64_t i = 0; !ierr && i < count; i++) {
    ierr = SbScanText(&scan, "number of an item", &number);
    if (!ierr) ierr = (*take)(&scan, im);
    if (!ierr) ierr = SbScanEndOfLine(&scan);
  }
  PetscCall(SbScanClose(&scan));
  PetscFunctionReturn(ierr);
}

static PetscErrorCode take_vertex(SbScan *s, SbImport *im)
{
  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) PetscCall(SbScanReal(s, "coordinate", 0, &im->x[3 * im->nvert + k]));
  im->nvert++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode take_corners(SbScan *s, int n, const SbImport *im, PetscInt vert[])
{
  int64_t v;

  PetscFunctionBeginUser;
  for (int k = 0; k < n; k++) {
    PetscCall(SbScanText(s, "corner", &v));
    if (v < 1 || v > im->nvert) SB_SCAN_ERROR(s, "vertex %lld is not there", (long long)v);
    vert[k] = (PetscInt)v - 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode take_tet(SbScan *s, SbImport *im)
{
  PetscInt vert[4];

  PetscFunctionBeginUser;
  PetscCall(take_corners(s, 4, im, vert));
  PetscCall(SbImportAddItem(im, 3, vert, UNKNOWN, im->item[3].n + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The marker is the number of the triangle that the facet lies on. */
static PetscErrorCode take_facet(SbScan *s, SbImport *im)
{
  PetscInt vert[3];
  int64_t marker;

  PetscFunctionBeginUser;
  PetscCall(take_corners(s, 3, im, vert));
  PetscCall(SbScanText(s, "marker of a facet", &marker));
  PetscCall(SbImportAddItem(im, 2, vert, (PetscInt)marker - 1, marker));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ regions */

/* Whether the point lies in front of a triangle of the surface (0) or behind it (1). */
static int side_of(const SbSurface *s, PetscInt f, const PetscReal x[3])
{
  const PetscReal *a = s->x + 3 * s->tri[3 * f], *b = s->x + 3 * s->tri[3 * f + 1],
                  *c = s->x + 3 * s->tri[3 * f + 2];
  const PetscReal u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]},
                  v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]},
                  w[3] = {x[0] - a[0], x[1] - a[1], x[2] - a[2]};
  PetscReal n[3];

  SbCross(u, v, n);
  return SbDot3(n, w) < 0;
}

/* Tets at facets; blocked[slot]: a facet is there. */
static PetscErrorCode seed_regions(const SbSurface *s, const SbFaces *faces, SbImport *im,
                                   PetscBool blocked[])
{
  const SbItems *tri = &im->item[2];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < tri->n; i++) {
    const PetscInt f = tri->tags[i];
    PetscInt slots[2];
    const PetscInt n = SbFacesFind(faces, tri->vert + 3 * i, slots);

    PetscCheck(f >= 0 && f < s->ntri, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "facet %" PetscInt_FMT " lies on no triangle of the surface", i + 1);
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt tet = slots[k] / 4, opposite = im->item[3].vert[slots[k]];
      const PetscInt region = s->side[2 * f + side_of(s, f, im->x + 3 * opposite)];

      blocked[slots[k]] = PETSC_TRUE;
      PetscCheck(im->item[3].tags[tet] == UNKNOWN || im->item[3].tags[tet] == region, PETSC_COMM_SELF,
                 PETSC_ERR_USER_INPUT, "a tet lies in two regions");
      im->item[3].tags[tet] = region;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode spread_regions(const SbFaces *faces, const PetscBool blocked[], SbItems *tet)
{
  PetscInt *stack, n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(tet->n, &stack));
  for (PetscInt c = 0; c < tet->n; c++) {
    if (tet->tags[c] != UNKNOWN) stack[n++] = c;
  }
  while (n) {
    const PetscInt c = stack[--n];

    for (PetscInt k = 4 * c; k < 4 * c + 4; k++) {
      const PetscInt d = faces->neighbour[k];

      if (d < 0 || blocked[k] || tet->tags[d] != UNKNOWN) continue;
      tet->tags[d] = tet->tags[c];
      stack[n++] = d;
    }
  }
  PetscCall(PetscFree(stack));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves out tets of no region, and vertices that only they used. */
static PetscErrorCode drop_cavities(PetscInt nkept, SbImport *im)
{
  SbItems *tet = &im->item[3];
  PetscInt *map, n = 0;

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < tet->n; c++) {
    if (tet->tags[c] < 0) continue;
    PetscCall(PetscArraymove(tet->vert + 4 * n, tet->vert + 4 * c, 4));
    tet->tags[n++] = tet->tags[c];
  }
  tet->n = n;
  n = 0;
  PetscCall(PetscCalloc1(im->nvert, &map));
  for (PetscInt i = 0; i < 4 * tet->n; i++) map[tet->vert[i]] = 1;
  for (PetscInt i = 0; i < 3 * im->item[2].n; i++) map[im->item[2].vert[i]] = 1;
  for (PetscInt v = 0; v < im->nvert; v++) {
    if (!map[v] && v >= nkept) continue;
    PetscCall(PetscArraymove(im->x + 3 * n, im->x + 3 * v, 3));
    map[v] = n++;
  }
  im->nvert = n;
  for (PetscInt i = 0; i < 4 * tet->n; i++) tet->vert[i] = map[tet->vert[i]];
  for (PetscInt i = 0; i < 3 * im->item[2].n; i++) im->item[2].vert[i] = map[im->item[2].vert[i]];
  PetscCall(PetscFree(map));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode find_regions(const SbTetJob *job, SbImport *im)
{
  SbFaces faces;
  PetscBool *blocked;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(SbFacesCreate(im->nvert, im->item[3].n, im->item[3].vert, &faces));
  PetscCall(PetscCalloc1(4 * (size_t)im->item[3].n, &blocked));
  ierr = seed_regions(job->surface, &faces, im, blocked);
  if (!ierr) ierr = spread_regions(&faces, blocked, &im->item[3]);
  PetscCall(PetscFree(blocked));
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(ierr);
  PetscCall(drop_cavities(job->remesh ? 0 : job->surface->nvert, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the backend */

static PetscErrorCode work_in(const char *folder, const SbTetJob *job, SbImport *im)
{
  const PetscReal volume = job->size * job->size * job->size / (6 * PETSC_SQRT2);
  char flags[96];
  const SbSurface *s = job->surface;

  PetscFunctionBeginUser;
  PetscCall(write_surface(folder, job->surface));
  /* Tets of the wanted size have this volume on average, so some must be allowed to be larger. */
  (void)snprintf(flags, sizeof(flags), "-p%sMQq1.4/10a%.6f", job->remesh && job->size < job->edge ? "" : "Y",
                 (double)(1.8 * volume));
  PetscCall(run_tetgen(folder, flags, job));
  PetscCall(read_items(folder, "s.1.node", 3, take_vertex, im));
  PetscCall(read_items(folder, "s.1.ele", 4, take_tet, im));
  PetscCall(read_items(folder, "s.1.face", 2, take_facet, im));
  // coordinates come back as text: a kept surface gets its exact ones again
  if (!job->remesh) {
    PetscCheck(im->nvert >= s->nvert, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "vertices of the surface are gone");
    for (PetscInt i = 0; i < 3 * s->nvert; i++) {
      PetscCheck(PetscAbsReal(im->x[i] - s->x[i]) < 1e-6 * job->edge, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                 "vertex %" PetscInt_FMT " of the surface was moved", i / 3 + 1);
      im->x[i] = s->x[i];
    }
  }
  PetscCall(find_regions(job, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTetRun_TetGen(const SbTetJob *job, SbImport *tets)
{
  char folder[PETSC_MAX_PATH_LEN];
  PetscErrorCode ierr;
  const char *base;
  DIR *d;
  const struct dirent *entry;
  char path[PATH_LENGTH];

  PetscFunctionBeginUser;
  // a temporary folder of its own
  base = getenv("TMPDIR");
  (void)snprintf(folder, sizeof(folder) - 16, "%s/supple-tetgen-XXXXXX", base && base[0] ? base : "/tmp");
  PetscCheck(mkdtemp(folder), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "no temporary folder %s (%s); set TMPDIR to a folder that can be written", folder,
             strerror(errno));
  ierr = work_in(folder, job, tets);
  // removes the folder with the files in it
  d = opendir(folder);
  while (d && (entry = readdir(d)) != NULL) {
    (void)snprintf(path, sizeof(path), "%s/%s", folder, entry->d_name);
    (void)unlink(path);
  }
  if (d) (void)closedir(d);
  (void)rmdir(folder);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
