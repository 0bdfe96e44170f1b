/*
  The finite element space: nodes, regions of cells with one material law, and the cells' geometry
  in batches.

  Nodes are numbered on each rank with the owned ones first and the ghosts after them, which is the
  storage order of a ghosted PETSc vector: the global vector and the local array that the kernels
  read are the same memory, and an update moves ghost values only. With one layer of overlap every
  cell with an owned node is local, so a residual or a matrix row is complete without communication.

  Cells are grouped in regions (one body, one law, owned or ghost), each divided into batches of
  SB_BATCH cells with interleaved gradients and volumes. layout.c numbers the nodes; jump.c: face
  terms of CR and DG.
*/
#include "fem_impl.h"
#include <errno.h>
#include <unistd.h>

const SbOption SbSpaceRows[] = {
  {"mass", SB_OPTION_CHOICE, 1, "", "lumped", "lumped|consistent",
   "mass matrix: lumped at the nodes, or consistent with the basis"},
  {"displacement_view", SB_OPTION_STRING, 1, "", "", "",
   "a viewer of PETSc for the displacements at the end of the run, as -dm_view takes it: "
   "hdf5:FILE, vtk:FILE.vtu, ascii"},
  {0},
};

/* Whether a cell is a P2 cell with curved edges. */
static PetscBool is_curved(SbSpace s, PetscInt cell)
{
  return (PetscBool)(s->edge_node && s->mesh->edge_off && (s->mesh->cell_set[cell] & SB_CURVED));
}

/* Finds the regions and batches: owned and ghost cells are sorted by body, inclusion and curved
   edges, so that a region is a range of cells. */
static PetscErrorCode find_regions(SbSpace s)
{
  SbMesh mesh = s->mesh;
  PetscInt nmaterial = mesh->nbody;
  PetscInt most;
  SbRegion *r = NULL;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++)
    nmaterial += mesh->body[b].ninclusion;
  s->linear = PETSC_TRUE;
  for (PetscInt k = 0; k < nmaterial; k++)
    s->linear = (PetscBool)(s->linear && s->material[k]->linear);
  for (PetscInt k = 0; k < nmaterial; k++)
    s->positive = (PetscBool)(s->positive || s->material[k]->positive);
  PetscCall(PetscCalloc1(4 * nmaterial, &s->region));
  most = mesh->ncell / SB_BATCH + 4 * nmaterial;
  PetscCall(PetscMalloc3(most, &s->batch_region, most, &s->batch_cell, most, &s->batch_n));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const PetscInt body = mesh->cell_body[c];
    const PetscInt m = mesh->cell_material[c];

    if (c == 0 || c == mesh->ncell_owned || body != mesh->cell_body[c - 1] ||
        m != mesh->cell_material[c - 1] || is_curved(s, c) != is_curved(s, c - 1)) {
      r = &s->region[s->nregion++];
      *r = (SbRegion){.body = body, .material = s->material[m], .pointwise = s->material[m]};
      r->element = s->element[body];
      r->bstart = r->bend = s->nbatch;
      r->broken = (PetscBool)(r->element->nodes_per[3] > 0);
      r->quadratic = (PetscBool)(r->element->nodes_per[1] > 0);
      r->nnode = r->quadratic ? SB_CELL_NODES : 4;
      if (r->quadratic && r->element->mean_volume)
        PetscCall(SbMaterialGetPointwise(r->material, &r->pointwise));
    }
    if (r->bstart == r->bend || s->batch_n[s->nbatch - 1] == SB_BATCH) {
      s->batch_region[s->nbatch] = r;
      s->batch_cell[s->nbatch] = c;
      s->batch_n[s->nbatch] = 0;
      r->bend = ++s->nbatch;
      if (c < mesh->ncell_owned)
        s->nbatch_owned = s->nbatch;
    }
    s->batch_n[s->nbatch - 1]++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A curved P2 cell: at each point those of a P1 tet; fills lane l of batch b. */
static void tabulate_curved(SbSpace s, SbRegion *region, PetscInt b, PetscInt cell, PetscInt l)
{
  const PetscInt k = b - region->bstart;
  SbPack *g = region->curve_g + 9 * SB_POINTS * k;
  SbPack *weight = region->curve_weight + SB_POINTS * k;
  SbPack *mass = region->curve_mass + SB_CELL_NODES * k;
  PetscReal x[SB_CELL_NODES][3];
  PetscReal V = 0.;
  PetscReal sum = 0.;

  SbSpaceCellPositions(s, cell, x);
  for (int a = 0; a < SB_CELL_NODES; a++)
    mass[a][l] = 0.;
  for (int q = 0; q < SB_POINTS; q++) {
    PetscReal corner[4][3], grad[3][3], phi[SB_CELL_NODES];

    SbQuadraticCorners(SbRuleQuintic.L[q], (const PetscReal(*)[3])x, corner);
    region->element->ops.tabulate((const PetscReal(*)[3])corner, grad, &weight[q][l]);
    weight[q][l] *= SbRuleQuintic.weight[q];
    V += weight[q][l];
    for (int i = 0; i < 9; i++)
      g[9 * q + i][l] = grad[i / 3][i % 3];
    SbQuadraticBasis(SbRuleQuintic.L[q], phi);
    for (int a = 0; a < SB_CELL_NODES; a++)
      mass[a][l] += weight[q][l] * phi[a] * phi[a];
  }
  for (int q = 0; q < SB_POINTS; q++)
    weight[q][l] /= V;
  for (int a = 0; a < SB_CELL_NODES; a++)
    sum += mass[a][l];
  for (int a = 0; a < SB_CELL_NODES; a++)
    mass[a][l] /= sum;
  if (l < s->batch_n[b])
    s->batch_V[b][l] = V;
}

/* Gradients and volumes of each batch; padding lanes repeat the first cell with volume zero. */
static PetscErrorCode tabulate_batches(SbSpace s)
{
  const size_t each = SB_POINTS * 10 + SB_CELL_NODES;
  size_t packs = (size_t)s->nbatch * 10;
  SbPack *curve;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < s->nbatch; b++)
    packs += is_curved(s, s->batch_cell[b]) ? each : 0;
  PetscCall(PetscMalloc(packs * sizeof(SbPack) + 64, &s->batch_memory));
  s->batch_g = (SbPack *)(((uintptr_t)s->batch_memory + 63) & ~(uintptr_t)63);
  s->batch_V = s->batch_g + (size_t)s->nbatch * 9;
  curve = s->batch_V + s->nbatch;
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];
    const PetscInt n = region->bend - region->bstart;

    if (is_curved(s, s->batch_cell[region->bstart])) {
      region->curve_g = curve;
      region->curve_weight = region->curve_g + 9 * SB_POINTS * n;
      region->curve_mass = region->curve_weight + SB_POINTS * n;
      curve = region->curve_mass + SB_CELL_NODES * n;
    }

    PetscCall(PetscLogEventBegin(region->element->event, 0, 0, 0, 0));
    for (PetscInt b = region->bstart; b < region->bend; b++) {
      for (PetscInt l = 0; l < SB_BATCH; l++) {
        const PetscInt cell = s->batch_cell[b] + (l < s->batch_n[b] ? l : 0);
        PetscReal x[4][3], g[3][3], V;

        for (PetscInt k = 0; k < 12; k++)
          x[k / 3][k % 3] = s->mesh->x[3 * s->mesh->cell[4 * cell + k / 3] + k % 3];
        region->element->ops.tabulate((const PetscReal(*)[3])x, g, &V);

        /* the gradients of a rigid body are those of the tet of its nodes */
        if (region->element->rigid) {
          PetscReal unused;

          for (PetscInt k = 0; k < 12; k++)
            x[k / 3][k % 3] = s->node_x[3 * s->cell_node[4 * cell + k / 3] + k % 3];
          region->element->ops.tabulate((const PetscReal(*)[3])x, g, &unused);
        }
        for (PetscInt k = 0; k < 9; k++)
          s->batch_g[9 * b + k][l] = g[k / 3][k % 3];
        s->batch_V[b][l] = l < s->batch_n[b] ? V : 0.;
        if (region->curve_g)
          tabulate_curved(s, region, b, cell, l);
      }
    }
    PetscCall(PetscLogEventEnd(region->element->event, 0, 0, 0, 0));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The viewer TYPE:FILE:FORMAT:MODE exists, and its file can be written. */
static PetscErrorCode check_view(MPI_Comm comm, const char *viewer)
{
  PetscErrorCode (*create)(PetscViewer);
  PetscMPIInt rank;
  int failed = 0;
  char type[PETSC_MAX_PATH_LEN], *file, *end;

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(type, viewer, sizeof(type)));
  file = strchr(type, ':');
  if (file)
    *file++ = 0;
  PetscCall(PetscViewerInitializePackage());
  PetscCall(PetscFunctionListFind(PetscViewerList, type, &create));
  PetscCheck(create || !type[0], comm, PETSC_ERR_USER_INPUT,
             "PETSc has no viewer %s; take hdf5:FILE or vtk:FILE", type);
  if (file && (end = strchr(file, ':')))
    *end = 0;
  if (!file || !file[0])
    PetscFunctionReturn(PETSC_SUCCESS);

  /* appending leaves a file of an earlier run as it is */
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    const PetscBool there = (PetscBool)!access(file, F_OK);
    FILE *f = fopen(file, "ab");

    failed = f ? 0 : errno;
    if (f)
      (void)fclose(f);
    if (f && !there)
      (void)remove(file);
  }
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, comm));
  PetscCheck(!failed, comm, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s; give another path",
             file, strerror(failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -displacement_view, before anything is computed. */
static PetscErrorCode read_view(SbSpace s)
{
  char viewer[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCall(SbOptionString(&SbRunScope, "displacement_view", sizeof(viewer), viewer));
  s->view_displacement = (PetscBool)(viewer[0] != 0);
  if (s->view_displacement)
    PetscCall(check_view(s->comm, viewer));
  for (PetscInt b = 0; b < s->mesh->nbody; b++)
    PetscCheck(strncmp(viewer, "vtk", 3) || (!s->element[b]->nodes_per[2] && !s->element[b]->rigid),
               s->comm, PETSC_ERR_USER_INPUT,
               "-displacement_view %s: body '%s' has its displacements %s, which VTK files do "
               "not have; take hdf5:FILE, or the fields of -output_fields",
               viewer, s->mesh->body[b].name,
               s->element[b]->rigid ? "at four nodes of its own" : "at faces");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceCreate(SbMesh mesh, const SbMaterial material[], const SbElement element[],
                             SbSpace *space)
{
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SPACE_SETUP], 0, 0, 0, 0));
  PetscCall(PetscNew(&s));
  s->comm = mesh->comm;
  PetscCallMPI(MPI_Comm_rank(s->comm, &s->rank));
  PetscCallMPI(MPI_Comm_size(s->comm, &s->size));
  s->mesh = mesh;
  s->block_scale = 1.;
  PetscCall(SbOptionSecond(&SbRunScope, "mass", &s->consistent_mass));
  s->element = element;
  s->material = material;
  PetscCall(read_view(s));
  PetscCall(SbLayoutNodes(s));
  s->nnode_cell = s->nnode;
  PetscCall(find_regions(s));
  PetscCall(tabulate_batches(s));
  PetscCall(SbSpaceFindAxes(s));
  PetscCall(SbHistoryCreate(s));
  PetscCall(SbActiveCreate(s));
  PetscCall(SbEigenCreate(s));
  PetscCall(SbLayoutCliques(s));
  if (s->faces)
    PetscCall(SbJumpCreate(s, &s->jump));
  if (s->faces)
    PetscCall(PetscCalloc1(3 * mesh->nvert, &s->vertex_value));
  PetscCall(PetscCalloc3(s->nnode, &s->node_mass, mesh->nbody, &s->alpha, mesh->nbody, &s->beta));
  s->node_share = s->node_mass;
  if (s->edge_node)
    PetscCall(PetscCalloc1(s->nnode, &s->node_share));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbElementOps *e = &region->element->ops;
    const SbPack *curved =
      region->curve_mass ? (const SbPack *)region->curve_mass + SB_CELL_NODES * (b - region->bstart)
                         : NULL;

    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscReal m = region->material->density * s->batch_V[b][l];
      PetscReal share[SB_CELL_NODES];

      /* the integrals of the basis functions of P2 */
      for (int a = 0; a < SB_CELL_NODES; a++)
        share[a] = !region->quadratic ? e->mass_lumped : a < 4 ? -0.05 : 0.2;
      if (curved) {
        (void)SbSpaceCurvedIntegrals(s, s->batch_cell[b] + l, NULL, share);
        for (int a = 0; a < SB_CELL_NODES; a++)
          share[a] /= s->batch_V[b][l];
      }
      for (PetscInt a = 0; a < region->nnode; a++) {
        const PetscInt node = sb_batch_nodes(s, b)[a * SB_BATCH + l];

        s->node_mass[node] += m * (curved  ? curved[a][l]
                                   : a < 4 ? e->mass_lumped
                                           : e->mass_lumped_edge);
        if (s->edge_node)
          s->node_share[node] += share[a] * m;
      }
    }
  }
  s->ghosted = (PetscBool)(s->size > 1);
  if (!s->ghosted) {
    PetscCall(VecCreateSeq(s->comm, 3 * s->nnode, &s->template_vec));
    PetscCall(VecSetBlockSize(s->template_vec, 3));
  } else {
    PetscCall(VecCreateGhostBlock(s->comm, 3, 3 * s->nnode_owned, PETSC_DECIDE,
                                  s->nnode - s->nnode_owned, s->gnode + s->nnode_owned,
                                  &s->template_vec));
  }
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SPACE_SETUP], 0, 0, 0, 0));
  *space = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceDestroy(SbSpace *space)
{
  SbSpace s = *space;

  PetscFunctionBeginUser;
  if (!s)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbPlanDestroy(&s->plan));
  PetscCall(VecDestroy(&s->template_vec));
  PetscCall(SbConstraintsDestroy(&s->constraints));
  PetscCall(SbJumpDestroy(&s->jump));
  PetscCall(PetscFree(s->vertex_value));
  PetscCall(SbLayoutDestroy(s));
  PetscCall(PetscFree(s->batch_clique));
  PetscCall(PetscFree(s->batch_weight));
  PetscCall(PetscFree(s->couplings.start));
  PetscCall(PetscFree(s->couplings.node));
  for (PetscInt r = 0; r < s->nregion; r++) {
    PetscCall(PetscFree(s->region[r].stress));
    PetscCall(PetscFree(s->region[r].axes));
    PetscCall(SbViscousDestroy(&s->region[r]));
    PetscCall(SbMullinsDestroy(&s->region[r]));
    PetscCall(SbActiveDestroyRegion(&s->region[r]));
    PetscCall(SbEigenDestroyRegion(&s->region[r]));
  }
  PetscCall(PetscFree(s->region));
  PetscCall(PetscFree3(s->batch_region, s->batch_cell, s->batch_n));
  PetscCall(PetscFree(s->batch_memory));
  PetscCall(PetscFree(s->pressure));
  if (s->node_share != s->node_mass)
    PetscCall(PetscFree(s->node_share));
  PetscCall(PetscFree3(s->node_mass, s->alpha, s->beta));
  PetscCall(PetscFree2(s->fixed_node, s->fixed_value));
  PetscCall(PetscFree(*space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceValidate(SbSpace s)
{
  PetscReal sums[2] = {0., s->added_mass};
  PetscReal all[2];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscCheck(s->gnode[i] == s->gnode_start + i, PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "Owned node %" PetscInt_FMT " is out of order", i);
    PetscCheck(s->node_mass[i] > 0. || (s->dirichlet_node && s->fixed[i] == 7), PETSC_COMM_SELF,
               PETSC_ERR_PLIB, "Node %" PetscInt_FMT " has no mass", i);
    sums[0] += s->node_mass[i];
  }
  for (PetscInt i = s->nnode_owned + 1; i < s->nnode; i++)
    PetscCheck(s->gnode[i] > s->gnode[i - 1] || i == s->nnode_cell, PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "Ghost nodes are not sorted");
  for (PetscInt b = 0; b < s->nbatch_owned; b++)
    for (PetscInt l = 0; l < SB_BATCH; l++)
      sums[1] += s->batch_region[b]->material->density * s->batch_V[b][l];
  PetscCallMPI(MPI_Allreduce(sums, all, 2, MPIU_REAL, MPI_SUM, s->comm));

  /* the tolerance includes rounding, which grows with the number of equal terms */
  PetscCheck(PetscAbsReal(all[0] - all[1]) <=
               (1e-12 + PETSC_MACHINE_EPSILON * (PetscReal)s->mesh->Ncell) * all[1],
             s->comm, PETSC_ERR_PLIB, "Mass of the nodes %g kg, of the cells %g kg", (double)all[0],
             (double)all[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSpaceCellPositions(SbSpace s, PetscInt cell, PetscReal x[SB_CELL_NODES][3])
{
  for (PetscInt a = 0; a < SB_CELL_NODES; a++)
    for (int k = 0; k < 3; k++)
      x[a][k] = s->node_x[3 * SbSpaceCellNode(s, cell, a) + k];
}

PetscReal SbSpaceCurvedIntegrals(SbSpace s, PetscInt cell, const SbFacet *facet,
                                 PetscReal integral[SB_CELL_NODES])
{
  const SbPointRule *rule = facet ? &SbRuleFacet : &SbRuleQuintic;
  PetscReal x[SB_CELL_NODES][3];
  PetscReal sum = 0.;

  SbSpaceCellPositions(s, cell, x);
  for (int a = 0; a < SB_CELL_NODES; a++)
    integral[a] = 0.;
  for (int q = 0; q < rule->n; q++) {
    PetscReal L[4] = {0., 0., 0., 0.};
    PetscReal corner[4][3], e[3][3], normal[3], phi[SB_CELL_NODES], measure;

    /* the P1 tet or triangle with the map's derivatives at the point */
    for (int c = 0; c < (facet ? 3 : 4); c++)
      L[facet ? facet->corner[c] : c] = rule->L[q][c];
    SbQuadraticCorners(L, (const PetscReal(*)[3])x, corner);
    for (int c = 0; c < (facet ? 2 : 3); c++)
      SbSubtract(corner[facet ? facet->corner[c + 1] : c + 1], corner[facet ? facet->corner[0] : 0],
                 e[c]);
    SbCross(e[0], e[1], normal);
    measure = facet ? PetscSqrtReal(SbDot3(normal, normal)) / 2. : SbDot3(normal, e[2]) / 6.;
    SbQuadraticBasis(L, phi);
    for (int a = 0; a < SB_CELL_NODES; a++)
      integral[a] += rule->weight[q] * measure * phi[a];
    sum += rule->weight[q] * measure;
  }
  return sum;
}

PetscErrorCode SbSpaceFindSet(SbSpace s, const char *name, const char *where, PetscInt *k)
{
  const char *names[SB_SET_MAX];
  char near[256];

  PetscFunctionBeginUser;
  for (*k = 0; *k < s->mesh->nset; (*k)++) {
    PetscBool same;

    PetscCall(PetscStrcmp(s->mesh->set[*k].name, name, &same));
    if (same)
      PetscFunctionReturn(PETSC_SUCCESS);
    names[*k] = s->mesh->set[*k].name;
  }
  SbSuggestNames(name, s->mesh->nset, names, sizeof(near), near);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s names the set '%s', which does not exist%s%s", where,
          name, near[0] ? "; nearest: " : "", near);
}

PetscErrorCode SbSpaceGetSetFacets(SbSpace s, PetscInt k, PetscInt *n, SbFacet **facets)
{
  const uint64_t want = SB_ON_BOUNDARY | (k < 0 ? 0 : SB_SET_BIT(k));
  const SbMesh mesh = s->mesh;
  PetscInt count = 0;

  PetscFunctionBeginUser;
  for (PetscInt f = 0; f < 4 * mesh->ncell; f++)
    count += (mesh->face_set[f] & want) == want;
  PetscCall(PetscCalloc1(count, facets));
  *n = 0;
  for (PetscInt f = 0; f < 4 * mesh->ncell; f++) {
    const PetscInt cell = f / 4;
    const PetscInt face = f % 4;
    PetscReal x[3][3], up[3], length, integral[SB_CELL_NODES];
    SbFacet *facet;

    if ((mesh->face_set[f] & want) != want)
      continue;
    facet = &(*facets)[(*n)++];
    *facet = (SbFacet){.cell = cell, .face = face};
    for (PetscInt a = 0; a < 3; a++) {
      facet->corner[a] = SbFaceVertex[face][a];
      facet->vertex[a] = mesh->cell[4 * cell + facet->corner[a]];
      SbSubtract(mesh->x + 3 * facet->vertex[a], mesh->x + 3 * facet->vertex[0], x[a]);
    }
    SbSubtract(mesh->x + 3 * facet->vertex[0], mesh->x + 3 * mesh->cell[f], up);
    SbCross(x[1], x[2], facet->normal);
    length = SbNormalise(facet->normal);
    facet->area =
      is_curved(s, cell) ? SbSpaceCurvedIntegrals(s, cell, facet, integral) : 0.5 * length;
    facet->height = SbDot3(facet->normal, up);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpacePrescribeDone(SbSpace s)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode; i++)
    s->nfixed += s->fixed[i] != 0;
  PetscCall(PetscCalloc2(s->nfixed, &s->fixed_node, 3 * s->nfixed, &s->fixed_value));
  s->nfixed = 0;
  for (PetscInt i = 0; i < s->nnode; i++)
    if (s->fixed[i])
      s->fixed_node[s->nfixed++] = i;
  if (s->jump)
    PetscCall(SbJumpFindWalls(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAllPrescribed(SbSpace s, PetscBool *all)
{
  PetscFunctionBeginUser;
  *all = PETSC_TRUE;
  for (PetscInt i = 0; i < s->nnode_owned && *all; i++)
    *all = (PetscBool)(s->fixed[i] == 7);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, 1, SB_MPI_BOOL, MPI_LAND, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
