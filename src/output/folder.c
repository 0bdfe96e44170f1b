/*
  The folder of the results: created, write-tested and locked before anything is computed; an
  earlier run's results are moved aside when the run starts, files with other names never.
  Checkpoints are found by number.

  Plain files are written whole beside their target and renamed into it, so that a reader, or a
  kill, never meets half a file; failures of one rank are reported by all.

  The lock is one of the file system (fcntl) on a file that names host and process: it is released
  with its process, however that ends, and works between hosts where the file system supports it;
  else there is none.
*/
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "output_impl.h"

static const char *const ours[] = {"fields.h5",     "fields.xmf",      "fields.vtkhdf",
                                   "contacts.xmf",  "contacts.vtkhdf", "history.csv",
                                   "scenario.opts", "run.json",        "ledger.csv"};

PetscErrorCode SbAgree(MPI_Comm comm, PetscErrorCode code, const char *message)
{
  SbCaughtError caught = {message[0] ? (int)code : 0, ""};

  PetscFunctionBeginUser;
  SbFormat(sizeof(caught.text), caught.text, "%s", message);
  PetscCall(SbCaughtRaise(comm, &caught));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbFileReplace(const char *path, const void *text, size_t size, char message[SB_MESSAGE_MAX])
{
  char tmp[PETSC_MAX_PATH_LEN + 8];
  FILE *file;
  int bad = 1;

  (void)snprintf(tmp, sizeof(tmp), "%s.tmp", path);
  errno = 0;
  file = SbFileCreate(tmp);
  if (file) {
    bad = fwrite(text, 1, size, file) != size;
    bad = fclose(file) || bad || rename(tmp, path);
  }
  if (!bad)
    return;
  SbFormat(SB_MESSAGE_MAX, message, "cannot write %zu bytes to %s: %s; " SB_NO_ROOM, size, path,
           strerror(errno ? errno : EIO));
  (void)unlink(tmp);
}

void SbFileKeep(const char *path, PetscInt step, char other[SB_OTHER_MAX],
                char message[SB_MESSAGE_MAX])
{
  const char *dot = strrchr(path, '.');

  for (int k = 1; k == 1 || !access(other, F_OK); k++) {
    SbFormat(SB_OTHER_MAX, other, "%.*s_before_%06" PetscInt_FMT, (int)(dot - path), path, step);
    if (k > 1)
      SbAppend(SB_OTHER_MAX, other, "_%d", k);
    SbAppend(SB_OTHER_MAX, other, "%s", dot);
  }
  if (rename(path, other))
    SbFormat(SB_MESSAGE_MAX, message, "cannot rename %s to %s: %s", path, other, strerror(errno));
}

void SbFileRemember(const char *path, SbFileIdentity *file)
{
  struct stat info;

  *file = (SbFileIdentity){0};
  if (!stat(path, &info))
    *file = (SbFileIdentity){info.st_dev, info.st_ino, PETSC_FALSE};
}

PetscBool SbFileLost(const char *path, SbFileIdentity *file)
{
  struct stat info;

  if (!file->number || file->lost)
    return file->lost;
  file->lost =
    (PetscBool)(stat(path, &info) || info.st_dev != file->device || info.st_ino != file->number);
  if (file->lost)
    (void)SbWarning(PETSC_COMM_SELF,
                    "%s was deleted or replaced while the run writes it: what is written from now "
                    "on is lost",
                    path);
  return file->lost;
}

void SbOutputPath(SbOutput out, const char *name, char path[PETSC_MAX_PATH_LEN])
{
  SbFormat(PETSC_MAX_PATH_LEN, path, "%s/%s", out->dir, name);
}

PetscBool SbOutputDue(PetscReal every, PetscReal t, PetscReal dt)
{
  // A step that ends at the multiple but for rounding has reached it. A load factor may come back.
  const PetscReal ahead = 1e-6 * PetscAbsReal(dt);

  return (PetscBool)(PetscFloorReal((t + ahead) / every) !=
                     PetscFloorReal((t - dt + ahead) / every));
}

void SbFolderMake(SbOutput out, char message[SB_MESSAGE_MAX])
{
  char part[PETSC_MAX_PATH_LEN], probe[PETSC_MAX_PATH_LEN];
  FILE *file;
  int error = 0;

  SbOutputPath(out, ".supple_tries_to_write", probe);
  for (size_t i = 1; i <= strlen(out->dir) && !error; i++) {
    if (out->dir[i] != '/' && out->dir[i])
      continue;
    SbFormat(i + 1, part, "%s", out->dir);
    if (mkdir(part, 0777) && errno != EEXIST && errno != EISDIR && access(part, F_OK))
      error = errno;
  }
  if (!error) {
    file = SbFileCreate(probe);
    error = file ? 0 : errno;
    if (file)
      (void)fclose(file);
    (void)unlink(probe);
  }
  if (error)
    SbFormat(SB_MESSAGE_MAX, message, "-output_dir %s cannot be written: %s; give another folder",
             out->dir, strerror(error));
}

#define LOCK ".supple_running"

/* Lock file of this process, removed after an error; empty: none. */
static char locked[PETSC_MAX_PATH_LEN];

static void remove_lock(void)
{
  if (locked[0])
    (void)unlink(locked);
  locked[0] = 0;
}

/* Opens and locks the lock file, or says why not; rank 0. Again if its owner removed the file
   meanwhile. */
static void lock_folder(SbOutput out, char message[SB_MESSAGE_MAX])
{
  struct flock all = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
  char path[PETSC_MAX_PATH_LEN];
  char text[512] = "";
  char host[256] = "";
  struct stat mine, there;

  SbOutputPath(out, LOCK, path);
  for (PetscBool again = PETSC_TRUE; again;) {
    out->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);

    /* never a link to another file, which would be truncated */
    if (out->lock < 0 ? errno == ELOOP || errno == ENXIO
                      : fstat(out->lock, &mine) || !S_ISREG(mine.st_mode) || mine.st_nlink > 1) {
      SbFormat(SB_MESSAGE_MAX, message,
               "-output_dir %s: %s there is a link to another file, or none: remove it", out->dir,
               LOCK);
      if (out->lock >= 0)
        (void)close(out->lock);
      out->lock = -1;
    }
    if (out->lock < 0)
      return;
    if (fcntl(out->lock, F_SETLK, &all)) {
      const ssize_t n =
        errno == EACCES || errno == EAGAIN ? read(out->lock, text, sizeof(text) - 1) : -1;

      (void)close(out->lock);
      out->lock = -1;
      if (n >= 0)
        SbFormat(
          SB_MESSAGE_MAX, message,
          "-output_dir %s is in use by another run%s%s: wait for its end, or give another folder",
          out->dir, n ? ", " : "", text);
      return;
    }
    again =
      (PetscBool)(fstat(out->lock, &mine) || stat(path, &there) || mine.st_ino != there.st_ino);
    if (again)
      (void)close(out->lock);
  }
  (void)gethostname(host, sizeof(host) - 1);
  SbFormat(sizeof(text), text, "process %ld on %s since %s", (long)getpid(), host, out->started);
  if (!ftruncate(out->lock, 0))
    (void)!write(out->lock, text, strlen(text));

  SbErrorSetCleanup(remove_lock); /* an error leaves the output as it is */
  SbFormat(sizeof(locked), locked, "%s", path);
}

PetscErrorCode SbOutputLock(SbRun run)
{
  const SbOutput out = (SbOutput)run->monitors.output;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  if (!out->rank)
    lock_folder(out, message);
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_OPEN, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbFolderUnlock(SbOutput out)
{
  if (out->lock < 0)
    return;
  remove_lock();
  (void)close(out->lock);
  out->lock = -1;
}

/* Checkpoints in the folder. */
static int is_checkpoint(const struct dirent *entry)
{
  int end = 0;

  (void)sscanf(entry->d_name, "checkpoint_%*[0-9].h5%n", &end);
  return end && !entry->d_name[end];
}

/* Names of the checkpoints in a folder, oldest first, by their numbers; free with free_names(). */
static int list_checkpoints(const char *dir, struct dirent ***names)
{
  const int n = scandir(dir, names, is_checkpoint, versionsort);

  if (n < 0)
    *names = NULL;
  return PetscMax(n, 0);
}

static void free_names(int n, struct dirent **names)
{
  for (int i = 0; i < n; i++)
    free(names[i]);
  free(names);
}

void SbCheckpointPrune(SbOutput out, PetscInt step, PetscInt keep)
{
  struct dirent **names;
  const int n = list_checkpoints(out->dir, &names);
  char path[PETSC_MAX_PATH_LEN];

  for (int i = 0; i < n; i++) {
    if (i >= n - keep && strtol(names[i]->d_name + strlen("checkpoint_"), NULL, 10) <= step)
      continue;
    SbOutputPath(out, names[i]->d_name, path);
    (void)unlink(path);
  }
  free_names(n, names);
}

PetscErrorCode SbCheckpointFind(SbOutput out, char path[PETSC_MAX_PATH_LEN])
{
  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(path, out->restart, PETSC_MAX_PATH_LEN));
  if (strcmp(path, "latest"))
    PetscFunctionReturn(PETSC_SUCCESS);
  path[0] = 0;
  if (!out->rank) {
    struct dirent **names;
    const int n = list_checkpoints(out->dir, &names);
    const int k = n - 1 - out->ndamaged;

    if (k >= 0)
      SbOutputPath(out, names[k]->d_name, path);
    free_names(n, names);
  }
  PetscCallMPI(MPI_Bcast(path, PETSC_MAX_PATH_LEN, MPI_CHAR, 0, out->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves an earlier run's results into a subfolder named by its end time. */
static PetscErrorCode keep_earlier(SbOutput out)
{
  char path[PETSC_MAX_PATH_LEN], name[SB_FILE_MAX], date[32];
  SbOutputFileSize *file;
  struct stat info;
  struct tm local;
  PetscInt n;
  int made = -1;

  PetscFunctionBeginUser;
  PetscCall(SbOutputFiles(out, &n, &file));
  if (!n)
    PetscCall(PetscFree(file));
  if (!n)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbOutputPath(out, "run.json", path);
  if (stat(path, &info))
    info.st_mtime = time(NULL);
  (void)strftime(date, sizeof(date), "%Y-%m-%d_%H-%M-%S", localtime_r(&info.st_mtime, &local));
  for (int k = 1; k < 1000 && made; k++) {
    SbFormat(sizeof(name), name, "before_%s", date);
    if (k > 1)
      SbAppend(sizeof(name), name, "_%d", k);
    SbOutputPath(out, name, path);
    made = mkdir(path, 0777);
    if (made && errno != EEXIST)
      break;
  }
  PetscCheck(!made, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE,
             "cannot make the folder %s for the results of an earlier run: %s; -output_overwrite "
             "yes replaces them",
             path, strerror(errno));
  for (PetscInt i = 0; i < n; i++) {
    char from[PETSC_MAX_PATH_LEN], to[PETSC_MAX_PATH_LEN + SB_FILE_MAX];

    SbOutputPath(out, file[i].name, from);
    SbFormat(sizeof(to), to, "%s/%s", path, file[i].name);
    PetscCheck(!rename(from, to), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "cannot move %s to %s: %s",
               from, to, strerror(errno));
  }
  PetscCall(PetscFree(file));
  if (!out->quiet)
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s: results of an earlier run are kept in %s\n",
                          out->dir, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFolderClear(SbOutput out, PetscInt step0)
{
  char path[PETSC_MAX_PATH_LEN + 8];

  PetscFunctionBeginUser;
  if (!out->restart[0] && !out->overwrite)
    PetscCall(keep_earlier(out));

  // Later checkpoints would be taken for the latest ones.
  SbCheckpointPrune(out, out->restart[0] ? step0 : -1, PETSC_MAX_INT);
  SbOutputPath(out, "checkpoint.tmp", path);
  (void)unlink(path);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(ours); i++) {
    SbOutputPath(out, ours[i], path);
    if (!out->restart[0])
      (void)unlink(path);

    // temporary files of an aborted run
    PetscCall(PetscStrlcat(path, ".tmp", sizeof(path)));
    (void)unlink(path);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputFiles(SbOutput out, PetscInt *n, SbOutputFileSize **files)
{
  enum {
    NOURS = PETSC_STATIC_ARRAY_LENGTH(ours)
  };
  struct dirent **checkpoint;
  const int ncheckpoint = list_checkpoints(out->dir, &checkpoint);

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(PetscMalloc1(NOURS + ncheckpoint, files));
  for (int i = 0; i < NOURS + ncheckpoint; i++) {
    SbOutputFileSize *file = &(*files)[*n];
    char path[PETSC_MAX_PATH_LEN];
    struct stat info;

    SbFormat(sizeof(file->name), file->name, "%s",
             i < NOURS ? ours[i] : checkpoint[i - NOURS]->d_name);
    SbOutputPath(out, file->name, path);
    if (stat(path, &info))
      continue;
    file->bytes = (PetscInt64)info.st_size;
    (*n)++;
  }
  free_names(ncheckpoint, checkpoint);
  PetscFunctionReturn(PETSC_SUCCESS);
}
