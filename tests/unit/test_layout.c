// @ranks 1 2 3 4
/*
  Nodes of a space: P1 at vertices, P2 at vertices and edges, CR one per face, DG four per cell and
  one for each constrained face, also mixed in one space. Their number, positions and sharing by
  cells and ranks, equal on one rank and on several.
*/
#include "../scene.h"

#define BODY(name, element, at)                                                            \
  " -body_" name "_mesh box:0.5,0.4,0.3:2 -body_" name "_translate 0,0," at " -body_" name \
  "_material corotated -body_" name "_young 1e5 -body_" name "_poisson 0.3 -body_" name    \
  "_density 1000"                                                                          \
  " -body_" name "_element " element
#define SETS                                                                         \
  " -sets low,ball -set_low_at plane:0,0,1,0 -set_ball_at sphere:0.25,0.2,0.15,0.16" \
  " -effects clamp,push -effect_clamp_type fixed -effect_clamp_on low"               \
  " -effect_push_type fixed -effect_push_on ball -effect_push_components y"

static const char *const scenes[] = {
  "-bodies a" BODY("a", "p1", "0") SETS,
  "-bodies a" BODY("a", "cr", "0") SETS,
  "-bodies a" BODY("a", "dg", "0") SETS,
  "-bodies a,b,c,d" BODY("a", "dg", "0") BODY("b", "p1", "1") BODY("c", "cr", "2")
    BODY("d", "dg", "3") SETS,
  "-bodies a" BODY("a", "p2", "0") SETS,
  "-bodies a,b,c,d" BODY("a", "dg", "0") BODY("b", "p2", "1") BODY("c", "p1", "2")
    BODY("d", "cr", "3") SETS,
};

static PetscErrorCode open_on(MPI_Comm comm, const char *options, SbModel *m)
{
  PetscFunctionBeginUser;
  PetscCall(test_options(options));
  PetscCall(SbSceneCreate(comm, m));
  PetscCall(SbModelSetUp(*m));
  PetscCall(SbMeshValidate((*m)->mesh));
  PetscCall(SbSpaceValidate((*m)->space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt expected_nodes(SbModel m)
{
  PetscInt n = 0;

  for (PetscInt b = 0; b < m->mesh->nbody; b++) {
    const SbBody *body = &m->mesh->body[b];
    const PetscInt *per = m->space->element[b]->nodes_per;

    /* each interior face belongs to two cells; a box has vertices - edges + faces - cells = 1 */
    if (per[1])
      n += body->nvert + (4 * body->ncell + body->nfacet) / 2 - body->ncell - 1;
    n += per[0] ? body->nvert : per[3] ? 4 * body->ncell : (4 * body->ncell + body->nfacet) / 2;

    /* the first body is fixed on a plane: 3 x 3 squares of two triangles */
    if (b == 0 && per[3])
      n += 18;
  }
  return n;
}

/* Cells: node a is where the element defines it; the two cells of a face share its node in CR and
   not in DG. */
static void check_cells(SbModel m)
{
  const SbMesh mesh = m->mesh;
  const SbSpace s = m->space;

  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt *v = mesh->cell + 4 * (i / 4);
    const PetscInt *per = SbSpaceCellElement(s, i / 4)->nodes_per;
    const PetscInt node = s->cell_node[i];
    const PetscInt other = s->faces ? s->mesh->neighbour[i] : -1;

    SB_CHECK(node >= 0 && node < s->nnode, "node %d of %d", (int)node, (int)s->nnode);
    SB_CHECK(s->node_body[node] == mesh->cell_body[i / 4], "a node belongs to another body");
    for (int k = 0; k < 3; k++) {
      PetscReal sum = 0.;

      for (PetscInt a = 0; a < 4; a++)
        sum += (a == i % 4) == (per[0] > 0) ? mesh->x[3 * v[a] + k] : 0.;
      SB_CHECK_NEAR(s->node_x[3 * node + k], per[0] ? sum : sum / 3., 1e-15, "place of a node");
    }
    for (PetscInt e = 0; per[1] && i % 4 == 0 && e < 6; e++) {
      const PetscInt at = SbSpaceCellNode(s, i / 4, 4 + e);

      SB_CHECK(at >= 0 && at < s->nnode && s->node_body[at] == mesh->cell_body[i / 4],
               "node %d at an edge", (int)at);
      for (int k = 0; k < 3; k++)
        SB_CHECK_NEAR(s->node_x[3 * at + k],
                      0.5 *
                        (mesh->x[3 * v[SbTetEdge[e][0]] + k] + mesh->x[3 * v[SbTetEdge[e][1]] + k]),
                      1e-15, "place of a node at an edge");
    }
    if (other < 0 || per[0])
      continue;
    PetscInt same = 0;
    for (PetscInt a = 0; a < 4; a++)
      same += s->cell_node[4 * other + a] == node;
    SB_CHECK(same == (per[2] > 0), "the cell across a face has its node %d times", (int)same);
  }
}

/* Description of an owned node, at 8 node_orig: position, mass, sets, body, prescribed components,
   and one as a count. */
static PetscErrorCode describe(SbModel m, PetscInt n, PetscReal **table)
{
  const SbSpace s = m->space;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(8 * n, table));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal *row = *table + 8 * s->node_orig[i];

    SB_CHECK(s->node_orig[i] >= 0 && s->node_orig[i] < n, "number %d", (int)s->node_orig[i]);
    for (int k = 0; k < 3; k++)
      row[k] += s->node_x[3 * i + k];
    row[3] += s->node_mass[i];
    row[4] += (PetscReal)s->node_set[i];
    row[5] += (PetscReal)s->node_body[i];
    row[6] += s->fixed[i];
    row[7] += 1.;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, *table, (PetscMPIInt)(8 * n), MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every node has one owner, and the space of all ranks has the same nodes as the space of one
   rank. */
static PetscErrorCode compare(SbModel m, SbModel alone)
{
  const PetscInt n = m->mesh->Nvert + 14 * m->mesh->Ncell;
  PetscReal *one, *all;
  PetscReal mass = 0.;
  PetscInt count = 0;
  PetscInt fixed = 0;
  PetscInt in_set = 0;

  PetscFunctionBeginUser;
  PetscCall(describe(alone, n, &one));
  PetscCall(describe(m, n, &all));
  for (PetscInt i = 0; i < n; i++) {
    SB_CHECK(all[8 * i + 7] == one[8 * i + 7] && one[8 * i + 7] <= 1.,
             "number %d belongs to %g nodes", (int)i, all[8 * i + 7]);
    for (int k = 0; k < 7; k++)
      SB_CHECK_NEAR(all[8 * i + k], one[8 * i + k], 1e-15 * PetscAbsReal(one[8 * i + k]),
                    "node on several ranks");
    count += one[8 * i + 7] > 0.;
    fixed += one[8 * i + 6] > 0.;
    in_set += one[8 * i + 4] > 0.;
    mass += one[8 * i + 3];
  }
  SB_CHECK(count == expected_nodes(m) && m->space->Nnode == count && alone->space->Nnode == count,
           "%d nodes, and the space has %d, the meshes %d", (int)count, (int)m->space->Nnode,
           (int)expected_nodes(m));
  SB_CHECK(fixed > 0 && fixed < count && in_set == fixed, "%d nodes are constrained, %d in sets",
           (int)fixed, (int)in_set);
  SB_CHECK_NEAR(mass, 1000. * 0.5 * 0.4 * 0.3 * (PetscReal)m->mesh->nbody, 1e-12 * mass,
                "mass of all nodes");
  PetscCall(PetscFree(one));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ghost nodes match their owners: positions sent by the owners equal the local ones. */
static PetscErrorCode check_ghosts(SbSpace s)
{
  const PetscReal *x;
  PetscScalar *own;
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &X));
  PetscCall(VecGetArray(X, &own));
  PetscCall(PetscArraycpy(own, s->node_x, 3 * s->nnode_owned));
  PetscCall(VecRestoreArray(X, &own));
  PetscCall(SbSpaceGetLocalRead(s, X, &x));
  for (PetscInt i = 0; i < 3 * s->nnode; i++)
    SB_CHECK_NEAR(x[i], s->node_x[i], 1e-15, "place of a ghost");
  PetscCall(SbSpaceRestoreLocalRead(s, X, &x));
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Means of DG: a node and the one across its face, or its support, have the same position. */
static void check_cliques(SbSpace s)
{
  PetscBool broken = PETSC_FALSE;

  for (PetscInt r = 0; r < s->nregion; r++)
    broken = (PetscBool)(broken || s->region[r].broken);
  SB_CHECK(s->width >= (broken ? 8 : 4), "width %d", (int)s->width);
  if (s->width == 4)
    SB_CHECK(!s->batch_weight, "weights without dg");
  for (PetscInt k = 0; s->width == 8 && k < 4 * SB_BATCH * s->nbatch; k++) {
    const PetscInt b = k / (4 * SB_BATCH);
    const PetscInt a = k / SB_BATCH % 4;
    const PetscInt l = k % SB_BATCH;
    const PetscInt *node = s->batch_clique + 8 * SB_BATCH * b + SB_BATCH * a + l;
    const PetscInt cell = s->batch_cell[b] + l;
    const PetscReal weight = s->batch_weight[4 * b + a][l];

    if (l >= s->batch_n[b])
      continue;
    SB_CHECK(node[0] == s->cell_node[4 * cell + a], "own node of a clique");
    if (s->dirichlet_node && s->dirichlet_node[4 * cell + a] >= 0) {
      SB_CHECK(node[4 * SB_BATCH] == s->dirichlet_node[4 * cell + a] && weight == 0. &&
                 s->fixed[s->dirichlet_node[4 * cell + a]] == 7,
               "a held face has weight %g", weight);
    } else if (!SbSpaceCellElement(s, cell)->nodes_per[3] || s->mesh->neighbour[4 * cell + a] < 0) {
      SB_CHECK(node[4 * SB_BATCH] == node[0] && weight == 1.,
               "a side without another has weight %g", weight);
    } else {
      SB_CHECK(node[4 * SB_BATCH] != node[0] && weight > 0. && weight < 1., "weight %g", weight);
    }
    for (int i = 0; i < 3; i++)
      SB_CHECK_NEAR(s->node_x[3 * node[4 * SB_BATCH] + i], s->node_x[3 * node[0] + i], 1e-15,
                    "node across a face");
  }
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(scenes); k++) {
    SbModel m, alone;

    PetscCall(open_on(PETSC_COMM_SELF, scenes[k], &alone));
    PetscCall(open_on(PETSC_COMM_WORLD, scenes[k], &m));
    check_cells(m);
    PetscCall(check_ghosts(m->space));
    check_cliques(m->space);
    PetscCall(compare(m, alone));
    test_print("  scene %d: %d cells, %d vertices, %d nodes\n", (int)k, (int)m->mesh->Ncell,
               (int)m->mesh->Nvert, (int)m->space->Nnode);
    PetscCall(SbModelDestroy(&m));
    PetscCall(SbModelDestroy(&alone));
  }
  SB_TEST_END();
}
