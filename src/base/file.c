/*
  file.c - files from others: opened for reading only if they are regular and of a limited size, so
  that a pipe without a writer, a device or an endless file is an error, not a wait; new files,
  which never follow a link that somebody has put in their place.
*/
#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include "sbbase.h"

const char *SbFileOpen(const char *path, size_t most, FILE **file)
{
  /* O_NONBLOCK: a pipe without a writer is opened at once */
  const int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  const char *why = NULL;
  struct stat info;

  *file = NULL;
  if (fd < 0 || fstat(fd, &info))
    why = strerror(errno);
  else if (S_ISDIR(info.st_mode))
    why = strerror(EISDIR);
  else if (!S_ISREG(info.st_mode))
    why = "it is not a regular file";
  else if (most && (size_t)info.st_size > most)
    why = "it is too large for what it is to hold";
  else {
    *file = fdopen(fd, "rb");
    if (!*file)
      why = strerror(errno);
  }
  if (!*file && fd >= 0)
    (void)close(fd);
  return why;
}

FILE *SbFileCreate(const char *path)
{
  int fd;
  FILE *file;

  (void)unlink(path);
  fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  file = fd < 0 ? NULL : fdopen(fd, "wb");
  if (!file && fd >= 0)
    (void)close(fd);
  return file;
}
