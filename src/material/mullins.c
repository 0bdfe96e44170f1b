/*
  Softening of rubber by its first stretch (Mullins effect), on any law that splits shape from
  volume, psi = W(F) + K/2 theta^2 (Ogden and Roxburgh 1999; with beta as in Abaqus):

    P = eta dW/dF + K theta D,   eta = 1 - 1/r erf((M - W)/s),   s = m + beta M,

  with D = d theta/dF and M the largest W that the point had. Where W is that or more, eta is 1:
  the law itself. Below it P is the derivative of h(W) + K/2 theta^2, with x = (M - W)/s

    h = W + s/r I(x) - s/r I(M/s),   I(x) = x erf x + (exp(-x^2) - 1)/sqrt(pi),   dh/dW = eta,

  which is 0 at rest. With M constant in a step, and W in place of it where W is more, h has the
  slope 1 from M on, so that an energy exists, with a derivative that is continuous. What is lost
  until M, s/r I(M/s), is lost as M grows, when a step is accepted; unloading and reloading below M
  lose nothing. The tangent, with C of the law and G = dW/dF,

    eta C + (1 - eta) K (D D^T + theta d2 theta/dF2) + eta' G G^T,
    eta' = 2 exp(-x^2)/(sqrt(pi) r s) for W < M, else 0,

  is positive semi-definite where the law's two parts are, as eta' > 0.

  Not handled: a permanent set, and softening that depends on the direction of the stretch.
  src/fem/mullins.c has M of the points of cells.
*/
#include "material_impl.h"

#define SPLIT (2. / 3.) /* SbMaterialType.share of laws that split shape from volume */

static PetscReal scale_of(const struct _p_SbMullins *a, PetscReal most)
{
  return a->m + a->beta * most;
}

/* I(x) */
static PetscReal integral(PetscReal x)
{
  return x * erf(x) + expm1(-x * x) / PetscSqrtReal(PETSC_PI);
}

PetscReal SbMullinsLost(const struct _p_SbMullins *a, PetscReal most)
{
  const PetscReal s = scale_of(a, most);

  return most > 0. ? s / a->r * integral(most / s) : 0.;
}

struct _p_SbMaterial SbMullinsLaw(const struct _p_SbMaterial *m)
{
  struct _p_SbMaterial law = *m->inner;

  law.axes = m->axes;
  law.tangent = m->tangent;
  return law;
}

/* W from psi and theta. */
static void shape_of(const struct _p_SbMaterial *m, const SbPack psi, const SbPack theta, SbPack W)
{
  const PetscReal K = SbMaterialDilatationModulus(m);

  for (int l = 0; l < SB_BATCH; l++)
    W[l] = psi[l] - K / 2. * theta[l] * theta[l];
}

void SbMullinsShape(const struct _p_SbMaterial *m, const SbPack F[9], SbPack W)
{
  const struct _p_SbMaterial law = SbMullinsLaw(m);
  SbPack psi, theta;

  law.ops.energy(&law, F, psi);
  law.ops.dilatation(&law, F, theta);
  shape_of(m, psi, theta, W);
}

/* theta, eta and eta' at F; whether a lane is softened. */
static PetscBool factors(const struct _p_SbMaterial *m, const struct _p_SbMaterial *law,
                         const SbPack F[9], SbPack theta, SbPack eta, SbPack slope)
{
  const struct _p_SbMullins *a = m->mullins;
  PetscBool any = PETSC_FALSE;
  SbPack psi, W;

  law->ops.energy(law, F, psi);
  law->ops.dilatation(law, F, theta);
  shape_of(m, psi, theta, W);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal most = (*m->most)[l];
    const PetscReal s = scale_of(a, most);

    eta[l] = m->factor ? (*m->factor)[l] : 1.;
    slope[l] = 0.;
    if (m->factor) {
      any = PETSC_TRUE;
    } else if (W[l] < most && s > 0.) {
      const PetscReal x = (most - W[l]) / s;

      eta[l] -= erf(x) / a->r;
      slope[l] = 2. * PetscExpReal(-x * x) / (PetscSqrtReal(PETSC_PI) * a->r * s);
      any = PETSC_TRUE;
    }
  }
  return any;
}

void SbMullinsFactor(const struct _p_SbMaterial *m, const SbPack F[9], SbPack eta)
{
  const struct _p_SbMaterial law = SbMullinsLaw(m);
  SbPack theta, slope;

  (void)factors(m, &law, F, theta, eta, slope);
}

static void energy_softened(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi)
{
  const struct _p_SbMaterial law = SbMullinsLaw(m);
  const struct _p_SbMullins *a = m->mullins;
  SbPack theta, W;

  law.ops.energy(&law, F, psi);
  law.ops.dilatation(&law, F, theta);
  shape_of(m, psi, theta, W);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal most = (*m->most)[l];
    const PetscReal s = scale_of(a, most);

    if (W[l] < most && s > 0.)
      psi[l] += s / a->r * integral((most - W[l]) / s);
    psi[l] -= SbMullinsLost(a, most);
  }
}

/* P = eta P + (1 - eta) p D, p = K theta */
SB_KERNEL static void soften_stress(const SbPack eta, const SbPack p, const SbPack D[restrict 9],
                                    SbPack P[restrict 9])
{
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      P[k][l] = eta[l] * P[k][l] + (1. - eta[l]) * p[l] * D[k][l];
}

/* G = P - p D */
SB_KERNEL static void take_pressure(const SbPack p, const SbPack D[restrict 9],
                                    SbPack G[restrict 9])
{
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      G[k][l] -= p[l] * D[k][l];
}

/* C = eta C + (1 - eta) K D D^T + eta' G G^T */
SB_KERNEL static void soften_tangent(const SbPack eta, const SbPack slope, PetscReal K,
                                     const SbPack D[restrict 9], const SbPack G[restrict 9],
                                     SbPack C[restrict 81])
{
  for (int i = 0; i < 9; i++)
    for (int k = 0; k < 9; k++)
      for (int l = 0; l < SB_BATCH; l++)
        C[9 * i + k][l] = eta[l] * C[9 * i + k][l] + (1. - eta[l]) * K * (D[i][l] * D[k][l]) +
                          slope[l] * (G[i][l] * G[k][l]);
}

static void stress_softened(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9])
{
  const struct _p_SbMaterial law = SbMullinsLaw(m);
  const PetscReal K = SbMaterialDilatationModulus(m);
  SbPack theta, eta, slope, p, D[9];

  law.ops.stress(&law, F, P);
  if (!factors(m, &law, F, theta, eta, slope))
    return;
  law.ops.dilatation_gradient(&law, F, D);
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = K * theta[l];
  soften_stress(eta, p, (const SbPack *)D, P);
}

static void tangent_softened(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81])
{
  const struct _p_SbMaterial law = SbMullinsLaw(m);
  const PetscReal K = SbMaterialDilatationModulus(m);
  SbPack theta, eta, slope, D[9], G[9], p;

  law.ops.tangent(&law, F, C);
  if (!factors(m, &law, F, theta, eta, slope))
    return;
  law.ops.dilatation_gradient(&law, F, D);
  law.ops.stress(&law, F, G);
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = K * theta[l];
  take_pressure(p, (const SbPack *)D, G);
  soften_tangent(eta, slope, K, (const SbPack *)D, (const SbPack *)G, C);
  for (int l = 0; l < SB_BATCH; l++)
    p[l] *= 1. - eta[l];
  law.ops.dilatation_hessian(&law, F, p, C);
}

void SbMullinsSoften(struct _p_SbMaterial *m, const struct _p_SbMaterial *law,
                     const struct _p_SbMullins *mullins)
{
  m->inner = law;
  m->mullins = mullins;
  m->most = m->factor = NULL;
  m->ops.energy = energy_softened;
  m->ops.stress = stress_softened;
  m->ops.tangent = tangent_softened;
}

/* options */

/* Laws and other options that softening does not go with. */
static PetscErrorCode check(const SbMaterial m, const SbScope *scope, const char *option)
{
  PetscFunctionBeginUser;
  PetscCheck(m->type->share == SPLIT, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: the law %s does not split the energy of the shape, which softens, from that of "
             "the volume; take one that does for -%s_%s_material (docs/reference/materials.md, "
             "softening), or leave %s out",
             option, m->type->name, scope->klass, scope->instance, option);
  PetscCheck(!m->viscous, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: a viscoelastic material does not soften, as which of its stresses would is not "
             "known; leave prony_times and viscosity out, or mullins_r",
             option);
  PetscCheck(!m->eigen, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: a material that grows, expands or has an active strain does not soften; leave %s "
             "out",
             option, m->eigen->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMullinsRead(SbMaterial m, const SbScope *scope)
{
  static const char *const keys[2] = {"mullins_m", "mullins_beta"};
  struct _p_SbMullins a = {0};
  char option[3 * SB_NAME_MAX], of[2][3 * SB_NAME_MAX];
  SbMullins own;

  PetscFunctionBeginUser;
  SbOptionName(scope, "mullins_r", sizeof(option), option);
  PetscCall(SbOptionReal(scope, "mullins_r", &a.r));
  PetscCall(SbOptionReal(scope, "mullins_m", &a.m));
  PetscCall(SbOptionReal(scope, "mullins_beta", &a.beta));
  for (int k = 0; k < 2; k++) {
    SbOptionName(scope, keys[k], sizeof(of[k]), of[k]);
    PetscCheck((k ? a.beta : a.m) == 0. || a.r != 0., PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s is a constant of softening, which %s above 1 begins: give that, or leave %s out",
               of[k], option, of[k]);
  }
  if (a.r == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(a.r > 1. && !PetscIsInfOrNanReal(a.r), PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %g: it must be in (1, inf), without unit: softening takes at most 1/r of the "
             "stress; 0: none",
             option, (double)a.r);
  PetscCheck(a.m > 0. || a.beta > 0., PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s 0 and %s 0: one of them must be positive, m in [0, inf) J/m^3 and beta in [0, "
             "inf): softening spreads over energies of m + beta W_max",
             of[0], of[1]);
  PetscCall(check(m, scope, option));
  PetscCall(PetscNew(&own));
  *own = a;
  m->mullins = own;
  PetscFunctionReturn(PETSC_SUCCESS);
}
