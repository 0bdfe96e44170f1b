/*
  Why a static solve failed: whether some body can move as a rigid one without any force. Contact without friction holds a body along
  its normals only; a matrix that leaves it free is singular, and more load steps do not help.

  With Z the six rigid motions of a body, less what is prescribed, held or tied by contact, A the operator of the last solve and D the
  diagonal of its matrix, the smallest eigenvalue of Z^T A Z against Z^T D Z is the stiffness of the softest such motion as a part of that
  of a cell. Zero but for rounding: nothing resists it. Two bodies that are free together only, tied to each other, are not found.
*/
#include "time_impl.h"
#include <petscblaslapack.h>

#define FREE 1e-10   /* of a cell's stiffness: less is rounding */
#define FAR 1e6      /* times its size: a body that went so far in a static run was not held */
#define NOTHING 1e-6 /* of its length: what is left of a motion that others or constraints take away */

/* Motion k = 0..2: along an axis, 3..5: about one through the centre, of the body's nodes; m and rad. */
static PetscErrorCode create_motion(SbRun run, PetscInt body, const PetscReal centre[3], PetscReal size,
                                    PetscInt k, Vec *z)
{
  SbSpace s = run->model->space;
  const PetscScalar *u;
  PetscScalar *to;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, z));
  PetscCall(VecGetArrayRead(run->U, &u));
  PetscCall(VecGetArray(*z, &to));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal r[3];

    if (s->node_body[i] != body) continue;
    /* linear laws know the rest state only */
    for (PetscInt c = 0; c < 3; c++)
      r[c] = (s->node_x[3 * i + c] + (s->linear ? 0. : u[3 * i + c]) - centre[c]) / size;
    if (k < 3)
      to[3 * i + k] = 1.;
    else {
      to[3 * i + (k + 1) % 3] = -r[(k + 2) % 3];
      to[3 * i + (k + 2) % 3] = r[(k + 1) % 3];
    }
  }
  PetscCall(VecRestoreArray(*z, &to));
  PetscCall(VecRestoreArrayRead(run->U, &u));
  PetscCall(SbSpaceAllow(s, *z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z[n] orthonormal in the norm of d, each with its share q[6] of the six motions; those that are nothing are dropped. */
static PetscErrorCode orthonormalise(Vec d, PetscInt *n, Vec z[6], PetscReal q[6][6])
{
  PetscInt m = 0;
  Vec w;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(d, &w));
  for (PetscInt k = 0; k < 6; k++) {
    PetscReal before, length;
    PetscScalar dot;

    for (PetscInt c = 0; c < 6; c++) q[m][c] = c == k;
    PetscCall(VecPointwiseMult(w, d, z[k]));
    PetscCall(VecDot(w, z[k], &dot));
    before = PetscSqrtReal(PetscAbsScalar(dot));
    for (PetscInt j = 0; j < m; j++) {
      PetscCall(VecPointwiseMult(w, d, z[j]));
      PetscCall(VecDot(w, z[k], &dot));
      PetscCall(VecAXPY(z[k], -dot, z[j]));
      for (PetscInt c = 0; c < 6; c++) q[m][c] -= dot * q[j][c];
    }
    PetscCall(VecPointwiseMult(w, d, z[k]));
    PetscCall(VecDot(w, z[k], &dot));
    length = PetscSqrtReal(PetscAbsScalar(dot));
    if (length <= NOTHING * before || length == 0.) continue;
    PetscCall(VecScale(z[k], 1. / length));
    for (PetscInt c = 0; c < 6; c++) q[m][c] /= length;
    PetscCall(VecSwap(z[m], z[k]));
    m++;
  }
  *n = m;
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first of the six that is free by itself, which says more than the softest of all: *k, 6 for none. */
static PetscErrorCode first_free(SbRun run, Vec d, Vec z[6], PetscInt *k)
{
  PetscScalar stiffness, size;
  Vec w;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(d, &w));
  for (*k = 0; *k < 6; ++*k) {
    PetscCall(VecPointwiseMult(w, d, z[*k]));
    PetscCall(VecDot(w, z[*k], &size));
    PetscCall(MatMult(run->operator, z[*k], w));
    PetscCall(VecDot(w, z[*k], &stiffness));
    if (size > 0. && PetscAbsScalar(stiffness) <= FREE * size) break;
  }
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The softest motion of a body: its stiffness, and its share of the six. */
static PetscErrorCode softest(SbRun run, Vec d, Vec z[6], PetscReal *stiffness, PetscReal motion[6])
{
  PetscReal q[6][6], value[6], E[36] = {0};
  PetscScalar work[36];
  PetscBLASInt n, six = 6, lwork = 36, info = 0;
  PetscInt found = 0;
  Vec Az;

  PetscFunctionBeginUser;
  *stiffness = 1.;
  PetscCall(orthonormalise(d, &found, z, q));
  if (!found) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(d, &Az));
  for (PetscInt j = 0; j < found; j++) {
    PetscCall(MatMult(run->operator, z[j], Az));
    for (PetscInt i = 0; i < found; i++) PetscCall(VecDot(z[i], Az, &E[6 * j + i]));
  }
  PetscCall(VecDestroy(&Az));
  PetscCall(PetscBLASIntCast(found, &n));
  LAPACKsyev_("V", "U", &n, E, &six, value, work, &lwork, &info);
  if (info) PetscFunctionReturn(PETSC_SUCCESS);
  *stiffness = PetscAbsReal(value[0]);
  for (int c = 0; c < 6; c++) {
    motion[c] = 0.;
    for (PetscInt i = 0; i < found; i++) motion[c] += E[i] * q[i][c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "moving along (1, 0, 0)" or "turning about (0, 0, 1)", whichever is more of it. */
static PetscErrorCode say_motion(const PetscReal motion[6], size_t size, char text[])
{
  const PetscReal along = PetscSqrtReal(PetscSqr(motion[0]) + PetscSqr(motion[1]) + PetscSqr(motion[2]));
  const PetscReal about = PetscSqrtReal(PetscSqr(motion[3]) + PetscSqr(motion[4]) + PetscSqr(motion[5]));
  const PetscBool turns = (PetscBool)(about > 2. * along);
  const PetscReal *v = turns ? motion + 3 : motion, length = turns ? about : along;
  PetscReal e[3];
  int largest = 0;

  PetscFunctionBeginUser;
  for (int c = 1; c < 3; c++) largest = PetscAbsReal(v[c]) > PetscAbsReal(v[largest]) ? c : largest;
  for (int c = 0; c < 3; c++) {
    e[c] = (v[largest] < 0. ? -v[c] : v[c]) / length;
    if (PetscAbsReal(e[c]) < 5e-3) e[c] = 0.;
  }
  PetscCall(PetscSNPrintf(text, size, "%s(%.2f, %.2f, %.2f)", turns ? "turning about " : "moving along ",
                          (double)e[0], (double)e[1], (double)e[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunFreeBody(SbRun run, PetscInt *body, size_t size, char motion[])
{
  const SbModel m = run->model;
  PetscBool assembled;
  Vec d, z[6];

  PetscFunctionBeginUser;
  *body = -1;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)run->J, &assembled, MATSEQAIJ, MATMPIAIJ, MATSEQBAIJ,
                                      MATMPIBAIJ, MATSEQSBAIJ, ""));
  if (!assembled) PetscFunctionReturn(PETSC_SUCCESS); /* -solver pressure keeps a part of it elsewhere */
  PetscCall(SbSpaceCreateVec(m->space, &d));
  PetscCall(MatGetDiagonal(run->J, d));
  PetscCall(VecAbs(d));
  for (PetscInt b = 0; b < m->nbody && *body < 0; b++) {
    const PetscReal *box = m->body[b].bbox;
    PetscReal centre[3], length = 0., stiffness, softest_of[6];
    PetscInt first = 6;

    for (int c = 0; c < 3; c++) {
      centre[c] = 0.5 * (box[c] + box[3 + c]);
      length = PetscMax(length, 0.5 * (box[3 + c] - box[c]));
    }
    for (PetscInt k = 0; k < 6; k++) PetscCall(create_motion(run, b, centre, length, k, &z[k]));
    PetscCall(first_free(run, d, z, &first));
    if (first < 6) {
      for (PetscInt k = 0; k < 6; k++) softest_of[k] = k == first;
      stiffness = 0.;
    } else
      PetscCall(softest(run, d, z, &stiffness, softest_of));
    for (PetscInt k = 0; k < 6; k++) PetscCall(VecDestroy(&z[k]));
    PetscCall(PetscInfo(NULL, "body %s: softest rigid motion %g of a cell's stiffness\n", m->body[b].name,
                        (double)stiffness));
    if (stiffness > FREE) continue;
    *body = b;
    PetscCall(say_motion(softest_of, size, motion));
  }
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunTooFar(SbRun run, Vec X, PetscBool *far)
{
  const SbModel m = run->model;
  PetscReal size = 0., most;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++) {
    for (int c = 0; c < 3; c++) size = PetscMax(size, m->body[b].bbox[3 + c] - m->body[b].bbox[c]);
  }
  PetscCall(VecNorm(X, NORM_INFINITY, &most));
  *far = (PetscBool)(most > FAR * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}
