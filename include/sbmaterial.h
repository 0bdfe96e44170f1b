/*
  sbmaterial.h - layer 2: material laws on batches of deformation gradients.

  A batch holds SB_BATCH tets side by side (sbkernel.h): every quantity is an array over lanes, so
  the compiler vectorises each loop, and a lane's result does not depend on the other lanes. Laws
  know neither meshes nor elements. Sign and frame: F = dx/dX, P = dPsi/dF first Piola-Kirchhoff
  stress (Pa), row = current, column = reference; F[3*i+j] is F_ij. Inputs and outputs of a kernel
  never overlap. A lane whose F is not finite gives results that are not finite.
*/
#pragma once
#include "sbbase.h"
#include "sbkernel.h"

typedef struct _p_SbMaterial *SbMaterial;
typedef struct _p_SbFibres *SbFibres;   /* directions of the axes of a law with fibres */
typedef struct _p_SbViscous *SbViscous; /* of a viscoelastic material */
typedef struct _p_SbActive *SbActive;   /* of fibres that contract */
typedef struct _p_SbMullins *SbMullins; /* of a material that softens by its first stretch */
typedef struct _p_SbEigenstrain *SbEigenstrain; /* of bodies that grow or expand */

/* polar.c, spectral.c: 3x3 matrices of a batch */

/* The proper rotation R next to F: det R = +1, the maximiser of R : F, for every F; R^T F is
   symmetric. Where the maximiser is not unique (rank one, F = 0, reflections with equal stretches)
   some maximiser is returned, I for F = 0. A lane that is not finite gives NaN. Error of R about 5
   eps |F| / (s2 + s3), s2 + s3 being the sum of the two smaller signed stretches: that is rounding
   of F seen through the condition number of the problem. A lane's result does not depend on the
   others. Not collective. */
void SbPolar(const SbPack F[9], SbPack R[9]);

/* F = U diag(s) V^T with rotations U and V; s[k] in no order, det F = s0 s1 s2 with its sign. */
void SbStretches(const SbPack F[9], SbPack U[9], SbPack s[3], SbPack V[9]);

/* Eigenvalues s[3] and eigenvectors V (columns, det V = +1) of symmetric S[6] = 00 01 02 11 12 22,
   right to rounding of the largest entry; no order among the eigenvalues. With R from SbPolar() and
   S = R^T F this is the singular value decomposition F = (R V) diag(s) V^T with two rotations, the
   sign of det F being in s. Not collective. */
void SbSymEig(const SbPack S[6], SbPack s[3], SbPack V[9]);

/* laws */

/*
  Part of the volumetric modulus, in shear moduli, that a P2 cell has at its points; the rest acts
  on the mean of the cell. All by the mean is too soft (0), and more at the points too stiff. Strain
  energy of a bar in bending against that of a fine mesh, linear law (co-rotated alike):

                                  nu      0      0.25    0.5    1
    one cell across               0.3     7.6    3.7     0.8   -3.2 %
                                  0.4999 12.6    8.6     5.6    1.5
    two                           0.3     1.85   1.07    0.43  -0.56
                                  0.4999  1.9    1.2     0.6   -0.3
    without structure, 0.1 m      0.3     2.4    1.0    -0.1   -1.8
                                  0.4999  1.2    0.2    -0.6   -1.9
    the same, 0.05 m              0.3     0.9    0.4     0.0   -0.6
                                  0.4999 -0.3   -0.7    -1.0   -1.5
*/
#define SB_POINT_MODULUS 0.5

/* Tangents of a law. A law without a warped one refuses it. */
typedef enum {
  SB_TANGENT_WARPED, /* Hooke's tensor turned by R: symmetric, positive definite, leaves out dR/dF */
  SB_TANGENT_EXACT,  /* dP/dF: Newton converges quadratically; indefinite in compression */
  SB_TANGENT_EXACT_SPD /* dP/dF with its negative eigenvalues raised to zero */
} SbTangentKind;

/*
  Operations of a law on a batch; of NULL ones see there. psi is split into what changes shape and
  what changes volume,

    psi = psi_mu(F) + lambda/2 theta(F)^2,

  theta the law's measure of the change of volume, its dilatation: tr(eps) (linear), tr(S - I)
  (corotated), tr(E) (stvk), ln J (neohookean), the root of (J^2 - 1 - 2 ln J) / 2
  (isochoric_neohookean), J - 1 (stable_neohookean), by option (rubber); lambda Lame's first at rest
  (SbMaterialVolumetricModulus()). psi_mu does not depend on lambda: it is the law with lambda = 0.
*/
typedef struct {
  /* reads the options of the law's rows into m->data, and may replace the stiffness at rest, which
     is that of young and poisson, by SbMaterialSetLame(). NULL: the law has none, but `tangent`,
     which is read for it. */
  PetscErrorCode (*setfromoptions)(SbMaterial m, const SbScope *scope);
  /* psi = energy per rest volume, J/m^3; zero at rest */
  void (*energy)(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi);
  /* P = dPsi/dF, Pa */
  void (*stress)(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9]);
  /* C[9*(3*i+j) + 3*k+l] = dP_ij/dF_kl, Pa; symmetric in the pairs to the last bit. With
     SB_TANGENT_EXACT_SPD its negative eigenvalues are raised to zero. */
  void (*tangent)(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81]);
  /* The tangent is the isotropic Hooke tensor of lambda and mu, turned by R: fills R. NULL when the
     law needs the full tangent. Co-rotated has it with the warped tangent, linear always (R =
     I). */
  void (*frame)(const struct _p_SbMaterial *m, const SbPack F[9], SbPack R[9]);
  /* The tangent is dP = 2 mu dF + lambda (R : dF) R + R [W y]x with y = axial(R^T dF - dF^T R), as
     for a law of R^T F: fills R and the symmetric W (Pa), for SbCellBlocksCorotated(), which is
     cheaper than the full tangent. W = -mu I is Hooke's tensor turned by R. p: a pressure (Pa,
     tension) in addition to the law's own, or NULL. NULL when the law is not of this kind.
     Co-rotated has it with its exact tangents; with the warped one `frame` takes its place. */
  void (*spin)(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack p, SbPack R[9],
               SbPack W[9]);
  /* theta, without unit; zero at rest, positive in expansion */
  void (*dilatation)(const struct _p_SbMaterial *m, const SbPack F[9], SbPack theta);
  /* D = d theta/dF: the tangent holds lambda D D^T, and nothing else of it grows with lambda but
     the stress. At rest D = I. With a frame or a spin D is their R. */
  void (*dilatation_gradient)(const struct _p_SbMaterial *m, const SbPack F[9], SbPack D[9]);
  /* C += p d^2 theta/dF^2 (C as in tangent), for the derivative of a pressure p (Pa, tension) that
     does not come from F alone; with the filtered tangent only where that is not negative. NULL: it
     vanishes, or it is in W of spin, which takes such a pressure. */
  void (*dilatation_hessian)(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack p,
                             SbPack C[81]);
} SbMaterialOps;

/*
  A law. Its option rows are for bodies and inclusions, each with a default. Every law but a linear
  one has the option `tangent`, with `warped` as its first choice after `auto` if it has a spin.

    linear   - stress is linear in F: K is constant, and the law has a frame
    softens  - stress has a maximum in compression, beyond which cells invert
    jacobian - theta is J - 1, cubic in the displacement; the mean over a P2 cell is exact. Of other
               laws theta is at most quadratic, that of a spin, or no polynomial, with the mean of
               the points of the law
    positive - psi is infinite where det F <= 0, and stress and tangent are no numbers there
    own_moduli - `setfromoptions` sets the stiffness at rest by SbMaterialSetLame(): young is not
               read, and poisson only by it
    limited  - psi is also infinite beyond a limit of stretch, and stress and tangent are no numbers
    fibres   - the law depends on directions in the rest state, SbMaterial.axes; Hooke's law at rest
               has the mean of its shear moduli over all directions
    share    - psi_mu has the part share mu/2 theta^2; 2/3: psi is K/2 theta^2 and an energy of the
               shape alone
*/
typedef struct {
  const char *name;
  size_t size; /* bytes of `data`, zero at first */
  PetscInt nrow;
  const SbOption *row; /* [nrow] */
  PetscBool linear, softens, jacobian, positive, own_moduli, limited, fibres;
  PetscReal share;
  SbMaterialOps ops;
} SbMaterialType;

struct _p_SbMaterial {
  const SbMaterialType *type;
  char name[SB_NAME_MAX]; /* of the body or inclusion */
  PetscLogEvent
    event; /* SbMat_<law>, around the loops over its cells for forces and assembled tangents */
  SbMaterialOps ops; /* of the type; frame only with the warped tangent */
  PetscBool linear, softens, jacobian, positive; /* of the type */
  struct _p_SbElastic *rest; /* stiffness at rest: SbMaterialShearModulus() and others; owned */
  PetscReal density;         /* kg/m^3 */
  PetscBool
    adaptive; /* -body_NAME_tangent auto: the solver of a step chooses between the two exact ones */
  SbTangentKind tangent; /* tangent of ops.frame or ops.tangent */
  SbMaterial shear;      /* SbMaterialGetShear(); NULL until it is asked for; owned */
  SbMaterial point;      /* SbMaterialGetPointwise(), likewise */
  SbMaterial stiffest;   /* SbMaterialGetStiffest(), likewise */
  void *data;            /* the law's own constants; freed with the material */
  SbFibres fibres;       /* of a law with fibres, or that needs them here, else NULL; owned */
  SbViscous viscous;     /* of a viscoelastic material, else NULL; owned */
  SbActive active;       /* of fibres that contract, else NULL; owned */
  SbEigenstrain eigen;   /* of strains without stress, else NULL; owned */
  const struct _p_SbMullins *mullins; /* of one that softens, else NULL; owned */
  /* [9] of such a law: Q of a batch, its columns the fibre, the sheet and their normal in the rest
     state, orthonormal; NULL: I. Set by the caller in a copy of this struct. */
  const SbPack *axes;
  /* of a copy by SbEigenLaw() or SbMullinsSoften(), else NULL: the law, borrowed; of a batch at a
     point, along and across the fibres the inverse of the stretch without stress, and the root of
     J_g, [3]; how far those of the next point are; or the largest energy of the shape that a point
     had, J/m^3, and NULL or the factor that its stress keeps */
  const struct _p_SbMaterial *inner;
  const SbPack *stretch, *most, *factor;
  int stretch_step;
};

/* Where the axes of a law with fibres come from: formulas of the place; fields of the mesh file; or
   the rule of src/fem/fibre_rule.c, from surfaces. */
#define SB_FIBRE_SURFACES 5
struct _p_SbFibres {
  char option[2][3 * SB_NAME_MAX]; /* names of the options of fibre and sheet, */
  SbFormula direction[6];          /* which they have; no sheet: NULL */
  char field[2][SB_NAME_MAX];      /* arrays in the mesh file; "": none */
  /* outer, inner, base, apex, inner of the right ventricle or ""; the first one "": no rule */
  char surface[SB_FIBRE_SURFACES][SB_NAME_MAX];
  PetscReal angle[4]; /* rad, alpha inside and outside, beta inside and outside */
};

/* Constants of softening (src/material/mullins.c). */
struct _p_SbMullins {
  PetscReal r;       /* above 1 */
  PetscReal m, beta; /* J/m^3, and without unit */
};

/* A tension along the fibres (src/material/active.c). */
typedef enum {
  SB_LENGTH_NONE,
  SB_LENGTH_PARABOLA,
  SB_LENGTH_GAUSSIAN
} SbLengthRelation;
struct _p_SbActive {
  char option[3 * SB_NAME_MAX]; /* name of its option, */
  SbFormula tension;            /* which it has, Pa */
  PetscBool steady;             /* not a formula of t */
  SbLengthRelation length;      /* of force and length, */
  PetscReal optimum, width;     /* the stretch of the largest force, and a measure of its range */
  PetscReal velocity; /* of shortening without force, 1/s; 0: force does not depend on it */
  PetscReal curvature, eccentric; /* of Hill's hyperbola; largest force in lengthening */
};
/* Strains without stress (src/material/eigenstrain.c). */
typedef enum {
  SB_EIGEN_ACTIVE, /* at constant volume */
  SB_EIGEN_PRESTRAIN,
  SB_EIGEN_GROWTH, /* of any volume */
  SB_EIGEN_FIBRE,
  SB_EIGEN_PLANE,
  SB_EIGEN_TEMPERATURE,
  SB_EIGEN_TERMS
} SbEigenTerm;
struct _p_SbEigenstrain {
  char option[SB_EIGEN_TERMS][3 * SB_NAME_MAX]; /* names of their options, */
  SbFormula formula[SB_EIGEN_TERMS];            /* which they have; NULL: none */
  PetscBool steady[SB_EIGEN_TERMS];             /* not a formula of t */
  char name[3 * SB_NAME_MAX];                   /* the first of these options, for messages */
  PetscReal expansion;                          /* 1/K */
  char field[SB_NAME_MAX]; /* array in the mesh file whose numbers times the formula are the
                              temperature of tets; "": none */
  PetscBool isochoric;     /* they keep the volume, by which the law measures it */
  PetscBool grows;         /* not an active strain only */
  PetscBool changes;       /* some depend on t */
  PetscBool varies; /* some depend on the place, but for an active strain, which is of a cell */
};
/* At a point: 1/l and 1/m of the stretches l along the fibres and m across, the root of J_g (1 of
   the law linear); ln l and ln m; ln(1 + a) of the active strain. */
typedef struct {
  PetscReal along, across, root, log[2], active;
} SbEigenstretch;
/* At a point in a step: the stretch of the fibres at its start, that expected at the time of the
   evaluation, and v = v + slope (stretch - start), rates over the velocity. */
typedef struct {
  SbPack start, expected, v;
  PetscReal slope; /* 0: the rate is known */
} SbFibreRate;

/* A Prony series and a viscosity, with the state that follows from the time since the last step
   (src/material/viscous.c). The law of the material is the instantaneous one. */
#define SB_PRONY_TERMS 16
struct _p_SbViscous {
  PetscInt n;                                            /* terms of the series */
  PetscReal time[SB_PRONY_TERMS];                        /* tau_i, s */
  PetscReal shear[SB_PRONY_TERMS], bulk[SB_PRONY_TERMS]; /* g_i, k_i: fractions of G and K */
  PetscReal viscosity[2];                                /* of shear and volume, Pa s */

  /* the law of a step: `scale` times that of `step`, plus what is constant in it */
  PetscReal elapsed; /* time since the end of the last step, s; inf: relaxed, without a history */
  PetscReal decay[SB_PRONY_TERMS], mean[SB_PRONY_TERMS]; /* exp(-x), b(x), x = elapsed / tau_i */
  PetscReal scale, relaxed_scale;
  SbMaterial step, relaxed; /* the law with other lambda; relaxed: that for inf; owned */

  /* since the start of the run, of all cells with this material, J */
  PetscReal stored[SB_PRONY_TERMS]; /* energy in the branches of the series */
};

/* Names of all laws, "linear|corotated|...": the range of the option `material`. */
extern char SbMaterialNames[];
/* Adds a law, which must live as long as the program, and its option rows (classes "body" and
   "inclusion", type = law). Not collective, same on all ranks. */
PetscErrorCode SbMaterialRegister(const SbMaterialType *type);
/* The laws of src/material, and the rows young, poisson, density that every body has. */
PetscErrorCode SbMaterialRegisterAll(void);
/* Names of all laws, in the order of their registration; their number. Not collective. */
#define SB_MATERIAL_TYPES 32
PetscInt SbMaterialTypes(const char *names[SB_MATERIAL_TYPES]);
/* The law of a name; NULL if there is none. Not collective. */
const SbMaterialType *SbMaterialFind(const char *law);
/* Creates the law by name and reads young, poisson, density, the law's options and its tangent.
   body: the scope of a body or inclusion (its `type` is not examined). The material is owned by the
   caller. Errors: PETSC_ERR_USER for an unknown law and for what the option readers refuse. Not
   collective, same on all ranks. */
PetscErrorCode SbMaterialCreate(const char *law, const SbScope *body, SbMaterial *m);
/* The same from numbers: E > 0 in Pa, nu in (-1, 0.5), density > 0 in kg/m^3; the law's options at
   their defaults, its first tangent: the warped one of a law with a spin, else the exact one.
   Errors: PETSC_ERR_USER for an unknown law and for one with own_moduli. */
PetscErrorCode SbMaterialCreateElastic(const char *law, PetscReal E, PetscReal nu,
                                       PetscReal density, SbMaterial *m);
/* The law that keeps a rigid body rigid, stvk with nu = 0, its density from the options; its
   modulus is set once the scene is known. Owned by the caller. Not collective. */
PetscErrorCode SbMaterialCreateRigid(const SbScope *body, SbMaterial *m);
/* For `setfromoptions`, and of rigid bodies: the stiffness at rest by Lame's parameters, mu > 0 and
   lambda > -2/3 mu, Pa. Not collective. */
void SbMaterialSetLame(SbMaterial m, PetscReal lambda, PetscReal mu);
/* Chooses the tangent. Error: PETSC_ERR_USER when the law does not have it. */
PetscErrorCode SbMaterialSetTangent(SbMaterial m, SbTangentKind kind);
/* The same law without its volumetric part, psi_mu (SbMaterialOps): lambda = 0. Its tangent follows
   that of m, which owns it. Not collective. */
PetscErrorCode SbMaterialGetShear(SbMaterial m, SbMaterial *shear);
/* The law at the points of a P2 cell, whose volumetric part goes by the mean of the cell but for
   the modulus min(lambda, SB_POINT_MODULUS mu): m with that lambda. What is left is
   SbMaterialMeanModulus(); m itself where that is zero. Otherwise as SbMaterialGetShear(). */
PetscErrorCode SbMaterialGetPointwise(SbMaterial m, SbMaterial *point);
/* A law whose Hooke's tensor at rest is nowhere less stiff than m with all its fibres in tension: m
   itself without fibres. Otherwise as SbMaterialGetShear(). */
PetscErrorCode SbMaterialGetStiffest(SbMaterial m, SbMaterial *stiffest);
PetscErrorCode SbMaterialDestroy(SbMaterial *m);
/* The law of a viscoelastic material after this time since the last step, s, inf: relaxed; sets
   m->viscous->scale, ->step and the factors of the history. Not collective. */
void SbViscousSetElapsed(SbMaterial m, PetscReal elapsed);
/* The tension of the fibres at a time, s, or load factor, at a place x, m, at rest; Pa. Errors:
   PETSC_ERR_USER_INPUT with option, value, time and place where it is negative or no number. Not
   collective. */
PetscErrorCode SbActiveTension(const struct _p_SbActive *active, PetscReal t, const PetscReal x[3],
                               PetscReal *tension);
/* What they are evaluated at: time, s, or load factor; factor on those that do not depend on t;
   centre of the tet and place of the point at rest, m; the tet's number from the field, or 1. */
typedef struct {
  PetscReal t, load, centre[3], x[3], field;
} SbEigenPlace;
/* The strains without stress there. Errors: PETSC_ERR_USER_INPUT with option, value, time and place
   where a strain is not above -1. Not collective. */
PetscErrorCode SbEigenstrainAt(const struct _p_SbMaterial *m, const SbEigenPlace *place,
                               SbEigenstretch *stretch);
/* Makes m, a copy of `law` with its axes, the law of the elastic part of F; the caller sets
   `stretch`. isochoric: the law's dilatation stays. step: from the stretches of a point to those of
   the next one, 0: all have the same. Not collective. */
void SbEigenLaw(struct _p_SbMaterial *m, const struct _p_SbMaterial *law, PetscBool isochoric,
                int step);
/* Such a law at point q: `own`, a copy of it, or m itself. */
SB_INLINE const struct _p_SbMaterial *SbLawAt(const struct _p_SbMaterial *m, int q,
                                              struct _p_SbMaterial *own)
{
  if (!m->stretch_step || !q)
    return m;
  *own = *m;
  own->stretch += (size_t)q * (size_t)m->stretch_step;
  return own;
}
/* Of such a law the derivatives of psi by ln l and ln m, J/m^3, with that of the mean of a P2 cell
   under its pressure p, Pa, tension. */
void SbEigenForce(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack p,
                  SbPack force[2]);
/* Makes m, a copy of `law` with its axes, that law softened; the caller sets `most` and `factor`.
   Not collective. */
void SbMullinsSoften(struct _p_SbMaterial *m, const struct _p_SbMaterial *law,
                     const struct _p_SbMullins *mullins);
/* Such a law without softening, with its axes and tangent. */
struct _p_SbMaterial SbMullinsLaw(const struct _p_SbMaterial *m);
/* Of such a law the energy of the shape without softening, J/m^3; and the factor of softening on
   its stress. Not collective. */
void SbMullinsShape(const struct _p_SbMaterial *m, const SbPack F[9], SbPack W);
void SbMullinsFactor(const struct _p_SbMaterial *m, const SbPack F[9], SbPack eta);
/* Energy that is lost until the largest one of the shape is `most`, J/m^3. Not collective. */
PetscReal SbMullinsLost(const struct _p_SbMullins *mullins, PetscReal most);
/* At the strain E = (l^2 - 1)/2 of fibres: their energy phi over the tension, the factor G of the
   stress, and c = l dG/dl. rate: NULL without a velocity. Not collective. */
void SbActiveFactors(const struct _p_SbActive *active, const SbPack E, const SbFibreRate *rate,
                     SbPack phi, SbPack G, SbPack c);
/* The axes of a law with fibres at a place x, m, at rest: Q[9], orthonormal, its columns the fibre,
   the sheet and their normal. given[6]: fibre and sheet by fields or by the rule, or NULL. Errors:
   PETSC_ERR_USER_INPUT with option and place where a direction is zero, or the sheet is along the
   fibre. Not collective. */
PetscErrorCode SbMaterialAxes(SbMaterial m, const PetscReal x[3], const PetscReal given[6],
                              PetscReal Q[9]);

/*
  Stiffness at rest, where every law is Hooke's; Pa, Poisson's ratio without unit. Young's modulus
  and Poisson's ratio are those of the options, bit by bit. Not collective.
*/
PetscReal SbMaterialYoungModulus(const struct _p_SbMaterial *m);
PetscReal SbMaterialPoisson(const struct _p_SbMaterial *m);
/* mu = E / (2 (1 + nu)) */
PetscReal SbMaterialShearModulus(const struct _p_SbMaterial *m);
/* lambda = E nu / ((1 + nu) (1 - 2 nu)): factor of the volumetric energy (SbMaterialOps), also away
   from rest; exactly 0 for nu = 0 and for SbMaterialGetShear(), negative for nu < 0 */
PetscReal SbMaterialVolumetricModulus(const struct _p_SbMaterial *m);
/* Of that, what acts on the mean of theta in a P2 cell: lambda - min(lambda, SB_POINT_MODULUS
   mu) */
PetscReal SbMaterialMeanModulus(const struct _p_SbMaterial *m);
/* K = lambda + 2/3 mu, of compression */
PetscReal SbMaterialBulkModulus(const struct _p_SbMaterial *m);
/* lambda + 2 mu: of the fastest wave, rho c^2, and the stiffest for one length */
PetscReal SbMaterialWaveModulus(const struct _p_SbMaterial *m);

/* lambda + share mu: factor of theta^2/2 in psi */
PetscReal SbMaterialDilatationModulus(const struct _p_SbMaterial *m);

/*
  SbMaterialFindUnstable - the first stretch from rest at which a law is unstable (Drucker).

  Not collective. The material is incompressible: a stretch l, the other ones as the mode says, and
  the pressure that keeps a free side without stress. Stable: with small changes of the logarithmic
  strains the stresses do work, for all of constant volume.

  Input:
    mode    - 0: uniaxial, l, l^(-1/2), l^(-1/2); 1: equibiaxial, l, l, l^(-2); 2: planar, l, 1, 1/l
    tension - l from 1 to 3, else from 1 to 0.3
  Output:
    stretch - 0 where there is none; also ends at a limit of stretch (`limited`)
*/
void SbMaterialFindUnstable(const struct _p_SbMaterial *m, int mode, PetscBool tension,
                            PetscReal *stretch);

/* p = -lambda theta, Pa, positive in compression: resists the change of volume, and oscillates from
   cell to cell where an element locks. Not collective. */
void SbMaterialPressure(const struct _p_SbMaterial *m, const SbPack F[9], SbPack p);
/* C += p d(cof F)/dF, C as in SbMaterialOps.tangent. Not collective. */
void SbAddCofactorTangent(const SbPack F[9], const SbPack p, SbPack C[81]);
/* The rotation in F; I for the linear law. Not collective. */
SB_INLINE void SbMaterialRotation(const struct _p_SbMaterial *m, const SbPack F[9], SbPack R[9])
{
  if (m->linear)
    m->ops.frame(m, F, R);
  else
    SbPolar(F, R);
}
/* dP = R hooke(sym(R^T H)) = mu (H + R H^T R) + lambda (R : H) R, Pa/s, with R the rotation in F
   and H the gradient of the velocity, 1/s: the stress of stiffness-proportional damping, per second
   of beta; R = I for the linear law. One rule for every other law and every tangent: it never feeds
   energy in (H : dP >= 0), and where the cell is unstrained (F = R) it is the law's tangent and
   vanishes for a spin. In a strained cell a spin is damped in proportion to the strain. Not
   collective. */
void SbMaterialDampingStress(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack H[9],
                             SbPack dP[9]);
