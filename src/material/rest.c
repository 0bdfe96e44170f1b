/*
  The stiffness of a material at rest, where every law is Hooke's: Young's modulus E and Poisson's
  ratio nu, Lame's parameters lambda and mu, and what follows from them. Apart from material.c,
  which knows the laws, so that a law may set it.
*/
#include "material_impl.h"

void SbMaterialSetLame(SbMaterial m, PetscReal lambda, PetscReal mu)
{
  m->rest->lambda = lambda;
  m->rest->mu = mu;
  m->rest->E = mu * (3 * lambda + 2 * mu) / (lambda + mu);
  m->rest->nu = lambda / (2 * (lambda + mu));
}

PetscReal SbMaterialYoungModulus(const struct _p_SbMaterial *m)
{
  return m->rest->E;
}

PetscReal SbMaterialPoisson(const struct _p_SbMaterial *m)
{
  return m->rest->nu;
}

PetscReal SbMaterialShearModulus(const struct _p_SbMaterial *m)
{
  return m->rest->mu;
}

PetscReal SbMaterialVolumetricModulus(const struct _p_SbMaterial *m)
{
  return m->rest->lambda;
}

PetscReal SbMaterialMeanModulus(const struct _p_SbMaterial *m)
{
  return PetscMax(0., m->rest->lambda - SB_POINT_MODULUS * m->rest->mu);
}

PetscReal SbMaterialBulkModulus(const struct _p_SbMaterial *m)
{
  return m->rest->lambda + 2. * m->rest->mu / 3.;
}

PetscReal SbMaterialWaveModulus(const struct _p_SbMaterial *m)
{
  return m->rest->lambda + 2. * m->rest->mu;
}

PetscReal SbMaterialDilatationModulus(const struct _p_SbMaterial *m)
{
  return m->rest->lambda + m->type->share * m->rest->mu;
}
