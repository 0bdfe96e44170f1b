/*
  copies.c - copies of a body, placed as listed in a file or on a grid.

  With scale s, rotation R and translation t of the body's own options and those of a copy (s', R',
  t'), a mesh point x is at R' R s' s x + t + t'. Rotations are composed as quaternions: q' q.
*/
#include "scene_impl.h"

#define NUMBERS 11 /* numbers on a line: x y z, axis, degrees, scale, velocity */

/* Parses the placement on a line, numbers with blanks or commas; not found: a blank line or a
   comment. */
static PetscErrorCode read_line(const char *option, const char *file, int number, size_t length,
                                char *line, SbPlacement *place, PetscBool *found)
{
  PetscReal v[NUMBERS] = {0., 0., 0., 0., 0., 1., 0., 1., 0., 0., 0.};
  char *rest;
  char *end = line;
  const char *cr;
  int n = 0;

  PetscFunctionBeginUser;
  cr = (const char *)memchr(line, '\r', length);
  PetscCheck(strlen(line) == length && (!cr || !cr[1] || cr[1] == '\n'), PETSC_COMM_SELF,
             PETSC_ERR_FILE_UNEXPECTED, "%s %s line %d holds %s", option, file, number,
             strlen(line) < length ? "a zero byte; it is no text file"
                                   : "a carriage return alone; end lines with a newline");
  line[strcspn(line, "#\r\n")] = 0;
  for (char *word = strtok_r(line, ", \t", &rest); word; word = strtok_r(NULL, ", \t", &rest)) {
    if (n < NUMBERS)
      v[n] = strtod(word, &end);
    PetscCheck(n < NUMBERS && end != word && !*end && PetscAbsReal(v[n]) <= PETSC_MAX_REAL,
               PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s %s line %d: '%s' is %s", option,
               file, number, word,
               n < NUMBERS ? "not a number" : "too much: 11 numbers are the most");
    n++;
  }
  *found = (PetscBool)(n > 0);
  PetscCheck(!n || n == 3 || n == 7 || n == 8 || n == 11, PETSC_COMM_SELF,
             PETSC_ERR_FILE_UNEXPECTED,
             "%s %s line %d has %d numbers, needs 3, 7, 8 or 11: x y z [ax ay az degrees [scale "
             "[vx vy vz]]]",
             option, file, number, n);
  PetscCheck(v[7] > 0. && (v[6] == 0. || v[3] != 0. || v[4] != 0. || v[5] != 0.), PETSC_COMM_SELF,
             PETSC_ERR_FILE_UNEXPECTED, "%s %s line %d: %s", option, file, number,
             v[7] > 0. ? "the axis 0 0 0 has no direction" : "the scale must be above 0");
  *place = (SbPlacement){.x = {v[0], v[1], v[2]},
                         .rotate = {v[3], v[4], v[5], v[6]},
                         .scale = v[7],
                         .velocity = {v[8], v[9], v[10]}};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_file(const char *option, const char *file, PetscInt *n,
                                SbPlacement **place)
{
  char *line = NULL;
  size_t size = 0;
  ssize_t length;
  FILE *f;
  const char *why = SbFileOpen(file, SB_TEXT_BYTES, &f);
  PetscInt room = 0;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "%s %s: %s", option, file, why);
  for (int number = 1; !ierr && (length = getline(&line, &size, f)) >= 0; number++) {
    PetscBool found = PETSC_FALSE;

    PetscCall(SbReserve(*n + 1, sizeof(**place), &room, place));
    ierr = read_line(option, file, number, (size_t)length, line, &(*place)[*n], &found);
    *n += found;
  }
  free(line);
  (void)fclose(f);
  PetscCall(ierr);
  PetscCheck(*n, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s %s has no line with numbers",
             option, file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneReadCopies(MPI_Comm comm, const char *name, PetscInt *n, SbPlacement **place)
{
  char text[PETSC_MAX_PATH_LEN], option[3 * SB_NAME_MAX];
  SbCaughtError caught = {0, ""};
  PetscMPIInt rank;
  SbScope scope;

  PetscFunctionBeginUser;
  *n = 0;
  *place = NULL;
  SbScopeSet(&scope, "body", "", name);
  PetscCall(SbOptionString(&scope, "copies", sizeof(text), text));
  if (!text[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!strncmp(text, "grid:", 5)) {
    int count[3];
    int end = 0;
    double d[3];
    PetscBool read;

    // n placements on a grid nx,ny,nz,dx,dy,dz, x fastest
    read = (PetscBool)(sscanf(text + 5, "%d,%d,%d,%lf,%lf,%lf%n", &count[0], &count[1], &count[2],
                              &d[0], &d[1], &d[2], &end) == 6 &&
                       !text[5 + end]);
    for (int i = 0; i < 3 && read; i++)
      read = (PetscBool)(count[i] > 0);
    PetscCheck(read && (double)count[0] * count[1] * count[2] < 1e6, PETSC_COMM_SELF,
               PETSC_ERR_USER,
               "-body_%s_copies grid:%s: give grid:nx,ny,nz,dx,dy,dz, how many along each axis (a "
               "million at "
               "most) and how far apart (m)",
               name, text + 5);
    *n = (PetscInt)count[0] * count[1] * count[2];
    PetscCall(PetscCalloc1(*n, place));
    for (PetscInt k = 0; k < *n; k++) {
      const PetscInt at[3] = {k % count[0], k / count[0] % count[1], k / count[0] / count[1]};

      (*place)[k] = (SbPlacement){.rotate = {0., 0., 1., 0.}, .scale = 1.};
      for (int i = 0; i < 3; i++)
        (*place)[k].x[i] = (PetscReal)(at[i] * d[i]);
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* a file, read on rank 0 and broadcast */
  SbOptionName(&scope, "copies", sizeof(option), option);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank)
    SB_CATCH(&caught, read_file(option, text, n, place));
  if (caught.code)
    PetscCall(PetscFree(*place));
  PetscCall(SbCaughtRaise(comm, &caught));
  PetscCallMPI(MPI_Bcast(n, 1, MPIU_INT, 0, comm));
  if (rank)
    PetscCall(PetscMalloc1(*n, place));
  PetscCallMPI(MPI_Bcast(*place, (PetscMPIInt)((size_t)*n * sizeof(**place)), MPI_BYTE, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quaternion of a rotation by axis and angle in degrees, scalar first. */
static void quaternion(const PetscReal rotate[4], PetscReal q[4])
{
  const PetscReal length =
    PetscSqrtReal(PetscSqr(rotate[0]) + PetscSqr(rotate[1]) + PetscSqr(rotate[2]));
  const PetscReal half = rotate[3] * PETSC_PI / 360.;

  q[0] = length > 0. ? PetscCosReal(half) : 1.;
  for (int i = 0; i < 3; i++)
    q[i + 1] = length > 0. ? PetscSinReal(half) * rotate[i] / length : 0.;
}

void SbPlacementAdd(const SbPlacement *place, SbBody *body)
{
  PetscReal p[4], q[4], r[4], sine;

  body->scale *= place->scale;
  for (int i = 0; i < 3; i++) {
    body->translate[i] += place->x[i];
    body->velocity[i] += place->velocity[i];
  }
  if (place->rotate[3] == 0.)
    return;

  /* rotation of the copy after that of the body */
  quaternion(place->rotate, p);
  quaternion(body->rotate, q);
  r[0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3];
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;

    r[i + 1] = p[0] * q[i + 1] + p[i + 1] * q[0] + p[j + 1] * q[k + 1] - p[k + 1] * q[j + 1];
  }
  sine = PetscSqrtReal(PetscSqr(r[1]) + PetscSqr(r[2]) + PetscSqr(r[3]));
  for (int i = 0; i < 3; i++)
    body->rotate[i] = sine > 0. ? r[i + 1] / sine : i == 2;
  body->rotate[3] = 2. * atan2(sine, r[0]) * 180. / PETSC_PI;
}
