/*
  The gaps around edges of CR and DG, which the volume of the cells misses.

  Under a hydrostatic pressure the energy of a solid has a part p J. For continuous displacements
  the sum of V J over the cells depends on the boundary only, so that p J adds nothing to the second
  variation. The functions of CR and DG jump, and the sum of the cells alone has twist modes with
  the stiffness -p: without more, bodies wrinkle from tet to tet beyond about p = mu. The rest of
  the volume is in gaps around the edges: for an edge e with the cells k around it, ascending in the
  sense of a right-handed screw about its current vector t_e,

    gap_e = 1/2 t_e . sum_k int_0^1 x_k(s) x x_{k+1}(s) ds,

  x_k(s) the position of the edge as cell k has it. So

    W = sum_e p_e gap_e

  with the tension p_e, the mean of P : F / (3 det F) over the cells around the edge, and the
  pressure of loads that work on the volume of the cells. The penalty of jumps bears pressures up to
  mu / SB_FOLLOW: p_e is what is left, and zero above -mu / SB_FOLLOW. q_e = p_e t_e is that of the
  state at which the penalty of jumps was found (jump.c), t_e the mean of the cells' vectors: W is
  quadratic in the displacements within a solve. Neighbours around an edge share a face, so W is a
  sum over faces and their edges, and couples the nodes that the penalty couples.

  An edge whose ring of cells is open at the boundary counts if a support prescribes all of the
  displacement d of a facet at its end: with displacements less d, the ring ends in a rigid body.
  What the ring does to the support goes to the nodes of these facets. At a smooth wall, a facet
  across an axis whose displacement is prescribed along that axis alone, the ring goes on in the
  mirror image of the body: half of the pair of the last cell and its image is the body's, x x R x
  with the reflection R of displacements less d, and t_e lies in the wall. Other edges at the
  boundary are left out, and the penalty bears all of the pressure in their cells. A body that
  slides along facets otherwise, as along an oblique wall, has no gaps at all: there the edges bear
  the pressure and their rings are open, and the penalty has to bear what it did without gaps (a
  cube confined by smooth walls, nu 0.45, pressed by 0.3: no equilibrium beyond 0.6 of that with the
  gaps of the other edges alone).
*/
#include "fem_impl.h"
#include "sbkernel.h"

#define LEAST 1e-2 /* det F below which a cell counts as degenerate: no pressure */
#define OPEN (-1)

/* Two neighbours around an edge that ends at a support. */
typedef struct {
  PetscInt edge;
  PetscReal sign;      /* of its direction, as for a face from the first cell to the second */
  PetscInt cell[2][4]; /* nodes of both: those opposite its ends, then the others */
  PetscInt node[2];    /* of the prescribed facets at the edge; the same twice: there is one */
} End;

/* An edge of a facet on a smooth wall. */
typedef struct {
  PetscInt edge;
  PetscReal sign;   /* of its direction, as for a face from the cell to its image */
  PetscReal share;  /* 1: its cell is this rank's own */
  PetscInt axis;    /* normal of the wall, 0 to 2 */
  PetscInt node[4]; /* of the cell: those opposite the ends of the edge, then the others */
  PetscInt vertex[2];
  PetscInt bears; /* node that gets what the ring does to the wall */
  PetscBool all;  /* all components of that: the edge ends at a support */
} Mirror;

struct _p_SbEdgeGaps {
  PetscInt nbatch;       /* of faces */
  const PetscInt *node;  /* [nbatch][8][SB_BATCH] of the faces, borrowed */
  const uint8_t *slides; /* [nbody], borrowed */
  PetscInt nedge;

  /* [ncell][6] as SbTetEdge, OPEN: the edge is left out; its direction is from the lower to the
     higher local vertex */
  PetscInt *cell_edge;
  PetscInt *around;    /* [nedge] number of cells around it */
  PetscReal *share;    /* [nedge] fraction of them that this rank owns */
  PetscReal *tension;  /* [nedge] p_e of the last state seen, Pa */
  PetscReal *q, *next; /* [nedge][3] p_e t_e, N/m; that of the last state seen */
  PetscInt *face_edge; /* [nbatch][3][SB_BATCH] edges from corner k to k + 1 of a face, or OPEN */
  SbPack *sign;        /* [nbatch][3] of their direction there; zero in padding */
  SbPack *face_q;      /* [nbatch][9] q_e in the direction of the face, N/m */
  PetscInt *vertex;    /* [nbatch][3][SB_BATCH] corners of the faces */
  PetscInt nend;
  End *end;
  PetscInt nmirror;
  Mirror *mirror;
  uint8_t *walls; /* [nedge] bits of the axes of walls at it */
};

/* Number of the edge between two vertices of a tet in SbTetEdge. */
static const int edge_between[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};

/* Numbers the edges of the cells with nodes at faces. */
static PetscErrorCode number_edges(SbSpace s, SbEdgeGaps g)
{
  const SbMesh mesh = s->mesh;
  PetscInt *low, *start, *slot, *upper;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(6 * mesh->ncell, &low, 6 * mesh->ncell, &upper));
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) {
    const PetscInt a = mesh->cell[4 * (i / 6) + SbTetEdge[i % 6][0]];
    const PetscInt b = mesh->cell[4 * (i / 6) + SbTetEdge[i % 6][1]];

    low[i] = !SbElementHasFaces(SbSpaceCellElement(s, i / 6)) || g->slides[mesh->cell_body[i / 6]]
               ? -1
               : PetscMin(a, b);
    g->cell_edge[i] = OPEN;
  }
  PetscCall(SbBucketByKey(6 * mesh->ncell, low, mesh->nvert, &start, &slot));
  for (PetscInt v = 0; v < mesh->nvert; v++) {
    const PetscInt first = g->nedge;

    for (PetscInt at = start[v]; at < start[v + 1]; at++) {
      const PetscInt i = slot[at];
      const PetscInt a = mesh->cell[4 * (i / 6) + SbTetEdge[i % 6][0]];
      const PetscInt b = mesh->cell[4 * (i / 6) + SbTetEdge[i % 6][1]];
      PetscInt e = first;

      while (e < g->nedge && upper[e] != PetscMax(a, b))
        e++;
      upper[e] = PetscMax(a, b);
      g->nedge = PetscMax(g->nedge, e + 1);
      g->cell_edge[i] = e;
    }
  }
  PetscCall(PetscFree2(low, upper));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(slot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the cells around each edge; leaves out those that are open, but for supports.
   held[nedge][2]: nodes of the prescribed facets at an edge, -1: none. */
static PetscErrorCode close_rings(SbSpace s, SbEdgeGaps g, PetscInt held[])
{
  const SbMesh mesh = s->mesh;
  PetscInt *sides; /* [nedge][2] boundary faces at the edge, those of them on walls */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(2 * g->nedge, &sides));
  for (PetscInt i = 0; i < 2 * g->nedge; i++)
    held[i] = -1;
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) {
    if (g->cell_edge[i] == OPEN)
      continue;
    g->around[g->cell_edge[i]]++;
    g->share[g->cell_edge[i]] += i / 6 < mesh->ncell_owned ? 1. : 0.;
  }
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    PetscInt node, axis;

    if (mesh->neighbour[i] >= 0 || g->cell_edge[6 * (i / 4)] == OPEN)
      continue;
    axis = SbFaceWallAxis(s, i, &node);
    for (int k = 0; k < 3; k++) {
      const PetscInt e =
        g->cell_edge[6 * (i / 4) +
                     edge_between[SbFaceVertex[i % 4][k]][SbFaceVertex[i % 4][(k + 1) % 3]]];

      if (axis != SB_NO_WALL) {
        g->walls[e] |= (uint8_t)(1 << axis);
        sides[2 * e + 1]++;
      } else if (SbFaceIsHeld(s, i, &node) && sides[2 * e] < 2) {
        held[2 * e + (held[2 * e] >= 0)] = node;
      }
      sides[2 * e]++;
    }
  }
  for (PetscInt e = 0; e < g->nedge; e++)
    g->share[e] /= (PetscReal)g->around[e];
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) {
    const PetscInt e = g->cell_edge[i];

    if (e != OPEN && sides[2 * e] &&
        (sides[2 * e] != 2 || (held[2 * e] < 0 && sides[2 * e + 1] != 2)))
      g->cell_edge[i] = OPEN;
  }
  PetscCall(PetscFree(sides));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the pairs of cells around the edges at supports of this rank, which has all cells there. */
static PetscErrorCode list_ends(SbSpace s, SbEdgeGaps g, const PetscInt held[])
{
  const SbMesh mesh = s->mesh;
  PetscInt room = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 12 * mesh->ncell; i++) {
    const PetscInt cell = i / 12;
    const PetscInt f = i / 3 % 4;
    const PetscInt other = mesh->neighbour[4 * cell + f];
    const int ends[2] = {SbFaceVertex[f][i % 3], SbFaceVertex[f][(i + 1) % 3]};
    const PetscInt e = g->cell_edge[6 * cell + edge_between[ends[0]][ends[1]]];
    End *end;

    if (other < cell || e == OPEN || held[2 * e] < 0 ||
        (held[2 * e] >= s->nnode_owned &&
         (held[2 * e + 1] < 0 || held[2 * e + 1] >= s->nnode_owned)))
      continue;
    PetscCall(SbReserve(g->nend + 1, sizeof(End), &room, &g->end));
    end = &g->end[g->nend++];
    end->edge = e;
    end->sign = mesh->cell[4 * cell + ends[0]] < mesh->cell[4 * cell + ends[1]] ? 1. : -1.;
    for (int k = 0; k < 2; k++) {
      const PetscInt c = k ? other : cell;

      end->node[k] = held[2 * e + k] >= 0 ? held[2 * e + k] : held[2 * e];
      for (int a = 0, n[2] = {0, 2}; a < 4; a++) {
        const PetscInt v = mesh->cell[4 * c + a];
        const PetscBool at =
          (PetscBool)(v == mesh->cell[4 * cell + ends[0]] || v == mesh->cell[4 * cell + ends[1]]);

        end->cell[k][n[at ? 0 : 1]++] = s->cell_node[4 * c + a];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the edges of facets on smooth walls of cells with a node of this rank. */
static PetscErrorCode list_mirrors(SbSpace s, SbEdgeGaps g, const PetscInt held[])
{
  const SbMesh mesh = s->mesh;
  PetscInt room = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt cell = i / 4;
    const PetscInt *v = mesh->cell + 4 * cell;
    const int f = (int)(i % 4);
    PetscBool owned = PETSC_FALSE;
    PetscInt axis, wall;

    if (mesh->neighbour[i] >= 0 || !SbElementHasFaces(SbSpaceCellElement(s, cell)) ||
        g->slides[mesh->cell_body[cell]])
      continue;
    axis = SbFaceWallAxis(s, i, &wall);
    owned = (PetscBool)(wall < s->nnode_owned);
    for (int a = 0; a < 4; a++)
      owned = (PetscBool)(owned || s->cell_node[4 * cell + a] < s->nnode_owned);
    for (int k = 0; k < 3 && axis != SB_NO_WALL; k++) {
      const int from = (f + 1 + k) % 4;
      const int to = (f + 1 + (k + 1) % 3) % 4;
      const PetscInt e = g->cell_edge[6 * cell + edge_between[from][to]];
      Mirror *mirror;

      if (e == OPEN || (!owned && (held[2 * e] < 0 || held[2 * e] >= s->nnode_owned)))
        continue;
      PetscCall(SbReserve(g->nmirror + 1, sizeof(Mirror), &room, &g->mirror));
      mirror = &g->mirror[g->nmirror++];
      *mirror = (Mirror){.edge = e,
                         .sign = (v[from] < v[to]) == (f % 2 == 0) ? 1. : -1.,
                         .share = cell < mesh->ncell_owned ? 1. : 0.,
                         .axis = axis,
                         .node = {s->cell_node[4 * cell + from], s->cell_node[4 * cell + to]},
                         .vertex = {v[from], v[to]},
                         .bears = held[2 * e] >= 0 ? held[2 * e] : wall,
                         .all = (PetscBool)(held[2 * e] >= 0)};
      for (int a = 0, n = 2; a < 4; a++)
        if (a != from && a != to)
          mirror->node[n++] = s->cell_node[4 * cell + a];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEdgeGapsCreate(SbSpace s, const SbFaceBatches *faces, const uint8_t slides[],
                                SbEdgeGaps *gaps)
{
  const SbMesh mesh = s->mesh;
  const SbFace *face = faces->face;
  PetscInt *held;
  PetscInt b = 0;
  PetscInt l = 0;
  SbEdgeGaps g;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(gaps));
  g = *gaps;
  g->nbatch = faces->nbatch;
  g->node = faces->node;
  g->slides = slides;
  PetscCall(PetscMalloc1(6 * mesh->ncell, &g->cell_edge));
  PetscCall(number_edges(s, g));
  PetscCall(PetscCalloc5(g->nedge, &g->around, g->nedge, &g->share, g->nedge, &g->tension,
                         3 * g->nedge, &g->q, 3 * g->nedge, &g->next));
  PetscCall(PetscMalloc1(2 * g->nedge, &held));
  PetscCall(PetscCalloc1(g->nedge, &g->walls));
  PetscCall(close_rings(s, g, held));

  /* the edges of the faces */
  PetscCall(
    PetscMalloc2(3 * SB_BATCH * g->nbatch, &g->face_edge, 3 * SB_BATCH * g->nbatch, &g->vertex));
  PetscCall(PetscCalloc2(3 * g->nbatch, &g->sign, 9 * g->nbatch, &g->face_q));
  for (PetscInt i = 0; i < 3 * SB_BATCH * g->nbatch; i++) {
    g->face_edge[i] = OPEN;
    g->vertex[i] = 0;
  }
  for (PetscInt i = 0; i < faces->nface; i++, l++) {
    const PetscInt cell = face[i].cell[0];
    const PetscInt f = face[i].face[0];
    const PetscInt *v = mesh->cell + 4 * cell;

    if (l == faces->n[b]) {
      b++;
      l = 0;
    }
    for (int k = 0; k < 3 && face[i].cell[1] >= 0; k++) {
      const PetscInt from = (f + 1 + k) % 4;
      const PetscInt to = (f + 1 + (k + 1) % 3) % 4;
      const PetscInt e = g->cell_edge[6 * cell + edge_between[from][to]];

      /* the corners f + 1, f + 2, f + 3 are counter-clockwise from outside for even f */
      g->vertex[(3 * b + k) * SB_BATCH + l] = v[from];
      g->face_edge[(3 * b + k) * SB_BATCH + l] = e;
      if (e == OPEN)
        continue;
      g->sign[3 * b + k][l] = (v[from] < v[to]) == (f % 2 == 0) ? 1. : -1.;
    }
  }
  PetscCall(list_ends(s, g, held));
  PetscCall(list_mirrors(s, g, held));
  PetscCall(PetscFree(held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEdgeGapsDestroy(SbEdgeGaps *gaps)
{
  SbEdgeGaps g = *gaps;

  PetscFunctionBeginUser;
  if (!g)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(g->cell_edge));
  PetscCall(PetscFree5(g->around, g->share, g->tension, g->q, g->next));
  PetscCall(PetscFree2(g->face_edge, g->vertex));
  PetscCall(PetscFree2(g->sign, g->face_q));
  PetscCall(PetscFree(g->end));
  PetscCall(PetscFree(g->mirror));
  PetscCall(PetscFree(g->walls));
  PetscCall(PetscFree(*gaps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbEdgeGapsTension(SbEdgeGaps g, PetscInt cell)
{
  PetscReal sum = 0.;

  for (int k = 0; k < 6; k++) {
    if (g->cell_edge[6 * cell + k] == OPEN)
      return 0.;
    sum += g->tension[g->cell_edge[6 * cell + k]];
  }
  return sum / 6.;
}

/* Displacements of a face's corners as its two sides have them, less those of supports. */
SB_INLINE void gather_corners(SbSpace s, const SbEdgeGaps g, PetscInt b, const PetscReal x[],
                              PetscInt l, PetscReal w[2][9])
{
  for (int side = 0; side < 2; side++) {
    const PetscInt *node = g->node + (8 * b + 4 * side) * SB_BATCH + l;

    for (int c = 0; c < 3; c++) {
      PetscReal S = 0.;

      for (int k = 0; k < 4; k++)
        S += x[3 * node[k * SB_BATCH] + c];
      for (int i = 0; i < 3; i++) {
        const PetscReal *d =
          s->vertex_value ? s->vertex_value + 3 * g->vertex[(3 * b + i) * SB_BATCH + l] : NULL;

        w[side][3 * i + c] = S - 3. * x[3 * node[(1 + i) * SB_BATCH] + c] - (d ? d[c] : 0.);
      }
    }
  }
}

/* 1/2 int a(s) x b(s) ds over the edge from corner k, of functions linear in s. */
SB_INLINE void edge_area(const PetscReal a[], const PetscReal b[], int k, PetscReal area[3])
{
  const int i = 3 * k;
  const int j = 3 * ((k + 1) % 3);

  for (int c = 0; c < 3; c++) {
    const int p = (c + 1) % 3;
    const int q = (c + 2) % 3;

    area[c] = ((a[i + p] * (2. * b[i + q] + b[j + q]) + a[j + p] * (2. * b[j + q] + b[i + q])) -
               (a[i + q] * (2. * b[i + p] + b[j + p]) + a[j + q] * (2. * b[j + p] + b[i + p]))) /
              12.;
  }
}

/* Displacements of the ends of an edge at a wall, less those of the support, and of their image. */
static void gather_mirror(SbSpace s, const Mirror *m, const PetscReal x[], PetscReal w[6],
                          PetscReal image[6])
{
  for (int c = 0; c < 3; c++) {
    PetscReal S = 0.;

    for (int a = 0; a < 4; a++)
      S += x[3 * m->node[a] + c];
    for (int i = 0; i < 2; i++) {
      w[3 * i + c] = S - 3. * x[3 * m->node[i] + c] -
                     (s->vertex_value ? s->vertex_value[3 * m->vertex[i] + c] : 0.);
      image[3 * i + c] = c == m->axis ? -w[3 * i + c] : w[3 * i + c];
    }
  }
}

/* The tension that is left to the gaps in the cells of a batch, F in them: positive where the
   penalty bears all. */
static void tensions(SbSpace s, PetscInt b, const PetscReal x[], const PetscReal even[],
                     SbPack F[9], SbPack tension)
{
  const SbRegion *region = s->batch_region[b];
  const PetscReal borne = SbMaterialShearModulus(region->material) / SB_FOLLOW;
  SbPack at[SB_POINTS][9], P[SB_POINTS][9];

  SbBatchState(s, b, x, at, P, NULL, NULL);
  memcpy(F, at[0], sizeof(at[0]));
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], cofactor[9], J;

    SbPackGet(9, (const SbPack *)F, l, f);
    SbMatCofactor(f, cofactor);
    J = SbDot3(f, cofactor);
    tension[l] = borne + (even ? even[region->body] : 0.);
    for (int k = 0; k < 9 && J > LEAST; k++)
      tension[l] += P[0][k][l] * f[k] / (3. * J);
  }
}

/* Whether the batch has cells with nodes at faces and a pressure, of a body that does not slide. */
static inline PetscBool has_gaps(SbSpace s, PetscInt b, const uint8_t slides[])
{
  const SbRegion *region = s->batch_region[b];

  return (PetscBool)(SbElementHasFaces(region->element) && !region->material->linear &&
                     !slides[region->body]);
}

PetscErrorCode SbEdgeGapsFindSliding(SbSpace s, uint8_t slides[])
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 4 * s->mesh->ncell_owned; i++) {
    PetscInt node;

    if (!SbElementHasFaces(SbSpaceCellElement(s, i / 4)) ||
        !(s->mesh->face_set[i] & SB_ON_BOUNDARY))
      continue;
    if (!SbFaceIsHeld(s, i, &node) && s->fixed[node] && SbFaceWallAxis(s, i, &node) == SB_NO_WALL)
      slides[s->mesh->cell_body[i / 4]] = 1;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, slides, (PetscMPIInt)s->mesh->nbody, MPI_UINT8_T,
                             MPI_MAX, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbEdgeGapsNeeded(SbSpace s, const uint8_t slides[], const PetscReal x[],
                           const PetscReal even[])
{
  for (PetscInt b = 0; b < s->nbatch; b++) {
    SbPack F[9], tension;

    if (!has_gaps(s, b, slides))
      continue;
    tensions(s, b, x, even, F, tension);
    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      if (tension[l] < 0.)
        return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* sum[nedge][5]: over the cells around each edge of its vector, m, of their tension, and of their
   shear modulus, Pa. */
static void sum_around(SbSpace s, const SbEdgeGaps g, const PetscReal x[], const PetscReal even[],
                       PetscReal sum[])
{
  for (PetscInt b = 0; b < s->nbatch; b++) {
    SbPack F[9], tension;

    if (!has_gaps(s, b, g->slides))
      continue;
    tensions(s, b, x, even, F, tension);
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscInt cell = s->batch_cell[b] + l;
      const PetscInt *v = s->mesh->cell + 4 * cell;
      PetscReal f[9];

      SbPackGet(9, (const SbPack *)F, (int)l, f);
      for (int k = 0; k < 6; k++) {
        const PetscInt e = g->cell_edge[6 * cell + k];
        const PetscInt from = v[SbTetEdge[k][0]];
        const PetscInt to = v[SbTetEdge[k][1]];
        PetscReal t[3];

        if (e == OPEN)
          continue;
        SbSubtract(s->mesh->x + 3 * PetscMax(from, to), s->mesh->x + 3 * PetscMin(from, to), t);
        for (int c = 0; c < 3; c++)
          sum[5 * e + c] += SbDot3(f + 3 * c, t);
        sum[5 * e + 3] += tension[l];
        sum[5 * e + 4] += SbMaterialShearModulus(s->batch_region[b]->material);
      }
    }
  }
}

/* area[nedge][3]: 1/2 sum over the ring of int x_k x x_{k+1} ds at x, m^2. */
static void sum_areas(SbSpace s, const SbEdgeGaps g, const PetscReal x[], PetscReal area[])
{
  for (PetscInt b = 0; b < g->nbatch; b++) {
    for (PetscInt l = 0; l < SB_BATCH; l++) {
      PetscReal w[2][9];

      gather_corners(s, g, b, x, l, w);
      for (int k = 0; k < 3; k++) {
        const PetscInt e = g->face_edge[(3 * b + k) * SB_BATCH + l];
        PetscReal one[3];

        if (e == OPEN)
          continue;
        edge_area(w[0], w[1], k, one);
        for (int c = 0; c < 3; c++)
          area[3 * e + c] += g->sign[3 * b + k][l] * one[c];
      }
    }
  }
  for (PetscInt i = 0; i < g->nmirror; i++) {
    const Mirror *m = &g->mirror[i];
    PetscReal w[6], image[6], one[3];

    gather_mirror(s, m, x, w, image);
    edge_area(w, image, 0, one);
    for (int c = 0; c < 3; c++)
      area[3 * m->edge + c] += 0.5 * m->sign * one[c];
  }
}

PetscErrorCode SbEdgeGapsFollow(SbSpace s, SbEdgeGaps g, const PetscReal x[],
                                const PetscReal even[], SbGapsChange *change)
{
  PetscReal *sum, *area;

  PetscFunctionBeginUser;
  *change = (SbGapsChange){0};
  PetscCall(PetscCalloc2(5 * g->nedge, &sum, 3 * g->nedge, &area));
  sum_around(s, g, x, even, sum);
  sum_areas(s, g, x, area);
  for (PetscInt e = 0; e < g->nedge; e++) {
    const PetscReal n = (PetscReal)g->around[e];
    const PetscReal borne = sum[5 * e + 4] / (n * SB_FOLLOW);
    PetscReal energy = 0.;
    PetscReal square = 0.; /* of the edge, m^2 */
    PetscReal along = 0.;  /* change of the tension times that, N */

    g->tension[e] = PetscMin(sum[5 * e + 3] / n, 0.);
    for (int c = 0; c < 3; c++) {
      const PetscBool across = (PetscBool)((g->walls[e] & 1 << c) != 0);
      const PetscReal t = across ? 0. : sum[5 * e + c] / n;
      PetscReal more;

      g->next[3 * e + c] = across ? 0. : g->tension[e] * sum[5 * e + c] / n;
      more = g->next[3 * e + c] - g->q[3 * e + c];
      square += t * t;
      along += more * t;
      energy += more * area[3 * e + c];
      change->differ = (PetscBool)(change->differ || more != 0.);
    }
    change->energy += g->share[e] * PetscAbsReal(energy);
    change->unborne =
      (PetscBool)(change->unborne || (g->share[e] > 0. && PetscAbsReal(along) > borne * square));
    change->even[0] += square > 0. ? g->share[e] * along / (borne * square) : 0.;
    change->even[1] += g->share[e];
  }
  PetscCall(PetscFree2(sum, area));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbEdgeGapsRenew(SbEdgeGaps g)
{
  for (PetscInt i = 0; i < 3 * g->nedge; i++)
    g->q[i] = g->next[i];
  for (PetscInt i = 0; i < 3 * g->nbatch; i++) {
    for (PetscInt l = 0; l < SB_BATCH; l++) {
      const PetscInt e = g->face_edge[i * SB_BATCH + l];

      for (int c = 0; c < 3; c++)
        g->face_q[3 * i + c][l] = e == OPEN ? 0. : g->sign[i][l] * g->q[3 * e + c];
    }
  }
}

/* f += sign/2 int w(s) phi_i(s) ds x q at the ends i of the edge from corner k: derivatives of 1/2
   q . int a x b ds by the ends of a with w = b, sign 1, and of b with w = a, sign -1. */
SB_INLINE void add_edge_force(const PetscReal w[], const PetscReal q[3], int k, PetscReal sign,
                              PetscReal f[])
{
  const int i = 3 * k;
  const int j = 3 * ((k + 1) % 3);

  for (int c = 0; c < 3; c++) {
    const int a = (c + 1) % 3;
    const int b = (c + 2) % 3;

    f[i + c] +=
      sign / 12. * ((2. * w[i + a] + w[j + a]) * q[b] - (2. * w[i + b] + w[j + b]) * q[a]);
    f[j + c] +=
      sign / 12. * ((2. * w[j + a] + w[i + a]) * q[b] - (2. * w[j + b] + w[i + b]) * q[a]);
  }
}

/* The forces of edges at walls, and what they do to these: -1/4 (sum of both ends of w + R w) x q
   across the wall; or all of that of R w to a support at the edge, which gets that of w below. */
static void add_mirrors(SbSpace s, const SbEdgeGaps g, const PetscReal x[], PetscReal f[])
{
  for (PetscInt i = 0; i < g->nmirror; i++) {
    const Mirror *m = &g->mirror[i];
    const PetscReal *q = g->q + 3 * m->edge;
    PetscReal w[6], image[6];
    PetscReal t[6] = {0.};
    PetscReal both[3], wall[3];

    gather_mirror(s, m, x, w, image);
    add_edge_force(image, q, 0, m->sign, t);
    for (int c = 0; c < 3; c++) {
      const PetscReal all = t[c] + t[3 + c];

      for (int a = 0; a < 4; a++)
        f[3 * m->node[a] + c] += all - (a < 2 ? 3. * t[3 * a + c] : 0.);
      both[c] = image[c] + image[3 + c] + (m->all ? 0. : w[c] + w[3 + c]);
    }
    SbCross(both, q, wall);
    for (int c = 0; c < 3; c++)
      f[3 * m->bears + c] -= m->all || c == m->axis ? 0.25 * m->sign * wall[c] : 0.;
  }
}

void SbEdgeGapsAdd(SbSpace s, SbEdgeGaps g, const PetscReal x[], PetscReal f[])
{
  for (PetscInt b = 0; b < g->nbatch; b++) {
    for (PetscInt l = 0; l < SB_BATCH; l++) {
      PetscReal w[2][9];
      PetscReal t[2][9] = {{0.}};

      gather_corners(s, g, b, x, l, w);
      for (int k = 0; k < 3; k++) {
        PetscReal q[3];

        for (int c = 0; c < 3; c++)
          q[c] = g->face_q[9 * b + 3 * k + c][l];
        add_edge_force(w[1], q, k, 1., t[0]);
        add_edge_force(w[0], q, k, -1., t[1]);
      }
      for (int side = 0; side < 2; side++) {
        const PetscInt *node = g->node + (8 * b + 4 * side) * SB_BATCH + l;

        for (int c = 0; c < 3; c++) {
          const PetscReal all = t[side][c] + t[side][3 + c] + t[side][6 + c];

          f[3 * node[0] + c] += all;
          for (int i = 0; i < 3; i++)
            f[3 * node[(1 + i) * SB_BATCH] + c] += all - 3. * t[side][3 * i + c];
        }
      }
    }
  }

  add_mirrors(s, g, x, f);

  /* what the supports get, -1/4 (sum of both ends of w_{k+1} - w_k) x q */
  for (PetscInt i = 0; i < g->nend; i++) {
    const End *end = &g->end[i];
    const PetscReal *q = g->q + 3 * end->edge;
    PetscReal w[3], t[3];

    for (int c = 0; c < 3; c++) {
      w[c] = 0.;
      for (int a = 0; a < 4; a++)
        w[c] += (a < 2 ? -1. : 2.) * (x[3 * end->cell[1][a] + c] - x[3 * end->cell[0][a] + c]);
    }
    SbCross(w, q, t);
    for (int k = 0; k < 6; k++)
      f[3 * end->node[k / 3] + k % 3] -= 0.125 * end->sign * t[k % 3];
  }
}

PetscReal SbEdgeGapsMirrorEnergy(SbSpace s, SbEdgeGaps g, const PetscReal x[], PetscReal body[])
{
  PetscReal energy = 0.;

  for (PetscInt i = 0; i < g->nmirror; i++) {
    const Mirror *m = &g->mirror[i];
    PetscReal w[6], image[6], area[3], one;

    gather_mirror(s, m, x, w, image);
    edge_area(w, image, 0, area);
    one = 0.5 * m->share * m->sign * SbDot3(g->q + 3 * m->edge, area);
    energy += one;
    if (body)
      body[s->node_body[m->node[0]]] += one;
  }
  return energy;
}

PetscInt SbEdgeGapsMirrors(SbEdgeGaps g)
{
  return g->nmirror;
}

const PetscInt *SbEdgeGapsMirrorMatrix(SbEdgeGaps g, PetscInt i, PetscReal v[4][4][3])
{
  static const PetscReal d[2][4] = {{-2, 1, 1, 1}, {1, -2, 1, 1}};
  const Mirror *m = &g->mirror[i];
  const PetscReal *q = g->q + 3 * m->edge;
  const int j = (int)(m->axis + 1) % 3;
  const int k = (int)(m->axis + 2) % 3;

  /* W = q/24 . (2 a_1 x R a_1 + 2 a_2 x R a_2 + a_1 x R a_2 + a_2 x R a_1), and q . a x R b = q_k
     (a_i b_j + a_j b_i) - q_j (a_i b_k + a_k b_i) with the axis i */
  for (int a = 0; a < 16; a++) {
    const PetscReal factor = m->sign *
                             (d[0][a / 4] * (2. * d[0][a % 4] + d[1][a % 4]) +
                              d[1][a / 4] * (2. * d[1][a % 4] + d[0][a % 4])) /
                             12.;

    v[a / 4][a % 4][m->axis] = 0.;
    v[a / 4][a % 4][k] = factor * q[k];
    v[a / 4][a % 4][j] = -factor * q[j];
  }
  return m->node;
}

PetscReal SbEdgeGapsEnergy(SbSpace s, SbEdgeGaps g, const PetscReal x[], PetscInt b, PetscInt l)
{
  PetscReal w[2][9];
  PetscReal energy = 0.;

  gather_corners(s, g, b, x, l, w);
  for (int k = 0; k < 3; k++) {
    PetscReal area[3];

    edge_area(w[0], w[1], k, area);
    for (int c = 0; c < 3; c++)
      energy += g->face_q[9 * b + 3 * k + c][l] * area[c];
  }
  return energy;
}

void SbEdgeGapsMatrix(SbEdgeGaps g, PetscInt b, PetscInt l, PetscReal v[4][4][3])
{
  static const PetscReal d[3][4] = {{1, -2, 1, 1}, {1, 1, -2, 1}, {1, 1, 1, -2}};

  memset(v, 0, 48 * sizeof(PetscReal));
  for (int k = 0; k < 3; k++) {
    const PetscReal *one = d[k];
    const PetscReal *two = d[(k + 1) % 3];

    /* W = q/12 . (2 a_1 x b_1 + 2 a_2 x b_2 + a_1 x b_2 + a_2 x b_1) */
    for (int i = 0; i < 16; i++) {
      const PetscReal factor = -(one[i / 4] * (2. * one[i % 4] + two[i % 4]) +
                                 two[i / 4] * (2. * two[i % 4] + one[i % 4])) /
                               12.;

      for (int c = 0; c < 3; c++)
        v[i / 4][i % 4][c] += factor * g->face_q[9 * b + 3 * k + c][l];
    }
  }
}
