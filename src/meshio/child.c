/*
  child.c - a function that fills a body, run in a forked child: when it crashes or hangs the program goes on, with a message.

  The child must not disturb what it inherits: it never returns but ends by _exit() (no MPI, no buffers, no
  PetscFinalize()), takes back every signal handler (of PETSc and MPI), prints nothing, leaves no core file, and dies with its parent. It calls neither MPI nor
  HDF5. What it sends is a header with counts and the text of its error, then the arrays one after the other.
*/
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#ifdef __linux__
  #include <sys/prctl.h>
#endif
#include "meshio_impl.h"

typedef struct {
  SbCaughtError caught;
  PetscInt nvert, n[4], ngroup, ntags, nmember; /* nmember: entries of tags_group */
} Header;

/* The arrays of a body by their place and size in bytes: alike for who sends and who receives. */
typedef struct {
  void **array;
  size_t bytes;
} Part;
enum { NPART = 2 + 3 * 4 + 3 };

static void list_parts(SbImport *im, const Header *h, Part part[NPART])
{
  int n = 0;

  part[n++] = (Part){(void **)&im->x, 3 * (size_t)h->nvert * sizeof(*im->x)};
  part[n++] = (Part){(void **)&im->vert_number, (size_t)h->nvert * sizeof(*im->vert_number)};
  for (int d = 0; d < 4; d++) {
    const size_t m = (size_t)h->n[d];

    part[n++] = (Part){(void **)&im->item[d].vert, m * (size_t)(d + 1) * sizeof(PetscInt)};
    part[n++] = (Part){(void **)&im->item[d].tags, m * sizeof(PetscInt)};
    part[n++] = (Part){(void **)&im->item[d].number, m * sizeof(int64_t)};
  }
  part[n++] = (Part){(void **)&im->group, (size_t)h->ngroup * sizeof(SbGroup)};
  part[n++] = (Part){(void **)&im->tags_start, (size_t)(h->ntags ? h->ntags + 1 : 0) * sizeof(PetscInt)};
  part[n++] = (Part){(void **)&im->tags_group, (size_t)h->nmember * sizeof(PetscInt)};
}

/* ------------------------------------------------------------------ the child */

static void send_bytes(int pipe_end, const void *data, size_t n)
{
  const char *p = (const char *)data;

  while (n) {
    const ssize_t sent = write(pipe_end, p, n);

    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) _exit(1);
    p += sent;
    n -= (size_t)sent;
  }
}

/* Nothing of the parent's is left in the way: handlers, masks, terminal. */
static void isolate(pid_t parent)
{
  const struct rlimit no_core = {0, 0};
  struct sigaction usual;
  sigset_t none;
  const int nothing = open("/dev/null", O_RDWR);

  memset(&usual, 0, sizeof(usual));
  usual.sa_handler = SIG_DFL;
  for (int s = 1; s < 32; s++) (void)sigaction(s, &usual, NULL);
  (void)sigemptyset(&none);
  (void)sigprocmask(SIG_SETMASK, &none, NULL);
  (void)setrlimit(RLIMIT_CORE, &no_core);
#ifdef __linux__
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
  if (getppid() != parent) _exit(1);
  for (int i = 0; nothing >= 0 && i < 3; i++) (void)dup2(nothing, i);
}

/* Never returns. */
static void child(int pipe_end, SbChildWork work, void *ctx, const SbImport *like)
{
  Header h;
  SbImport im;
  Part part[NPART];
  PetscInt none;

  memset(&h, 0, sizeof(h));
  memset(&im, 0, sizeof(im));
  memcpy(im.where, like->where, sizeof(im.where));
  im.surface = like->surface;
  (void)PetscPushErrorHandler(SbCatchError, &h.caught);
  h.caught.code = (int)SbImportTagSet(&im, 0, NULL, &none);
  if (!h.caught.code) h.caught.code = (int)(*work)(ctx, &im);
  if (!h.caught.code) {
    h.nvert = im.nvert;
    for (int d = 0; d < 4; d++) h.n[d] = im.item[d].n;
    h.ngroup = im.ngroup;
    h.ntags = im.ntags;
    h.nmember = im.ntags ? im.tags_start[im.ntags] : 0;
  }
  send_bytes(pipe_end, &h, sizeof(h));
  list_parts(&im, &h, part);
  for (int i = 0; i < NPART; i++) send_bytes(pipe_end, *part[i].array, part[i].bytes);
  _exit(0);
}

/* ------------------------------------------------------------------ the parent */

typedef struct {
  int pipe_end;
  double deadline; /* s of the monotonic clock */
  PetscBool late;
} Receiver;

static double now(void)
{
  struct timespec t;

  (void)clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* False when the child is gone or late. */
static PetscBool receive(Receiver *r, void *data, size_t n)
{
  char *p = (char *)data;

  while (n) {
    struct pollfd wait_for = {r->pipe_end, POLLIN, 0};
    const double left = r->deadline - now();
    ssize_t got;
    int ready;

    if (left <= 0) {
      r->late = PETSC_TRUE;
      return PETSC_FALSE;
    }
    ready = poll(&wait_for, 1, (int)PetscMin(1000 * left + 1, 1e6));
    if (ready < 0 && errno != EINTR) return PETSC_FALSE;
    if (ready <= 0) continue;
    got = read(r->pipe_end, p, n);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return PETSC_FALSE;
    p += got;
    n -= (size_t)got;
  }
  return PETSC_TRUE;
}

/* The arrays, in place of those that `im` has. */
static PetscErrorCode receive_body(Receiver *r, const Header *h, SbImport *im, PetscBool *complete)
{
  Part part[NPART];

  PetscFunctionBeginUser;
  list_parts(im, h, part);
  *complete = PETSC_TRUE;
  for (int i = 0; i < NPART && *complete; i++) {
    PetscCall(PetscFree(*part[i].array));
    PetscCall(PetscMalloc(part[i].bytes, part[i].array));
    *complete = receive(r, *part[i].array, part[i].bytes);
  }
  if (!*complete) PetscFunctionReturn(PETSC_SUCCESS);
  im->nvert = h->nvert;
  for (int d = 0; d < 4; d++) im->item[d].n = im->item[d].capacity = h->n[d];
  im->ngroup = im->capacity[0] = h->ngroup;
  PetscCall(PetscFree(im->slot));
  im->nslot = 0;
  im->ntags = h->ntags;
  im->capacity[1] = h->ntags ? h->ntags + 1 : 0;
  im->capacity[2] = h->nmember;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whatever happened, the child is gone afterwards. One that closed its pipe early is ending by itself; its status tells why. */
static void finish(pid_t pid, PetscBool complete, PetscBool late, int *status)
{
  for (int i = 0; i < 200 && !complete && !late; i++) {
    if (waitpid(pid, status, WNOHANG) == pid) return;
    (void)poll(NULL, 0, 10);
  }
  if (!complete) (void)kill(pid, SIGKILL);
  while (waitpid(pid, status, 0) < 0 && errno == EINTR) {
  }
}

/* What is said of a child that sent nothing complete. */
static PetscErrorCode lost(const SbImport *im, const char *who, const char *doing, int status)
{
  PetscFunctionBeginUser;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
            "%s: %s was killed from outside while it %s; most often memory ran out: give a smaller mesh or "
            "more memory",
            im->where, who, doing);
  if (WIFSIGNALED(status))
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
            "%s: %s crashed (%s) while it %s; the input is damaged, or of a kind it cannot take", im->where,
            who, strsignal(WTERMSIG(status)), doing);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: %s ended (exit code %d) while it %s", im->where,
          who, WIFEXITED(status) ? WEXITSTATUS(status) : -1, doing);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbChildRun(const char *who, const char *doing, PetscReal seconds, SbChildWork work, void *ctx,
                          SbImport *im)
{
  int ends[2], status = 0;
  const pid_t self = getpid();
  pid_t pid;
  Header h;
  Receiver r;
  PetscBool complete;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCheck(!pipe(ends), PETSC_COMM_SELF, PETSC_ERR_SYS, "%s: no pipe to a child process (%s)", im->where,
             strerror(errno));
  pid = fork();
  if (!pid) {
    (void)close(ends[0]);
    isolate(self);
    child(ends[1], work, ctx, im);
  }
  (void)close(ends[1]);
  r = (Receiver){ends[0], now() + seconds, PETSC_FALSE};
  complete = (PetscBool)(pid > 0 && receive(&r, &h, sizeof(h)));
  if (complete && !h.caught.code) ierr = receive_body(&r, &h, im, &complete);
  (void)close(ends[0]);
  PetscCheck(pid > 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "%s: no child process for %s (%s)", im->where, who,
             strerror(errno));
  finish(pid, (PetscBool)(complete && !ierr), r.late, &status);
  PetscCall(ierr);
  PetscCheck(!r.late, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: %s was stopped: after %g s it had not %s; give a smaller or repaired input", im->where, who,
             (double)seconds, doing);
  if (!complete) PetscCall(lost(im, who, doing, status));
  PetscCheck(!h.caught.code, PETSC_COMM_SELF, (PetscErrorCode)h.caught.code, "%s", h.caught.text);
  PetscFunctionReturn(PETSC_SUCCESS);
}
