// @ranks 1 2 3 4
/*
  Linear systems of contact: iteration counts bounded for all stiffnesses, meshes and numbers of
  ranks; agreement with a factorisation; changing sparsity patterns; detection of negative
  curvature; PETSc's methods instead of supple's.
*/
#include "../contact_problem.h"

#define TIGHT "-contact_ksp_rtol 1e-8 "

/* Solves the problem; the solve must converge. */
static PetscErrorCode solve(ContactProblem *p, SbContactSystem system, const char *what,
                            PetscInt *its)
{
  KSPConvergedReason reason;
  PetscReal left;

  PetscFunctionBeginUser;
  PetscCall(SbContactSystemSolve(system, p->K, &p->blocks, PETSC_TRUE, p->F, p->Y, &reason, its));
  SB_CHECK(reason > 0, "%s: %s", what, KSPConvergedReasons[reason]);
  PetscCall(contact_problem_residual(p, &left));

  /* the energy of the error is reduced by 1e-16; the residual weights stiff components, those of
     the mesh included, by the root of the stiffness */
  SB_CHECK(left < 2e-6 * PetscMax(1., PetscSqrtReal(p->scale)), "%s: residual %g", what, left);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterations at four stiffnesses on a mesh, against a factorisation. */
static PetscErrorCode check_stiffness(PetscInt cells, const char *element, PetscReal h,
                                      PetscInt most)
{
  ContactProblem p;

  PetscFunctionBeginUser;
  PetscCall(contact_problem_open(cells, element, h, TIGHT, &p));
  SB_CHECK(p.npair > 100, "%d blocks", (int)p.npair);
  for (int power = 0; power <= 6; power += 2) {
    PetscInt its[2];
    PetscReal size, error;
    Vec Y;

    PetscCall(contact_problem_scale(&p, PetscPowReal(10., power)));
    PetscCall(VecDuplicate(p.Y, &Y));
    for (PetscInt way = 1; way <= 2; way++) {
      SbContactSystem system;
      char what[96];

      PetscCall(PetscSNPrintf(what, sizeof(what), "%s %d cells, stiffness 1e%d, h %g, way %d",
                              element, (int)cells, power, h, (int)way));
      PetscCall(SbContactSystemCreate(p.scene.model->space, way, &system));
      PetscCall(solve(&p, system, what, &its[way - 1]));
      if (way == 1)
        PetscCall(VecCopy(p.Y, Y));
      PetscCall(SbContactSystemDestroy(&system));
    }
    SB_CHECK(its[0] == 1, "%d iterations of a factorisation", (int)its[0]);
    SB_CHECK(its[1] > 1 && its[1] <= most, "%s %d cells, stiffness 1e%d, h %g: %d iterations",
             element, (int)cells, power, h, (int)its[1]);
    PetscCall(VecAXPY(Y, -1., p.Y));
    PetscCall(VecNorm(Y, NORM_INFINITY, &error));
    PetscCall(VecNorm(p.Y, NORM_INFINITY, &size));
    SB_CHECK(error < 1e-6 * size, "stiffness 1e%d: solutions differ by %g of %g m", power, error,
             size);
    PetscCall(VecDestroy(&Y));
  }
  PetscCall(contact_problem_close(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One system for changing sets of blocks, then for blocks that make it indefinite. */
static PetscErrorCode check_changes(PetscInt way)
{
  ContactProblem p;
  SbContactSystem system;
  KSPConvergedReason reason;
  PetscInt its, all;

  PetscFunctionBeginUser;
  PetscCall(contact_problem_open(4, "p1", 0.01, TIGHT, &p));
  PetscCall(contact_problem_scale(&p, 1e4));
  PetscCall(SbContactSystemCreate(p.scene.model->space, way, &system));
  all = p.blocks.n;
  for (int round = 0; round < 60; round++) {
    /* all of them in two of three rounds; after round 30 none, until the pattern drops them; in the
       last round all */
    p.blocks.n = round % 3 == 0 || round > 30 ? 0 : all;
    if (round == 59)
      p.blocks.n = all;
    PetscCall(solve(&p, system, "blocks that come and go", &its));
  }

  /* a large negative diagonal */
  for (PetscInt k = 0; k < p.blocks.n; k++)
    for (int e = 0; e < 9; e++)
      p.blocks.block[k].H[e] *= -1.;
  PetscCall(SbContactSystemSolve(system, p.K, &p.blocks, PETSC_TRUE, p.F, p.Y, &reason, &its));
  SB_CHECK(reason < 0, "an indefinite matrix was solved with: %s", KSPConvergedReasons[reason]);
  for (PetscInt k = 0; k < p.blocks.n; k++)
    for (int e = 0; e < 9; e++)
      p.blocks.block[k].H[e] *= -1.;
  PetscCall(solve(&p, system, "after an indefinite matrix", &its));
  PetscCall(SbContactSystemDestroy(&system));
  PetscCall(contact_problem_close(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Small systems are factorised, as are those for which CG is too slow, and the following ones;
   others are not; the user's types are respected. */
static PetscErrorCode check_choice(void)
{
  static const struct {
    PetscInt cells, choice;
    const char *more;
    PetscInt least, most; /* iterations */
  } c[] = {{4, 0, "", 1, 1},
           {10, 0, "", 2, 60},
           {10, 0, "-contact_ksp_max_it 3 ", 4, 4},
           {10, 1, "", 1, 1},
           {4, 0, "-pc_type cholesky ", 1, 1},
           {4, 0, "-contact_pc_type bjacobi -contact_ksp_max_it 5000 ", 20, 5000},
           {4, 2, "-contact_ksp_type minres -contact_ksp_norm_type preconditioned ", 2, 60}};

  PetscBool mumps;

  PetscFunctionBeginUser;
  PetscCall(SbHasPackage("mumps", &mumps));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(c); k++) {
    char more[256];
    ContactProblem p;
    SbContactSystem system;
    PetscInt its;

    /* on several ranks PETSc's cholesky requires MUMPS, and an error says so */
    if (test_size > 1 && !mumps && strstr(c[k].more, "cholesky"))
      continue;

    PetscCall(PetscSNPrintf(more, sizeof(more), TIGHT "%s", c[k].more));
    PetscCall(contact_problem_open(c[k].cells, "p1", 0.01, more, &p));
    PetscCall(contact_problem_scale(&p, 1.));
    PetscCall(SbContactSystemCreate(p.scene.model->space, c[k].choice, &system));
    PetscCall(solve(&p, system, c[k].more, &its));
    SB_CHECK(its >= c[k].least && its <= c[k].most, "%d cells, choice %d %s: %d iterations",
             (int)c[k].cells, (int)c[k].choice, c[k].more, (int)its);
    if (strstr(c[k].more, "max_it 3 ")) {
      PetscCall(solve(&p, system, "after CG took too long", &its));
      SB_CHECK(its == 1, "%d iterations after CG took too long", (int)its);
    }
    PetscCall(SbContactSystemDestroy(&system));
    PetscCall(contact_problem_close(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_stiffness(4, "p1", 0.01, 44));
  PetscCall(check_stiffness(8, "p1", 0.01, 44));
  PetscCall(check_stiffness(6, "p1", 1., 50));
  PetscCall(check_stiffness(4, "p2", 0.01, 20));
  PetscCall(check_stiffness(6, "p2", 1., 20));
  PetscCall(check_changes(1));
  PetscCall(check_changes(2));
  PetscCall(check_choice());
  SB_TEST_END();
}
