// @ranks 1 2 3 4
/*
  The distributed surface: what a rank sees of it holds every facet within reach of its points and edges, at the place where the owner has it;
  areas, normals and identities are those of one rank; the list of foreign facets is kept, renewed and dropped when it should; and a
  contact of small extent moves few facets.
*/
#include "../../src/contact/surface_impl.h"
#include "surface_fixture.h"

/* The whole surface, on every rank. */
typedef struct {
  PetscInt n;
  PetscReal *row; /* [n][ROW] */
  PetscInt *at;   /* [4 Ncell] row of each facet by identity, -1: none */
  PetscReal *u;   /* [Nnode][3] by global number */
} Whole;

#define ROW 36 /* part 0, vertices 1, nodes 4, x 8, x0 17, X 26, identity 35 */

static void describe(const Case *c, PetscReal row[])
{
  const SbDetectScene *g = &c->s->scene;

  for (PetscInt f = 0; f < c->s->nfacet_owned; f++, row += ROW) {
    row[0] = (PetscReal)g->facet_part[f];
    for (int k = 0; k < 3; k++) row[1 + k] = (PetscReal)g->facet_vertex[3 * f + k];
    for (int k = 0; k < 4; k++) row[4 + k] = (PetscReal)c->s->facet_node[4 * f + k];
    for (int k = 0; k < 9; k++) {
      const PetscInt at = 3 * g->facet[3 * f + k / 3] + k % 3;

      row[8 + k] = g->x[at];
      row[17 + k] = (g->x0 ? g->x0 : g->x)[at];
      row[26 + k] = g->X[at];
    }
    row[35] = (PetscReal)g->facet_id[f];
  }
}

/* Every facet has one owner. */
static PetscErrorCode gather(const Case *c, Whole *w)
{
  const SbSpace s = c->m->space;
  const PetscInt nid = 4 * c->m->mesh->Ncell;
  PetscReal *mine;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(ROW * c->s->nfacet_owned, &mine));
  describe(c, mine);
  PetscCall(gather_numbers(c->m->comm, ROW * c->s->nfacet_owned, mine, &w->n, &w->row));
  w->n /= ROW;
  PetscCall(PetscFree(mine));
  PetscCall(PetscMalloc1(nid, &w->at));
  for (PetscInt i = 0; i < nid; i++) w->at[i] = -1;
  for (PetscInt f = 0; f < w->n; f++) {
    PetscInt *at = &w->at[(PetscInt)w->row[ROW * f + 35]];

    SB_CHECK(*at < 0, "a facet has two owners");
    *at = f;
  }
  PetscCall(gather_numbers(c->m->comm, 3 * s->nnode_owned, c->u, &(PetscInt){0}, &w->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode free_whole(Whole *w)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(w->row));
  PetscCall(PetscFree(w->at));
  PetscCall(PetscFree(w->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The facets of this rank, own and foreign ones, are what their owners have, and their weights give their places. */
static void check_facets(const Case *c, const Whole *w)
{
  const SbDetectScene *g = &c->s->scene;

  for (PetscInt f = 0; f < g->nfacet; f++) {
    const PetscReal *row = w->row + ROW * w->at[g->facet_id[f]];

    SB_CHECK(w->at[g->facet_id[f]] >= 0 && row[0] == (PetscReal)g->facet_part[f], "facet %d is of part %g",
             (int)g->facet_id[f], (double)row[0]);
    for (int k = 0; k < 3; k++) SB_CHECK(row[1 + k] == (PetscReal)g->facet_vertex[3 * f + k], "vertex");
    for (int k = 0; k < 4; k++) SB_CHECK(row[4 + k] == (PetscReal)c->s->facet_node[4 * f + k], "node");
    for (int k = 0; k < 9; k++) {
      const PetscInt at = 3 * g->facet[3 * f + k / 3] + k % 3;
      PetscReal x = g->X[at];

      SB_CHECK(g->facet[3 * f + k / 3] >= 0 && g->facet[3 * f + k / 3] < g->ncorner, "corner");
      SB_CHECK(row[8 + k] == g->x[at], "x of facet %d is %g, on its owner %g", (int)g->facet_id[f],
               (double)g->x[at], (double)row[8 + k]);
      SB_CHECK(!g->x0 || row[17 + k] == g->x0[at], "x0 of facet %d", (int)g->facet_id[f]);
      SB_CHECK(row[26 + k] == g->X[at], "X of facet %d", (int)g->facet_id[f]);
      for (int a = 0; a < 4; a++)
        x += c->s->facet_weight[12 * f + 4 * (k / 3) + a] * w->u[3 * c->s->facet_node[4 * f + a] + k % 3];
      SB_CHECK_NEAR(g->x[at], x, 1e-14, "place by weights");
    }
  }
}

/* Boxes of the motion of n places. */
static void bounds(PetscInt n, const PetscReal x[], const PetscReal x0[], PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    box[k] = 1e30;
    box[3 + k] = -1e30;
    for (PetscInt i = 0; i < n; i++) {
      box[k] = PetscMin(box[k], PetscMin(x[3 * i + k], x0[3 * i + k]));
      box[3 + k] = PetscMax(box[3 + k], PetscMax(x[3 * i + k], x0[3 * i + k]));
    }
  }
}

static PetscBool meet(const PetscReal a[6], const PetscReal b[6], PetscReal grown)
{
  for (int k = 0; k < 3; k++) {
    if (a[k] - grown > b[3 + k] || b[k] - grown > a[3 + k]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Boxes of all copies of each vertex, by its identity. */
static PetscErrorCode bound_vertices(const Case *c, const Whole *w, PetscReal **box)
{
  const PetscInt n = c->m->mesh->Nvert;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(6 * n, box));
  for (PetscInt v = 0; v < n; v++) bounds(0, NULL, NULL, *box + 6 * v);
  for (PetscInt i = 0; i < 3 * w->n; i++) {
    const PetscReal *row = w->row + ROW * (i / 3);
    PetscReal one[6], *all = *box + 6 * (PetscInt)row[1 + i % 3];

    bounds(1, row + 8 + 3 * (i % 3), row + 17 + 3 * (i % 3), one);
    for (int k = 0; k < 3; k++) {
      all[k] = PetscMin(all[k], one[k]);
      all[3 + k] = PetscMax(all[3 + k], one[3 + k]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Every facet whose box, grown by the reach, meets that of a point here is in this rank's scene, once; its box holds all copies of its
  vertices, for then what adjoins the nearest facet is there too. Gives the number of pairs of all ranks.
*/
static PetscErrorCode check_seen(const Case *c, const Whole *w, PetscInt *npair)
{
  const SbDetectScene *g = &c->s->scene;
  PetscInt *seen, missing = 0;
  PetscReal *vertex;

  PetscFunctionBeginUser;
  *npair = 0;
  PetscCall(bound_vertices(c, w, &vertex));
  PetscCall(PetscCalloc1(w->n, &seen));
  for (PetscInt f = 0; f < g->nfacet; f++) seen[w->at[g->facet_id[f]]]++;
  for (PetscInt f = 0; f < w->n; f++) {
    const PetscReal *row = w->row + ROW * f;
    PetscReal box[6], at[6];

    SB_CHECK(seen[f] <= 1, "facet %d is here %d times", (int)f, (int)seen[f]);
    bounds(3, row + 8, row + 17, box);
    for (int k = 0; k < 18; k++) {
      const PetscReal *copies = vertex + 6 * (PetscInt)row[1 + k / 6];

      box[k % 6] = k % 6 < 3 ? PetscMin(box[k % 6], copies[k % 6]) : PetscMax(box[k % 6], copies[k % 6]);
    }
    for (PetscInt i = 0; i < g->npoint; i++) {
      if (!g->self && (PetscReal)g->point_part[i] == row[0]) continue;
      bounds(1, g->p + 3 * i, (g->p0 ? g->p0 : g->p) + 3 * i, at);
      if (!meet(box, at, g->reach)) continue;
      ++*npair;
      missing += !seen[f];
    }
  }
  SB_CHECK(missing == 0, "%d of %d pairs of point and facet are missing", (int)missing, (int)*npair);
  PetscCall(PetscFree(seen));
  PetscCall(PetscFree(vertex));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, npair, 1, MPIU_INT, MPI_SUM, c->m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points have one owner, and identity, place, area and normal are, to the last bit, those of one rank. */
static PetscErrorCode check_points(const Case *c, const Case *alone, PetscReal area)
{
  const SbDetectScene *g = &c->s->scene, *one = &alone->s->scene;
  const PetscInt n = c->m->mesh->Nvert + 8 * c->m->mesh->Ncell;
  PetscReal sum = 0;
  PetscInt *count, *where;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(n, &count, n, &where));
  for (PetscInt i = 0; i < one->npoint; i++) where[one->point_id[i]] = i;
  for (PetscInt i = 0; i < g->npoint; i++) {
    const PetscInt j = where[g->point_id[i]], node = c->s->point_node[i];

    count[g->point_id[i]]++;
    sum += c->s->point_area[i];
    SB_CHECK(node >= 0 && node < c->m->space->nnode_owned && g->point_id[i] == c->m->space->node_orig[node],
             "point %d is node %d", (int)i, (int)node);
    SB_CHECK(g->point_id[i] == one->point_id[j] && g->point_part[i] == one->point_part[j] &&
               g->point_vertex[i] == one->point_vertex[j] && g->point_facet[i] == one->point_facet[j] &&
               (g->point_vertex[i] < 0) != (g->point_facet[i] < 0),
             "point %d is another one on one rank", (int)g->point_id[i]);
    SB_CHECK(c->s->point_area[i] == alone->s->point_area[j], "area %g of point %d is %g on one rank",
             (double)c->s->point_area[i], (int)g->point_id[i], (double)alone->s->point_area[j]);
    SB_CHECK_NEAR(SbDot3(g->p_normal + 3 * i, g->p_normal + 3 * i), 1, 1e-14, "length of a normal");
    for (int k = 0; k < 3; k++) {
      SB_CHECK(g->p[3 * i + k] == one->p[3 * j + k] && g->P[3 * i + k] == one->P[3 * j + k],
               "place of a point");
      SB_CHECK(g->p_normal[3 * i + k] == one->p_normal[3 * j + k],
               "normal of point %d: %.16g, on one rank %.16g", (int)g->point_id[i],
               (double)g->p_normal[3 * i + k], (double)one->p_normal[3 * j + k]);
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)n, MPIU_INT, MPI_SUM, c->m->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPIU_REAL, MPI_SUM, c->m->comm));
  SB_CHECK_NEAR(sum, area, 1e-13 * area, "area of all points");
  for (PetscInt i = 0; i < one->npoint; i++)
    SB_CHECK(count[one->point_id[i]] == 1, "point %d has %d owners", (int)one->point_id[i],
             (int)count[one->point_id[i]]);
  PetscCall(PetscFree2(count, where));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Box of the motion of an edge. */
static void bound_edge(const SbDetectScene *g, PetscInt i, PetscReal box[6])
{
  PetscReal x[2][3], x0[2][3];

  for (int q = 0; q < 6; q++) {
    const PetscInt at = 3 * g->edges->corner[4 * i + q / 3] + q % 3;

    x[q / 3][q % 3] = g->x[at];
    x0[q / 3][q % 3] = (g->x0 ? g->x0 : g->x)[at];
  }
  bounds(2, x[0], x0[0], box);
}

/* The edges of this rank, own ones and others, are those of one rank; their weights give their places. */
static void compare_edges(const Case *c, const Case *alone, const PetscInt where[], const PetscReal u[])
{
  const SbDetectScene *g = &c->s->scene, *one = &alone->s->scene;

  for (PetscInt i = 0; i < g->edges->n; i++) {
    const PetscInt j = where[g->edges->id[i]];

    SB_CHECK(j >= 0, "edge %d is none on one rank", (int)g->edges->id[i]);
    if (j < 0) continue;
    SB_CHECK(g->edges->part[i] == one->edges->part[j], "part of an edge");
    for (int k = 0; k < 12; k++) {
      const PetscInt a = 3 * g->edges->corner[4 * i + k / 3] + k % 3,
                     b = 3 * one->edges->corner[4 * j + k / 3] + k % 3;
      PetscReal x = g->X[a];

      SB_CHECK(g->x[a] == one->x[b] && g->X[a] == one->X[b] && (!g->x0 || g->x0[a] == one->x0[b]),
               "corner %d of edge %d is elsewhere on one rank", k / 3, (int)g->edges->id[i]);
      if (k >= 6) continue;
      SB_CHECK(g->edges->vertex[2 * i + k / 3] == one->edges->vertex[2 * j + k / 3], "vertex of an edge");
      for (int m = 0; m < 4; m++)
        x += c->s->edge_weight[8 * i + 4 * (k / 3) + m] * u[3 * c->s->edge_node[4 * i + m] + k % 3];
      SB_CHECK_NEAR(g->x[a], x, 1e-14, "place by weights");
    }
  }
}

/* Each edge of one rank has one owner among all; what is within reach of an own edge is here. */
static PetscErrorCode check_edges(const Case *c, const Case *alone)
{
  const SbDetectScene *g = &c->s->scene, *one = &alone->s->scene;
  const PetscInt nid = 12 * c->m->mesh->Ncell;
  PetscInt *owners, *where, *here, missing = 0;
  PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(nid, &owners));
  PetscCall(PetscMalloc2(nid, &where, nid, &here));
  for (PetscInt i = 0; i < nid; i++) where[i] = here[i] = -1;
  for (PetscInt i = 0; i < one->edges->n; i++) where[one->edges->id[i]] = i;
  for (PetscInt i = 0; i < g->edges->n; i++) {
    SB_CHECK(here[g->edges->id[i]] < 0, "edge %d is here twice", (int)g->edges->id[i]);
    here[g->edges->id[i]] = i;
    owners[g->edges->id[i]] += i < g->edges->nown;
  }
  PetscCall(gather_numbers(c->m->comm, 3 * c->m->space->nnode_owned, c->u, &(PetscInt){0}, &u));
  compare_edges(c, alone, where, u);
  PetscCall(PetscFree(u));
  for (PetscInt i = 0; i < g->edges->nown; i++) {
    PetscReal box[6], other[6];

    bound_edge(g, i, box);
    for (PetscInt j = 0; j < one->edges->n; j++) {
      if (!g->self && one->edges->part[j] == g->edges->part[i]) continue;
      bound_edge(one, j, other);
      missing += meet(box, other, g->reach) && here[one->edges->id[j]] < 0;
    }
  }
  SB_CHECK(!missing, "%d edges near own ones are missing", (int)missing);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, owners, (PetscMPIInt)nid, MPIU_INT, MPI_SUM, c->m->comm));
  for (PetscInt i = 0; i < nid; i++)
    SB_CHECK(owners[i] == (where[i] >= 0), "edge %d has %d owners", (int)i, (int)owners[i]);
  SB_CHECK(2 * one->edges->n == 3 * one->nfacet, "%d edges of %d facets", (int)one->edges->n,
           (int)one->nfacet);
  PetscCall(PetscFree(owners));
  PetscCall(PetscFree2(where, here));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Updates, and checks what the rank sees. */
static PetscErrorCode look(Case *c, PetscBool moving, PetscReal reach, PetscBool self, PetscInt *npair)
{
  PetscBool close;
  Whole w;

  PetscFunctionBeginUser;
  PetscCall(SbContactSurfaceUpdate(c->s, moving ? c->u0 : NULL, c->u, reach, self, &close));
  SB_CHECK(close, "the bodies are close");
  SB_CHECK((c->s->scene.x0 != NULL) == moving && (c->s->scene.p0 != NULL) == moving, "start of the step");
  SB_CHECK(c->s->scene.reach == reach && c->s->scene.self == self, "what the scene says");
  PetscCall(gather(c, &w));
  check_facets(c, &w);
  PetscCall(check_seen(c, &w, npair));
  PetscCall(free_whole(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbHalo *halo_of(const Case *c)
{
  return &((const SbContactSurfaceData *)c->s->data)->halo;
}

/* Many small steps: some lists, never one that is too old; the version tells whether the facets are other ones. */
static PetscErrorCode test_steps(Case *c, PetscInt *nchange)
{
  const PetscInt first = halo_of(c)->nbuild, nstep = 12;
  PetscInt *before, changes = 0, npair;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(PetscMalloc1(4 * c->m->mesh->Ncell, &before));
  for (PetscInt step = 0; step < nstep; step++) {
    const PetscInt version = c->s->scene.version, nfacet = c->s->scene.nfacet;
    PetscBool same;

    PetscCall(PetscArraycpy(before, c->s->scene.facet_id, nfacet));
    PetscCall(PetscArraycpy(c->u0, c->u, 3 * c->m->space->nnode));
    PetscCall(
      fill(c, (int)(3 + step % 2), 0.02, 0.03 + 0.025 * (PetscReal)step, 0.002 * (PetscReal)step, c->u));
    PetscCall(look(c, PETSC_TRUE, 0.05, PETSC_FALSE, &npair));
    same = (PetscBool)(nfacet == c->s->scene.nfacet);
    for (PetscInt f = 0; f < nfacet && same; f++) same = (PetscBool)(before[f] == c->s->scene.facet_id[f]);
    SB_CHECK((version == c->s->scene.version) == same, "version %d after %d, the facets are %s",
             (int)c->s->scene.version, (int)version, same ? "the same" : "other ones");
    changes += !same;
  }
  PetscCall(PetscFree(before));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &changes, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  *nchange += changes;
  if (size > 1)
    SB_CHECK(halo_of(c)->nbuild > first && halo_of(c)->nbuild < first + nstep, "%d lists in %d steps",
             (int)(halo_of(c)->nbuild - first), (int)nstep);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_motion(const char *options, PetscReal area, PetscInt *nchange)
{
  Case c, alone;
  PetscInt npair, same, nbuild, version;
  PetscBool close;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCall(open_on(PETSC_COMM_SELF, options, 0, &alone));
  PetscCall(open_on(PETSC_COMM_WORLD, options, 0, &c));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (int k = 0; k < 2; k++) {
    Case *x = k ? &alone : &c;

    PetscCall(fill(x, 1, 0.01, 0, 0, x->u0));
    PetscCall(fill(x, 2, 0.01, 0.03, 0, x->u));
    PetscCall(look(x, PETSC_TRUE, 0.05, PETSC_FALSE, k ? &same : &npair));
  }
  SB_CHECK(npair > 20 && npair == same, "%d pairs, %d on one rank", (int)npair, (int)same);
  SB_CHECK_NEAR(c.s->edge, alone.s->edge, 1e-14, "mean edge");
  SB_CHECK(c.s->size == alone.s->size && c.s->edge > 0, "size");
  PetscCall(check_points(&c, &alone, area));
  PetscCall(check_edges(&c, &alone));

  /* other places, hardly moved: the same list; less reach asks for nothing new */
  nbuild = halo_of(&c)->nbuild;
  version = c.s->scene.version;
  SB_CHECK(nbuild == (size > 1), "%d lists", (int)nbuild);
  PetscCall(fill(&c, 2, 0.012, 0.03, 0, c.u));
  PetscCall(look(&c, PETSC_TRUE, 0.05, PETSC_FALSE, &npair));
  PetscCall(look(&c, PETSC_FALSE, 0.04, PETSC_FALSE, &npair));
  SB_CHECK(halo_of(&c)->nbuild == nbuild && c.s->scene.version == version, "a list made without need");

  PetscCall(test_steps(&c, nchange));

  /* torn apart: copies of a vertex are farther from each other than any margin */
  PetscCall(fill(&c, 4, 0.2, 0, 0, c.u));
  PetscCall(look(&c, PETSC_FALSE, 0.01, PETSC_FALSE, &npair));
  PetscCall(fill(&c, 5, 0.02, 0.3, 0, c.u));

  /* more reach, self-contact */
  nbuild = halo_of(&c)->nbuild;
  PetscCall(look(&c, PETSC_TRUE, 0.4, PETSC_FALSE, &npair));
  SB_CHECK(halo_of(&c)->nbuild == nbuild + (size > 1), "the reach has grown");
  PetscCall(look(&c, PETSC_TRUE, 0.05, PETSC_TRUE, &npair));
  SB_CHECK(halo_of(&c)->nbuild == nbuild + 2 * (size > 1), "self-contact");

  PetscCall(fill(&alone, 4, 0.2, 0, 0, alone.u));
  PetscCall(fill(&c, 4, 0.2, 0, 0, c.u));
  PetscCall(look(&c, PETSC_FALSE, 0.02, PETSC_TRUE, &npair));
  PetscCall(look(&alone, PETSC_FALSE, 0.02, PETSC_TRUE, &npair));
  PetscCall(check_edges(&c, &alone));

  /* apart */
  PetscCall(fill(&c, 2, 0.01, 0, 0.5, c.u));
  PetscCall(SbContactSurfaceUpdate(c.s, c.u, c.u, 0.05, PETSC_FALSE, &close));
  SB_CHECK(!close && c.s->scene.nfacet == c.s->nfacet_owned, "apart, with %d facets of others",
           (int)(c.s->scene.nfacet - c.s->nfacet_owned));
  nbuild = halo_of(&c)->nbuild;
  PetscCall(SbContactSurfaceUpdate(c.s, c.u, c.u, 0.05, PETSC_FALSE, &close));
  SB_CHECK(!close && halo_of(&c)->nbuild == nbuild, "apart");
  /* within the step one passed the other */
  PetscCall(fill(&c, 2, 0.01, 0, -0.5, c.u0));
  PetscCall(look(&c, PETSC_TRUE, 0.05, PETSC_FALSE, &npair));
  SB_CHECK(npair > 0, "a motion through a body is not seen");
  PetscCall(close_case(&c));
  PetscCall(close_case(&alone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ special surfaces */

/* At rest: normals of a box. Those of centroids and of vertices inside a side are the side's. */
static PetscErrorCode test_normals(const char *element)
{
  const PetscReal high[3] = {1, 0.8, 0.3};
  char options[1024];
  PetscBool close;
  Case c;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(options, sizeof(options),
                          SETS "-bodies a" BODY("a", "%s", "box:1,0.8,0.3:3", "0,0,0"), element));
  PetscCall(open_on(PETSC_COMM_WORLD, options, 0, &c));
  PetscCall(SbContactSurfaceUpdate(c.s, NULL, c.u, 0.1, PETSC_FALSE, &close));
  SB_CHECK(!close, "one body is not close to another");
  for (PetscInt i = 0; i < c.s->scene.npoint; i++) {
    const PetscReal *x = c.s->scene.p + 3 * i, *n = c.s->scene.p_normal + 3 * i;
    PetscReal side[3];
    int nside = 0;

    for (int k = 0; k < 3; k++) {
      side[k] = x[k] > high[k] - 1e-12 ? 1 : x[k] < 1e-12 ? -1 : 0;
      nside += side[k] != 0;
    }
    SB_CHECK(nside >= 1, "a point inside the body");
    for (int k = 0; k < 3; k++) {
      if (nside == 1) SB_CHECK_NEAR(n[k], side[k], 1e-14, "normal of a side");
      if (nside > 1)
        SB_CHECK(side[k] != 0 ? n[k] * side[k] > 0.1 : PetscAbsReal(n[k]) < 1e-14, "normal %g", (double)n[k]);
    }
  }
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only the undersides: areas are theirs, ranks may be without facets, and they meet nothing but in self-contact. */
static PetscErrorCode test_part(const char *options, PetscReal area)
{
  Case c, alone;
  PetscInt npair;
  PetscBool close;

  PetscFunctionBeginUser;
  PetscCall(open_on(PETSC_COMM_SELF, options, 1, &alone));
  PetscCall(open_on(PETSC_COMM_WORLD, options, 1, &c));
  for (int k = 0; k < 2; k++) {
    Case *x = k ? &alone : &c;

    PetscCall(fill(x, 1, 0.01, 0, 0, x->u));
    PetscCall(SbContactSurfaceUpdate(x->s, NULL, x->u, 0.05, PETSC_FALSE, &close));
    SB_CHECK(!close, "one part");
  }
  PetscCall(check_points(&c, &alone, area));
  PetscCall(fill(&c, 1, 0.01, 0, 0, c.u0));
  PetscCall(close_case(&alone));
  PetscCall(SbContactSurfaceUpdate(c.s, NULL, c.u, 0.05, PETSC_TRUE, &close));
  {
    Whole w;

    PetscCall(gather(&c, &w));
    check_facets(&c, &w);
    PetscCall(check_seen(&c, &w, &npair));
    PetscCall(free_whole(&w));
  }
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facets of all ranks: those that came from others, own ones, those that were sent. */
static PetscErrorCode count_facets(const Case *c, PetscInt n[3])
{
  PetscFunctionBeginUser;
  n[0] = c->s->scene.nfacet - c->s->nfacet_owned;
  n[1] = c->s->nfacet_owned;
  n[2] = halo_of(c)->to_start[halo_of(c)->nto];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 3, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two long bars that overlap at their ends: what moves is a small part of the surface, also while one slides along the other. */
static PetscErrorCode test_local(void)
{
  const PetscInt nstep = 40;
  PetscInt n[3], npair;
  PetscMPIInt size;
  Case c;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(open_on(PETSC_COMM_WORLD,
                    SETS "-bodies a,b" BODY("a", "p1", "box:4,0.4,0.4:4", "0,0,0")
                      BODY("b", "p1", "box:4,0.4,0.4:4", "3.8,0,0.41"),
                    0, &c));
  PetscCall(look(&c, PETSC_FALSE, 0.02, PETSC_FALSE, &npair));
  PetscCall(count_facets(&c, n));
  SB_CHECK(n[0] == n[2], "%d facets are sent, %d arrive", (int)n[2], (int)n[0]);
  SB_CHECK(npair > 20 && (size == 1 || n[0] > 20), "%d pairs, %d facets", (int)npair, (int)n[0]);
  SB_CHECK(20 * n[0] < n[1], "%d of %d facets are sent", (int)n[0], (int)n[1]);
  for (PetscInt step = 1; step <= nstep; step++) {
    PetscCall(PetscArraycpy(c.u0, c.u, 3 * c.m->space->nnode));
    PetscCall(fill(&c, 1, 0, -0.02 * (PetscReal)step, 0, c.u));
    PetscCall(look(&c, PETSC_TRUE, 0.02, PETSC_FALSE, &npair));
  }
  PetscCall(count_facets(&c, n));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  bars: %d facets, %d sent, %d lists in %d steps\n", (int)n[1],
                        (int)n[0], (int)halo_of(&c)->nbuild, (int)nstep));
  if (size > 1)
    SB_CHECK(halo_of(&c)->nbuild > 3 && 2 * halo_of(&c)->nbuild < nstep, "%d lists in %d steps",
             (int)halo_of(&c)->nbuild, (int)nstep);
  SB_CHECK(4 * n[0] < n[1], "%d of %d facets are sent", (int)n[0], (int)n[1]);
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* More ranks than tets. */
static PetscErrorCode test_few(const char *element)
{
  char options[1024];
  PetscInt npair;
  Case c;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(options, sizeof(options),
                          SETS "-bodies a,b" BODY("a", "%s", "tests/data/one_tet.msh", "0,0,0")
                            BODY("b", "%s", "tests/data/one_tet.msh", "0,0,-0.52"),
                          element, element));
  PetscCall(open_on(PETSC_COMM_WORLD, options, 0, &c));
  PetscCall(look(&c, PETSC_FALSE, 0.1, PETSC_FALSE, &npair));
  SB_CHECK(npair > 0, "no pair");
  PetscCall(look(&c, PETSC_FALSE, 0.1, PETSC_TRUE, &npair));
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg"};
  const PetscReal a = 2 * (1 * 0.8 + 1 * 0.3 + 0.8 * 0.3), b = 2 * (0.6 * 0.5 + 0.6 * 0.4 + 0.5 * 0.4);
  PetscInt nchange = 0;
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_motion(PAIR("p1", "p1"), a + b, &nchange));
  PetscCall(test_motion(PAIR("cr", "cr"), a + b, &nchange));
  PetscCall(test_motion(PAIR("dg", "dg"), a + b, &nchange));
  PetscCall(test_motion(SETS "-bodies a,b,c" BODY("a", "p1", "box:1,0.8,0.3:3", "0,0,0")
                          BODY("b", "cr", "box:0.6,0.5,0.4:2", "0.2,0.1,0.32")
                            BODY("c", "dg", "box:0.6,0.5,0.4:2", "0.1,0.2,0.74"),
                        a + 2 * b, &nchange));
  for (int k = 0; k < 3; k++) {
    PetscCall(test_normals(elements[k]));
    PetscCall(test_few(elements[k]));
  }
  PetscCall(test_part(PAIR("p1", "p1"), 0.8));
  PetscCall(test_part(PAIR("cr", "dg"), 0.8));
  PetscCall(test_local());
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  SB_CHECK((nchange > 0) == (size > 1), "the facets were other ones %d times", (int)nchange);
  SB_TEST_END();
}
