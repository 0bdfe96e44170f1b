/*
  sbmodel.h - layer 8: composition of a scene, evaluation of its forces and tangent, energies and
  momenta.
*/
#pragma once
#include "sbcontact.h"

/* Scalars of one instant, summed over all ranks. SI. */
typedef struct {
  PetscReal kinetic; /* 1/2 v.M v, J */
  PetscReal strain;  /* J; of viscoelastic bodies that of the relaxed law and of the branches */
  PetscReal
    load_work; /* by loads since the start (constant: minus the change of their potential), J */
  PetscReal prescribed_work; /* work done by moving supports since the start, J */
  PetscReal active_work;     /* by fibres that contract since the start, J */
  PetscReal growth_work;     /* by growth, expansion and changes of prestrain since the start, J */
  PetscReal damping_loss;    /* dissipated by Rayleigh damping since the start, J */
  PetscReal relaxation_loss; /* dissipated by Prony series of materials since the start, J */
  PetscReal viscosity_loss;  /* by viscosities of materials, J */
  PetscReal mullins_loss;    /* by softening of materials, J */
  PetscReal remesh_loss;     /* energy lost by re-meshing since the start, J */
  PetscReal remesh_mass; /* change by re-meshings since the start, each as its absolute value, kg */
  PetscReal remesh_momentum; /* likewise of the momentum, kg m/s */
  PetscReal
    integrator_loss; /* dissipated by the integrator: start + works - the other losses - now, J */
  PetscReal momentum[3];      /* kg m/s */
  PetscReal angular[3];       /* about the origin, kg m^2/s */
  PetscReal centre[3];        /* centre of mass, m */
  PetscReal volume;           /* current volume, m^3 */
  PetscReal min_J;            /* smallest det F */
  PetscReal max_speed;        /* largest nodal speed, m/s */
  PetscReal max_displacement; /* m */
  PetscInt ninverted;         /* cells with det F <= 0 */
} SbEnergies;

/* Initial state of a body. */
typedef struct {
  /* m, m/s, functions of the reference position; owned. NULL: constants, in SbBody */
  SbFormula displacement[3], velocity[3];
  PetscBool moved;                /* displacements are given */
  char state[PETSC_MAX_PATH_LEN]; /* run that the initial state is taken from; "": none */
} SbStart;

typedef struct _p_SbModel *SbModel;
struct _p_SbModel {
  MPI_Comm comm;
  PetscInt nbody;
  SbBody *body;
  PetscInt nset;
  SbSet *set;
  PetscInt nmaterial;
  SbMaterial *material; /* [nmaterial] one per body, then those of inclusions */
  SbElement *element;   /* [nbody] */
  SbStart *start;       /* [nbody] */
  PetscReal t_begin;    /* s, at set-up: 0, or the time of re-meshing */
  SbMesh mesh;
  SbSpace space;
  PetscInt neffect;
  SbEffect *effect;
  /* one list per operation, holding only the effects that implement it; all of them lie in
     `lists` */
  PetscInt nprescribe, nforce, ntangent, nnonsymmetric, nvolume_pressure, nsettle, naccept,
    nhistory;
  SbEffect *lists, *prescribe, *force, *tangent, *nonsymmetric, *volume_pressure, *settle, *accept,
    *history;
  SbContactSet contacts; /* those effects that are contacts */
  PetscBool linear;      /* laws and effects: the tangent depends on the shifts only */
  PetscBool may_filter;  /* some law has the tangent auto */
  PetscBool strained;    /* it was warned of a rigid body that is strained */
  PetscBool
    barrier_apart; /* residuals of solves leave potentials of contact out: SbContactSetGradient() */
  PetscReal mass;  /* kg */
  PetscBool dynamic;
  PetscReal
    load; /* load factor, 0..1 in static runs: on loads and displacements whose formulas have no t */
};

PetscErrorCode SbModelDestroy(SbModel *model);
/* After bodies, sets, materials, elements and effects: mesh, space, set-up, lists. With -validate
   the invariants of mesh and space are checked: ordering, ranges, ownership, sums. Collective. */
PetscErrorCode SbModelSetUp(SbModel model);
/* F = M a + C v + f_int(u) - f_ext(t, u, v); zero where prescribed if constrain, else the reaction.
   V, A may be NULL. Collective. */
PetscErrorCode SbModelResidual(SbModel model, PetscReal t, Vec U, Vec V, Vec A, PetscBool constrain,
                               Vec F);
/* F = f_ext, N. Collective. */
PetscErrorCode SbModelLoads(SbModel model, PetscReal t, Vec U, Vec V, Vec F);
/* A = shift_a M + shift_v C + shift_k K(u) and the effects' part, prescribed ones replaced.
   Collective. */
PetscErrorCode SbModelTangent(SbModel model, PetscReal t, PetscReal shift_v, PetscReal shift_a,
                              PetscReal shift_k, Vec U, Vec V, Mat A);
/* Y = the part of the tangent at U that the matrix lacks, not symmetric, times X. U, X: [nnode][3]
   m; Y: N, zero on prescribed unknowns; all from SbSpaceCreateVec(). Collective. */
PetscErrorCode SbModelNonsymmetric(SbModel model, PetscReal t, Vec U, Vec X, Vec Y);
/* SbSpaceFollowJumps() with the pressures of loads at t, the load factor in a static run.
   Collective. */
PetscErrorCode SbModelFollowJumps(SbModel model, PetscReal t, Vec U, SbStepsOf steps,
                                  PetscBool *changed);
/* The same in a load step that failed at U, with SB_STEPS_FAILED. */
PetscErrorCode SbModelBearStress(SbModel model, PetscReal t, Vec U, PetscBool *changed);
/* A load step of a static run begins (U NULL), or was solved with the end U at the load factor t:
   what effects change there; changed: it is to be solved once more from U. Collective. */
PetscErrorCode SbModelSettle(SbModel model, PetscReal t, Vec U, PetscBool *changed);
/* Writes prescribed displacements at t into U. */
PetscErrorCode SbModelPrescribe(SbModel model, PetscReal t, Vec U);
/* Initial displacements and velocities of bodies, with their angular velocity. Collective. */
PetscErrorCode SbModelInitialState(SbModel model, Vec U, Vec V);
/* Centre of mass, m, and mass, kg, of each body, centre[nbody][4]: at U, or at rest (NULL).
   Collective. */
PetscErrorCode SbModelCentres(SbModel model, Vec U, PetscReal centre[][4]);
/* This rank's part of a body's kinetic and strain energy, J, momentum, kg m/s, and sum of mass
   times position, kg m; added to sum[nbody]. V may be NULL. Collective. */
#define SB_BODY_SUMS 8
PetscErrorCode SbModelBodySums(SbModel model, Vec U, Vec V, PetscReal sum[][SB_BODY_SUMS]);
/* Instantaneous part of the energies (kinetic, strain, momenta, ...). V may be NULL. Collective. */
PetscErrorCode SbModelEnergies(SbModel model, Vec U, Vec V, SbEnergies *e);
/* Warns, once, of a rigid body that is strained by more than 1e-3 at U, m. Collective. */
PetscErrorCode SbModelWarnStrained(SbModel model, PetscReal t, Vec U);
/* Warns of loads at U, m, with the velocities V, m/s (or NULL), that act on held nodes alone.
   Collective. */
PetscErrorCode SbModelWarnHeldLoads(SbModel model, PetscReal t, Vec U, Vec V);
/* The speed v of a step from t to t + dt, m/s, the scale of contact's tolerances: m v^2 / 2 is the
   kinetic and strain energy of the bodies, of mass m, at its start U, V, plus half of the work of
   all loads and support forces along the size of the smallest body. 0 in a static run (V NULL).
   Collective. */
PetscErrorCode SbModelStepSpeed(SbModel model, PetscReal t, PetscReal dt, Vec U, Vec V,
                                PetscReal *speed);
/* Share of the volume of the law `linear` that is turned by more than `angle`, rad; 0 without that
   law. Collective. */
PetscErrorCode SbModelTurned(SbModel model, Vec U, PetscReal angle, PetscReal *share);
/* Strain energy at U, J, with that of the tensions of fibres that contract, its gradient, the
   internal forces without damping, F[nnode][3] N (may be NULL), and how many tets are inverted
   there. Collective. */
PetscErrorCode SbModelStrainEnergy(SbModel model, Vec U, Vec F, PetscReal *psi,
                                   PetscInt *ninverted);
/* For laws with -body_NAME_tangent auto: from now on tangents with each cell projected to positive
   semi-definite, or the exact ones. Not collective. */
PetscErrorCode SbModelProjectTangent(SbModel model, PetscBool filter);
/* Fibres that contract have from now on the tensions, and bodies the strains without stress, at t,
   s; static: the load factor. Residuals and tangents do it by themselves. Not collective. */
PetscErrorCode SbModelActiveAt(SbModel model, PetscReal t);
/* The force of fibres that contract on the nodes at t, F[nnode][3] N. Collective. */
PetscErrorCode SbModelActiveForce(SbModel model, PetscReal t, Vec U, Vec F);
/* The works of active strains and of other strains without stress since the last call, J, 0 for the
   first one. Collective. */
PetscErrorCode SbModelEigenWork(SbModel model, PetscReal t, Vec U, PetscBool first,
                                PetscReal work[2]);
/* Power dissipated by Rayleigh damping, v . C v, W. Collective. */
PetscErrorCode SbModelDampingPower(SbModel model, Vec U, Vec V, PetscReal *power);
