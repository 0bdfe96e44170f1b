/*
  States in which energies are finite: det F > 0 at the points of laws with the flag `positive`, and
  below the limit of stretch of those that are `limited`, which only the search of a step heeds.

  Along a step from x by -s y, F - s H is linear in s, and det (F - s H) = J0 - s J1 + s^2 J2 - s^3
  J3 with J1 = cof F : H, J2 = F : cof H, J3 = det H. A step ends at the latest where this falls to
  the fraction LEFT of J0 (the rule of interior-point methods, a fraction of the way to the
  boundary; the same cubic for a tet of constant gradient: Smith and Schaefer 2015).
*/
#include "fem_impl.h"
#include "sbgeometry.h"

/* Fraction of det F that one Newton step may leave. Iterations of the squeezes in
   tests/verify/verify_neohookean.c: 391 with 0.02, 338 with 0.1, 339 with 0.3. */
#define LEFT 0.1
#define FLATTEST \
  1e-6 /* least det F that a step may lead to: stiffness there is up to 1e12 times that at rest, more
          than a factorisation bears */
#define BISECTIONS 40 /* of an interval with one root: to 1e-12 of the step */

/* The least s in [0, 1] with a + b s + c s^2 + d s^3 = 0, for a > 0; 1 if there is none. For a <= 0
   about 0 where the cubic is not positive at the end of its first monotone interval. */
static PetscReal first_root(PetscReal a, PetscReal b, PetscReal c, PetscReal d)
{
  PetscReal end[4] = {0., 1., 1., 1.};
  int n = 1;

  /* the intervals between extremes, b + 2 c s + 3 d s^2 = 0, in which the cubic is monotone */
  const PetscReal root = c * c - 3. * b * d;

  if (root > 0.) {
    const PetscReal q = -(c + (c < 0. ? -1. : 1.) * PetscSqrtReal(root));
    const PetscReal first = d != 0. ? q / (3. * d) : -1.;
    const PetscReal second = q != 0. ? b / q : -1.;
    const PetscReal extreme[2] = {PetscMin(first, second), PetscMax(first, second)};

    for (int k = 0; k < 2; k++)
      if (extreme[k] > 0. && extreme[k] < 1.)
        end[n++] = extreme[k];
  }
  end[n] = 1.;
  for (int k = 1; k <= n; k++) {
    PetscReal low = end[k - 1];
    PetscReal high = end[k];

    if (a + high * (b + high * (c + high * d)) > 0.)
      continue;
    for (int i = 0; i < BISECTIONS; i++) {
      const PetscReal middle = 0.5 * (low + high);

      if (a + middle * (b + middle * (c + middle * d)) > 0.)
        low = middle;
      else
        high = middle;
    }
    return low;
  }
  return 1.;
}

PetscErrorCode SbSpaceLongestStep(SbSpace s, Vec X, Vec Y, PetscReal scale, PetscReal *part)
{
  const PetscReal *x, *y;

  PetscFunctionBeginUser;
  *part = 1.;
  if (!s->positive)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalRead(s, X, &x));
  PetscCall(SbSpaceGetLocalRead(s, Y, &y));
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const int npoint = SbBatchPoints(s, b).n;
    SbPack U[30], F[SB_POINTS][9], H[SB_POINTS][9];

    if (!s->batch_region[b]->material->positive)
      continue;
    SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
    SbBatchGradients(s, b, y, PETSC_TRUE, U, H);
    for (int q = 0; q < npoint; q++) {
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        PetscReal f[9], h[9], c[9];

        SbPackGet(9, (const SbPack *)F[q], l, f);
        SbPackGet(9, (const SbPack *)H[q], l, h);
        for (int k = 0; k < 9; k++)
          h[k] *= scale;
        SbMatCofactor(f, c);
        const PetscReal J0 = SbDot3(f, c);
        const PetscReal J1 = SbDot9(c, h);
        SbMatCofactor(h, c);
        const PetscReal J2 = SbDot9(f, c);
        const PetscReal J3 = SbDot3(h, c);

        /* a start that is not admissible limits nothing: its energy is infinite */
        if (J0 > 0. && !PetscIsInfOrNanReal(J0 + J1 + J2 + J3))
          *part = PetscMin(*part, first_root(J0 - PetscMax(LEFT * J0, FLATTEST), -J1, J2, -J3));
      }
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(s, Y, &y));
  PetscCall(SbSpaceRestoreLocalRead(s, X, &x));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, part, 1, MPIU_REAL, MPI_MIN, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The owned tet with the least det F <= 0 or, with the key 0, beyond the limit of its law; cell -1:
   none. */
typedef struct {
  PetscReal key, J;
  PetscInt cell;
} Worst;

static Worst find_worst(SbSpace s, const PetscReal x[])
{
  Worst worst = {PETSC_MAX_REAL, 1., -1};

  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    struct _p_SbMaterial own;
    const struct _p_SbMaterial *law =
      SbBatchLaw(s->batch_region[b], s->batch_region[b]->material, b, &own);
    const int npoint = SbBatchPoints(s, b).n;
    SbPack U[30], F[SB_POINTS][9], psi;

    if (!law->positive)
      continue;
    SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
    for (int q = 0; q < npoint; q++) {
      SbPointLaw(s->batch_region[b], b, q, &own);
      if (law->type->limited)
        law->ops.energy(law, (const SbPack *)F[q], psi);
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        PetscReal f[9];

        SbPackGet(9, (const SbPack *)F[q], l, f);
        const PetscReal J = SbMatDet(f);
        const PetscReal key = J > 0. && law->type->limited && PetscIsInfReal(psi[l]) ? 0. : J;
        if (key <= 0. && key < worst.key)
          worst = (Worst){key, J, s->batch_cell[b] + l};
      }
    }
  }
  return worst;
}

PetscErrorCode SbSpaceDescribeInverted(SbSpace s, Vec U, size_t size, char text[])
{
  const PetscReal *x;
  struct {
    PetscReal J;
    int rank;
  } least;
  Worst worst;

  PetscFunctionBeginUser;
  text[0] = 0;
  if (!s->positive)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalRead(s, U, &x));
  worst = find_worst(s, x);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &x));
  least.J = worst.key;
  least.rank = s->rank;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPI_DOUBLE_INT, MPI_MINLOC, s->comm));
  if (least.J > 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (s->rank == least.rank) {
    const SbMesh mesh = s->mesh;
    const PetscInt *v = mesh->cell + 4 * worst.cell;
    PetscReal p[3];

    for (int k = 0; k < 3; k++)
      p[k] = (mesh->x[3 * v[0] + k] + mesh->x[3 * v[1] + k] + mesh->x[3 * v[2] + k] +
              mesh->x[3 * v[3] + k]) /
             4.;
    SbFormat(size, text,
             "tet %" PetscInt_FMT " of the body %s, at rest around (%.4g, %.4g, %.4g) m, ",
             mesh->cell_orig[worst.cell], mesh->body[mesh->cell_body[worst.cell]].name,
             (double)p[0], (double)p[1], (double)p[2]);
    if (worst.J > 0.)
      SbAppend(
        size, text,
        "is stretched beyond the limit of the law %s, where its energy is infinite; one with "
        "a higher limit, or another law, is finite there",
        s->material[mesh->cell_material[worst.cell]]->type->name);
    else if (!s->material[mesh->cell_material[worst.cell]]->type->positive)
      SbAppend(size, text,
               "is inverted or flat (det F %.3g), where a viscoelastic body has no stress",
               (double)least.J);
    else
      SbAppend(size, text,
               "is inverted or flat (det F %.3g), where the energy of the law %s is infinite; the "
               "law stable_neohookean is finite there",
               (double)least.J, s->material[mesh->cell_material[worst.cell]]->type->name);
  }
  PetscCallMPI(MPI_Bcast(text, (PetscMPIInt)size, MPI_CHAR, least.rank, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
