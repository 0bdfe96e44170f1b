/*
  view.c - picture of a mesh, rendered by scripts/render from a file in supple's own format.

  The script is in ../scripts of the program's folder or, if installed, in ../share/supple/scripts.
*/
#include <errno.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tool.h"

extern char **environ;

PetscErrorCode SbToolView(SbTool *tool, const SbImport *mesh)
{
  const char *tmp = getenv("TMPDIR");
  const char *dot = strrchr(tool->view, '.');
  static const char *const places[] = {"../scripts/render", "../share/supple/scripts/render"};
  char program[PETSC_MAX_PATH_LEN], render[2 * PETSC_MAX_PATH_LEN], folder[PETSC_MAX_PATH_LEN],
    file[PETSC_MAX_PATH_LEN + 16], index[PETSC_MAX_PATH_LEN + 16];
  const char *const words[] = {
    render, file, "-o", tool->view, "--caption", tool->out ? tool->out : tool->in, NULL};
  posix_spawn_file_actions_t actions;
  PetscErrorCode ierr;
  pid_t child;
  int status = 0;
  int error = 0;
  const ssize_t n = readlink("/proc/self/exe", program, sizeof(program) - 1);
  char *slash;

  PetscFunctionBeginUser;
  PetscCheck(dot && !strcmp(dot, ".png"), PETSC_COMM_SELF, PETSC_ERR_USER,
             "-view %s: give a name that ends in .png", tool->view);

  /* the script */
  program[n > 0 ? n : 0] = 0;
  slash = strrchr(program, '/');
  if (slash)
    *slash = 0;
  (void)snprintf(render, sizeof(render), "%s/%s", program, places[0]);
  if (access(render, X_OK))
    (void)snprintf(render, sizeof(render), "%s/%s", program, places[1]);
  PetscCheck(!access(render, X_OK), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "-view needs scripts/render of supple, which is in neither %s/%s nor %s/%s", program,
             places[0], program, places[1]);

  /* the mesh, drawn by it */
  (void)snprintf(folder, sizeof(folder), "%s/supple-mesh-XXXXXX", tmp && tmp[0] ? tmp : "/tmp");
  PetscCheck(mkdtemp(folder), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "cannot make a folder %s: %s",
             folder, strerror(errno));
  (void)snprintf(file, sizeof(file), "%s/mesh.h5", folder);
  (void)snprintf(index, sizeof(index), "%s/mesh.xmf", folder);
  ierr = SbMeshFileWrite(mesh, file, SB_MESH_H5);

  // its output goes to standard error
  (void)posix_spawn_file_actions_init(&actions);
  (void)posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  if (!ierr)
    error = posix_spawn(&child, render, &actions, NULL, (char *const *)words, environ);
  (void)posix_spawn_file_actions_destroy(&actions);
  while (!ierr && !error && waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  (void)unlink(file);
  (void)unlink(index);
  (void)rmdir(folder);
  PetscCall(ierr);
  PetscCheck(!error, PETSC_COMM_SELF, PETSC_ERR_SYS, "cannot start %s: %s", render,
             strerror(error));
  PetscCheck(WIFEXITED(status) && !WEXITSTATUS(status), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE,
             "%s was not drawn: %s failed, its message is above", tool->view, render);
  PetscFunctionReturn(PETSC_SUCCESS);
}
