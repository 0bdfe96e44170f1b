/*
  child.c - a library in a forked child process, gmsh or HDF5 with a file of another program: when
  it crashes or hangs, the program goes on with an error.

  The child must not disturb inherited state: it never returns but ends by _exit() (no MPI, no flush
  of buffers, no PetscFinalize()), resets all signal handlers (of PETSc and MPI), prints nothing,
  writes no core file, dies with its parent, and ends after a time limit. It does not call MPI. Its
  result goes to a memory file that both processes have open: a header with counts and the error
  message, then the arrays in sequence.
*/
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>
#include "meshio_impl.h"

typedef struct {
  SbCaughtError caught;
  SbImport im; /* without its arrays */
  size_t bytes[SB_IMPORT_NPART];
} Header;

void SbChildIsolate(pid_t parent, PetscReal seconds)
{
  const PetscReal most = PetscMin(seconds, 1e9);
  const PetscReal whole = PetscFloorReal(most);
  const struct itimerval end = {
    .it_value = {(time_t)whole, 1 + (suseconds_t)(999998 * (most - whole))}};
  const struct rlimit no_core = {0, 0};
  const struct sigaction usual = {.sa_handler = SIG_DFL};
  const int nothing = open("/dev/null", O_RDWR);
  sigset_t none;

  for (int s = 1; s < 32; s++)
    (void)sigaction(s, &usual, NULL);
  (void)sigemptyset(&none);
  (void)sigprocmask(SIG_SETMASK, &none, NULL);
  (void)setrlimit(RLIMIT_CORE, &no_core);
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent)
    _exit(1);
  (void)setitimer(ITIMER_REAL, &end, NULL);
  for (int i = 0; nothing >= 0 && i < 3; i++)
    (void)dup2(nothing, i);
}

/* Body of the child process; never returns. */
static void child(FILE *file, const SbChildJob *job)
{
  Header h = {.caught = {.code = 0}};
  SbImport im = {.nvert = 0};
  SbImportPart part[SB_IMPORT_NPART];

  (void)snprintf(im.where, sizeof(im.where), "%s", job->where);
  (void)PetscPushErrorHandler(SbCatchError, &h.caught);
  h.caught.code = (int)(*job->work)(job->ctx, &im);
  h.im = im;
  SbImportParts(&im, part);
  for (int i = 0; i < job->npart; i++)
    h.bytes[i] = h.caught.code ? 0 : part[i].bytes;
  (void)fwrite(&h, sizeof(h), 1, file);
  for (int i = 0; i < job->npart; i++)
    if (h.bytes[i])
      (void)fwrite(*part[i].array, h.bytes[i], 1, file);
  _exit(fflush(file) || ferror(file) ? 1 : 0);
}

/* Takes the result over: counts, the first parts, and with all parts also groups and note. */
static PetscErrorCode take_result(FILE *file, const Header *h, int npart, SbImport *im,
                                  PetscBool *complete)
{
  SbImportPart part[SB_IMPORT_NPART];

  PetscFunctionBeginUser;
  SbImportParts(im, part);
  for (int i = 0; i < npart; i++) {
    PetscCall(PetscFree(*part[i].array));
    PetscCall(PetscMalloc(h->bytes[i], part[i].array));
    if (*complete && h->bytes[i])
      *complete = (PetscBool)(fread(*part[i].array, h->bytes[i], 1, file) == 1);
  }
  if (!*complete)
    PetscFunctionReturn(PETSC_SUCCESS);
  im->nvert = h->im.nvert;
  for (int d = 0; d < 4; d++)
    im->item[d].n = im->item[d].capacity = h->im.item[d].n;
  if (npart < SB_IMPORT_NPART)
    PetscFunctionReturn(PETSC_SUCCESS);
  im->nmiddle = (SbCount){h->im.nmiddle.n, h->im.nmiddle.n};
  im->ngroup = im->capacity[0] = h->im.ngroup;
  im->ntags = h->im.ntags;
  im->capacity[1] = im->ntags + 1;
  im->capacity[2] = im->tags_start ? im->tags_start[im->ntags] : 0;
  im->groups.n = im->groups.capacity = h->im.groups.n;
  im->groups.nslot = h->im.groups.nslot;
  if (h->im.note[0])
    SbImportRemark(im, "%s", h->im.note);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbChildRun(const SbChildJob *job, SbImport *im)
{
  const pid_t self = getpid();
  const int memory = memfd_create("supple", MFD_CLOEXEC);
  FILE *file = memory < 0 ? NULL : fdopen(memory, "w+b");
  int status = 0;
  int killer;
  pid_t pid;
  Header h;
  PetscBool complete;

  PetscFunctionBeginUser;
  PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_SYS, "%s: no memory shared with a child process (%s)",
             im->where, strerror(errno));
  pid = fork();
  if (!pid) {
    SbChildIsolate(self, job->seconds);
    child(file, job);
  }
  while (pid > 0 && waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  rewind(file);
  complete = (PetscBool)(pid > 0 && WIFEXITED(status) && !WEXITSTATUS(status) &&
                         fread(&h, sizeof(h), 1, file) == 1);

  // replace the arrays of `im` by the result
  if (complete && !h.caught.code)
    PetscCall(take_result(file, &h, job->npart, im, &complete));
  (void)fclose(file);
  PetscCheck(pid > 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "%s: no child process for %s (%s)", im->where,
             job->who, strerror(errno));

  /* error messages for a child without a complete result */
  killer = !complete && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  PetscCheck(killer != SIGALRM, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: %s was stopped: after %g s it had not %s; give a smaller or repaired input",
             im->where, job->who, (double)job->seconds, job->doing);
  PetscCheck(killer != SIGKILL, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: %s was killed from outside while it %s; most often memory ran out: give a "
             "smaller mesh or "
             "more memory",
             im->where, job->who, job->doing);
  PetscCheck(!killer, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: %s crashed (%s) while it %s; the input is damaged, or of a kind it cannot take",
             im->where, job->who, strsignal(killer), job->doing);
  PetscCheck(complete, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: %s ended (exit code %d) while it %s", im->where, job->who, WEXITSTATUS(status),
             job->doing);
  PetscCheck(!h.caught.code, PETSC_COMM_SELF, (PetscErrorCode)h.caught.code, "%s", h.caught.text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work of SbGmshRun() in the child. */
static PetscErrorCode call_gmsh(void *ctx, SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(SbGmshCall((const SbGmshJob *)ctx, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGmshRun(const SbGmshJob *job, SbImport *im)
{
  const SbChildJob child_job = {.where = job->where,
                                .who = "gmsh",
                                .doing = job->doing,
                                .seconds = job->seconds,
                                .npart = SB_IMPORT_NMESH,
                                .work = call_gmsh,
                                .ctx = (void *)job};

  PetscFunctionBeginUser;
  PetscCall(SbChildRun(&child_job, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
