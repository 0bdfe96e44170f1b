/*
  surface_impl.h - what surface.c and halo.c share: the private data of an SbContactSurface.
*/
#pragma once
#include "sbdetect.h"
#include "sbkernel.h"

/* A facet of an owned or a ghost cell. */
typedef struct {
  PetscInt at[3];     /* 4 cell + corner: which vertices of its cell */
  PetscInt vertex[3]; /* their numbers among the vertices of the surface on this rank */
  PetscInt own;       /* number among own facets, -1: of a ghost cell */
} SbContactSurfaceFacet;

/* A facet of a P1 cell around an owned point. */
typedef struct {
  PetscInt node[3];  /* local nodes at its corners */
  PetscInt point[3]; /* points there, -1: owned by another rank */
} SbContactSurfaceFan;

/* What is sent and received (halo.c). */
typedef struct {
  MPI_Comm comm; /* with these tags messages mix with no others */
  PetscMPIInt size, rank, tag[4];
  PetscReal *reduced; /* [6 npart + 2] parts' boxes, motion of the step, motion since the list was made */
  PetscReal *low;     /* [npart] lower x of the parts' boxes, ascending */
  PetscInt *order;    /* [npart] the parts in that order */
  PetscBool built;    /* there is a list */
  PetscBool self;     /* it was made for self-contact */
  PetscReal reach, margin; /* that it was made with, m */
  PetscReal *
    swept; /* [ncorner_owned + npoint][6] boxes of the motion of own corners and points when it was made, m */
  PetscInt nto, nfrom;             /* ranks that get facets of this one, ranks whose facets are here */
  PetscMPIInt *to, *from;          /* [nto], [nfrom] */
  PetscInt *to_start, *from_start; /* [nto+1] into send, [nfrom+1] into the facets of others */
  PetscInt *send;                  /* [to_start[nto]] own facets */
  PetscReal *buffer;               /* [2][to_start[nto]][3][3] positions to send: x, x0 */
  MPI_Request *request;            /* [2 (nto + nfrom)] */
  PetscInt nbuild;                 /* how often it was made */
} SbHalo;

typedef struct {
  PetscInt npart;
  PetscInt ncorner_owned;
  PetscInt *corner_at;          /* [ncorner_owned] 4 cell + corner */
  PetscInt *corner_part;        /* [ncorner_owned] */
  PetscInt nlocal;              /* facets of owned and ghost cells */
  SbContactSurfaceFacet *local; /* [nlocal] */
  PetscInt nvertex;             /* vertices of these */
  PetscInt nfan;
  SbContactSurfaceFan *fan; /* [nfan] in the order of facet_id: sums do not depend on the partition */
  PetscInt *point_own;      /* [npoint] own facet whose centroid the point is, -1: a vertex */
  SbEdges edges;
  PetscInt edge_size;    /* edges that there is room for */
  PetscInt (*side)[2];   /* [edges.nown] sides of the first and the second facet, 3 local + k */
  PetscInt nopen, *open; /* sides of own facets, 3 facet + k, whose edge is no own one */
  PetscInt *own_id;      /* [edges.nown] identities of own edges, ascending */
  PetscInt foreign_size; /* facets of others that there is room for */
  /* the arrays of the scene, to be written; x0 and p0 are those of x and p when there is no start of the step */
  PetscReal *x, *x0, *X, *p, *p0, *P, *p_normal;
  PetscInt *facet, *facet_vertex, *facet_part, *facet_id, *point_part, *point_id, *point_vertex, *point_facet;
  SbHalo halo;
} SbContactSurfaceData;

/* Where vertex `at` = 4 cell + corner of a local cell is at local displacements u, m. */
void SbContactSurfacePosition(SbSpace space, PetscInt at, const PetscReal u[], PetscReal x[3]);
/* Makes the scene hold n facets of others behind its own ones; what they are is written afterwards. Not collective. */
PetscErrorCode SbContactSurfaceSetForeign(SbContactSurface surface, PetscInt n);

/* The own edges but for their corners; allocates. Not collective. */
PetscErrorCode SbContactSurfaceOwnEdges(SbContactSurface surface, const SbFacet facet[]);
/* The edges behind the own ones, after the facets of others have changed. Not collective. */
PetscErrorCode SbContactSurfaceOtherEdges(SbContactSurface surface);
PetscErrorCode SbContactSurfaceFreeEdges(SbContactSurface surface);

PetscErrorCode SbHaloCreate(SbContactSurface surface);
PetscErrorCode SbHaloDestroy(SbHalo *halo);
/* Finds, with boxes grown by `grown`, which facets go to which rank: fills nto, to, to_start, send, nfrom, from, swept. Collective. */
PetscErrorCode SbHaloPlan(SbContactSurface surface, const PetscReal u0[], const PetscReal u[],
                          PetscReal grown);
/* Brings facets of others, own corners and points having been moved. `moving`: u0 is not NULL. Collective. */
PetscErrorCode SbHaloUpdate(SbContactSurface surface, const PetscReal u0[], const PetscReal u[],
                            PetscBool *close);
