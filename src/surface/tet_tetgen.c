/*
  tet_tetgen.c - tetrahedralization by the program tetgen (Hang Si 2015), as a child process in a
  temporary folder.

  Each triangle of the surface is a facet with its number as marker. The output has facets, and tets
  with a number for each part of space bounded by facets (-A). The region of a part follows from its
  tets at facets: they are in the region on that side of the triangle. Parts without a region,
  cavities, are dropped. Hence neither hole points nor region points are needed.

  If the surface is kept, tetgen does not split it (-Y). Else it may split triangles to reach the
  target size; it cannot coarsen the surface.
*/
#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>
#include <fcntl.h>
#include "surface_impl.h"

#define UNKNOWN (-2) /* region of a part that is not found yet */
#define PATH_LENGTH (PETSC_MAX_PATH_LEN + 300)

/* Raises the error of a child process that failed. */
static PetscErrorCode check_end(const char *folder, int status)
{
  char said[256] = "";
  char path[PATH_LENGTH], line[256];
  FILE *f;

  PetscFunctionBeginUser;
  PetscCheck(!WIFEXITED(status) || WEXITSTATUS(status) != 127, PETSC_COMM_SELF,
             PETSC_ERR_USER_INPUT,
             "there is no program tetgen; install the package tetgen (Debian, Ubuntu)");
  if (WIFEXITED(status) && !WEXITSTATUS(status))
    PetscFunctionReturn(PETSC_SUCCESS);

  // last lines of the log, joined to one line
  (void)snprintf(path, sizeof(path), "%s/log", folder);
  f = fopen(path, "r");
  while (f && fgets(line, (int)sizeof(line), f)) {
    line[strcspn(line, "\r\n")] = 0;
    if (!line[0] || strstr(line, "@") || strstr(line, "report this bug"))
      continue;
    SbAppend(sizeof(said), said, "%s%s", said[0] ? " / " : "", line + strspn(line, " "));
  }
  if (f)
    (void)fclose(f);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "it %s %d%s%s",
          WIFSIGNALED(status) ? "was ended by signal" : "gave up with code",
          WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status), said[0] ? ", saying: " : "",
          said);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The region of each tag set of tets, from the tets at facets; tags of facets become numbers of
   triangles. */
static PetscErrorCode match_regions(const SbSurface *s, const SbFaces *faces, SbImport *im,
                                    PetscInt region[])
{
  SbItems *tri = &im->item[2];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < im->ntags; k++)
    region[k] = UNKNOWN;
  for (PetscInt i = 0; i < tri->n; i++) {
    // facet marker of TetGen: number of the surface triangle, from 1
    const PetscInt f = (PetscInt)im->group[im->tags_group[im->tags_start[tri->tags[i]]]].tag - 1;
    PetscInt slots[2];
    const PetscInt n = SbFacesFind(faces, tri->vert + 3 * i, slots);

    PetscCheck(f >= 0 && f < s->ntri, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "facet %" PetscInt_FMT " lies on no triangle of the surface", i + 1);
    tri->tags[i] = f;
    for (PetscInt k = 0; k < n; k++) {
      PetscInt *known = &region[im->item[3].tags[slots[k] / 4]];
      const PetscReal *x =
        im->x + 3 * im->item[3].vert[slots[k]]; /* in front of the triangle, or behind */
      const PetscInt side = s->side[2 * f + (SbTetVolumeTo(s->x, s->tri + 3 * f, x) > 0)];

      PetscCheck(*known == UNKNOWN || *known == side, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                 "a part between facets lies in two regions");
      *known = side;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode work_in(const char *folder, const SbTetJob *job, SbImport *im)
{
  const PetscReal volume = job->size * job->size * job->size / (6 * PETSC_SQRT2);
  char flags[96], path[PATH_LENGTH], option[SB_IMPORT_OPTION_MAX];
  const SbSurface *s = job->surface;
  PetscInt none, *region;
  PetscInt n = 0;
  FILE *f;
  pid_t self, pid;
  int status = 0;
  SbItems *tet = &im->item[3];
  SbFaces faces;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;

  // write the surface; markers are triangle numbers
  (void)snprintf(path, sizeof(path), "%s/s.smesh", folder);
  f = fopen(path, "w");
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write %s (%s)", path,
             strerror(errno));
  fprintf(f, "%" PetscInt_FMT " 3 0 0\n", s->nvert);
  for (PetscInt v = 0; v < s->nvert; v++)
    fprintf(f, "%" PetscInt_FMT " %.17g %.17g %.17g\n", v + 1, (double)s->x[3 * v],
            (double)s->x[3 * v + 1], (double)s->x[3 * v + 2]);
  fprintf(f, "%" PetscInt_FMT " 1\n", s->ntri);
  for (PetscInt t = 0; t < s->ntri; t++)
    fprintf(f, "3 %" PetscInt_FMT " %" PetscInt_FMT " %" PetscInt_FMT " %" PetscInt_FMT "\n",
            s->tri[3 * t] + 1, s->tri[3 * t + 1] + 1, s->tri[3 * t + 2] + 1, t + 1);
  fprintf(f, "0\n0\n");
  PetscCheck(!fclose(f), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "cannot write %s (%s); is the disk full?", path, strerror(errno));

  /* 1.8 times the volume of a tet of the target size, as some tets must be larger than the mean */
  (void)snprintf(flags, sizeof(flags), "-p%sMQAq1.4/10a%.6f",
                 job->remesh && job->size < job->edge ? "" : "Y", (double)(1.8 * volume));

  // run the program and check its exit status
  self = getpid();
  pid = fork();

  // child process: exit code 127 if the program is missing
  if (!pid) {
    int log;

    SbChildIsolate(self, job->options.seconds);
    if (chdir(folder))
      _exit(126);
    log = open("log", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (log < 0 || dup2(log, 1) < 0 || dup2(log, 2) < 0)
      _exit(126);
    execlp("tetgen", "tetgen", flags, "s.smesh", (char *)NULL);
    _exit(127);
  }
  PetscCheck(pid > 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "no process for tetgen (%s)",
             strerror(errno));
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  PetscCheck(!WIFSIGNALED(status) || WTERMSIG(status) != SIGALRM, PETSC_COMM_SELF,
             PETSC_ERR_USER_INPUT, "it was not done after %g s (%s)", (double)job->options.seconds,
             SbImportOption(job->body, "tet_seconds", option));
  PetscCall(check_end(folder, status));
  (void)snprintf(path, sizeof(path), "%s/s.1", folder);
  PetscCall(SbImportTagSet(im, 0, NULL, &none));
  PetscCall(SbImportRead_TetGen(path, im));
  im->item[0].n = im->item[1].n = 0; /* marked points and edges */

  // restore the exact coordinates of a kept surface, which were rounded to text
  if (!job->remesh) {
    for (PetscInt i = 0; i < 3 * PetscMin(s->nvert, im->nvert); i++) {
      PetscCheck(PetscAbsReal(im->x[i] - s->x[i]) < 1e-6 * job->edge, PETSC_COMM_SELF,
                 PETSC_ERR_USER_INPUT, "vertex %" PetscInt_FMT " of the surface was moved",
                 i / 3 + 1);
      im->x[i] = s->x[i];
    }
  }

  // tags of tets become region numbers; tets of cavities are dropped
  PetscCall(SbFacesCreate(im->nvert, tet->n, tet->vert, &faces));
  PetscCall(PetscMalloc1(im->ntags, &region));
  ierr = match_regions(s, &faces, im, region);
  for (PetscInt c = 0; !ierr && c < tet->n; c++) {
    if (region[tet->tags[c]] < 0)
      continue;
    PetscCall(PetscArraymove(tet->vert + 4 * n, tet->vert + 4 * c, 4));
    tet->tags[n++] = region[tet->tags[c]];
  }
  tet->n = n;
  PetscCall(PetscFree(region));
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(ierr);
  PetscCall(SbImportDropUnused(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTetRun_TetGen(const SbTetJob *job, SbImport *tets)
{
  char folder[PETSC_MAX_PATH_LEN];
  PetscErrorCode ierr;
  const char *base = getenv("TMPDIR");
  DIR *d;
  const struct dirent *entry;
  char path[PATH_LENGTH];

  PetscFunctionBeginUser;
  PetscCheck(!job->options.nnear, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "it makes tets of one size only, and places with finer ones are given");

  // temporary folder
  (void)snprintf(folder, sizeof(folder) - 16, "%s/supple-tetgen-XXXXXX",
                 base && base[0] ? base : "/tmp");
  PetscCheck(mkdtemp(folder), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "no temporary folder %s (%s); set TMPDIR to a folder that can be written", folder,
             strerror(errno));
  ierr = work_in(folder, job, tets);

  // remove the folder with its files
  d = opendir(folder);
  while (d && (entry = readdir(d)) != NULL) {
    (void)snprintf(path, sizeof(path), "%s/%s", folder, entry->d_name);
    (void)unlink(path);
  }
  if (d)
    (void)closedir(d);
  (void)rmdir(folder);
  PetscFunctionReturn(ierr);
}
