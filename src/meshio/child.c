/*
  child.c - gmsh in a forked child process: when it crashes or hangs, the program goes on with an
  error.

  The child must not disturb inherited state: it never returns but ends by _exit() (no MPI, no flush
  of buffers, no PetscFinalize()), resets all signal handlers (of PETSc and MPI), prints nothing,
  writes no core file, dies with its parent, and ends after a time limit. It calls neither MPI nor
  HDF5. Its result goes to a memory file that both processes have open: a header with counts and the
  error message, then the arrays in sequence.
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
  PetscInt nvert, n[4]; /* numbers of vertices, and of items by dimension */
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
static void child(FILE *file, const SbGmshJob *job)
{
  Header h = {.nvert = 0};
  SbImport im = {.nvert = 0};
  SbImportPart part[SB_IMPORT_NPART];

  (void)snprintf(im.where, sizeof(im.where), "%s", job->where);
  (void)PetscPushErrorHandler(SbCatchError, &h.caught);
  h.caught.code = (int)SbGmshCall(job, &im);
  h.nvert = im.nvert;
  for (int d = 0; d < 4; d++)
    h.n[d] = im.item[d].n;
  (void)fwrite(&h, sizeof(h), 1, file);
  SbImportParts(&im, part);
  for (int i = 0; i < SB_IMPORT_NMESH && !h.caught.code; i++)
    if (part[i].bytes)
      (void)fwrite(*part[i].array, part[i].bytes, 1, file);
  _exit(fflush(file) || ferror(file) ? 1 : 0);
}

PetscErrorCode SbGmshRun(const SbGmshJob *job, SbImport *im)
{
  const pid_t self = getpid();
  const int memory = memfd_create("supple", MFD_CLOEXEC);
  FILE *file = memory < 0 ? NULL : fdopen(memory, "w+b");
  int status = 0;
  int killer;
  pid_t pid;
  Header h;
  SbImportPart part[SB_IMPORT_NPART];
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
  if (complete && !h.caught.code) {
    im->nvert = h.nvert;
    for (int d = 0; d < 4; d++)
      im->item[d].n = im->item[d].capacity = h.n[d];
    SbImportParts(im, part);
    for (int i = 0; i < SB_IMPORT_NMESH && complete; i++) {
      PetscCall(PetscFree(*part[i].array));
      PetscCall(PetscMalloc(part[i].bytes, part[i].array));
      complete = (PetscBool)(!part[i].bytes || fread(*part[i].array, part[i].bytes, 1, file) == 1);
    }
    if (!complete)
      im->nvert = 0;
    for (int d = 0; d < 4 && !complete; d++)
      im->item[d].n = im->item[d].capacity = 0;
  }
  (void)fclose(file);
  PetscCheck(pid > 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "%s: no child process for gmsh (%s)",
             im->where, strerror(errno));

  /* error messages for a child without a complete result */
  killer = !complete && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  PetscCheck(killer != SIGALRM, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: gmsh was stopped: after %g s it had not %s; give a smaller or repaired input",
             im->where, (double)job->seconds, job->doing);
  PetscCheck(killer != SIGKILL, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: gmsh was killed from outside while it %s; most often memory ran out: give a "
             "smaller mesh or "
             "more memory",
             im->where, job->doing);
  PetscCheck(!killer, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: gmsh crashed (%s) while it %s; the input is damaged, or of a kind it cannot take",
             im->where, strsignal(killer), job->doing);
  PetscCheck(complete, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: gmsh ended (exit code %d) while it %s", im->where, WEXITSTATUS(status),
             job->doing);
  PetscCheck(!h.caught.code, PETSC_COMM_SELF, (PetscErrorCode)h.caught.code, "%s", h.caught.text);
  PetscFunctionReturn(PETSC_SUCCESS);
}
