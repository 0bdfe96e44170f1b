/*
  lid.c - lids over the openings of a cavity (cavity.c): fans of triangles around the mean of the
  vertices of a rim.

  The mean moves with the rim, which so bears what presses on the lid. A triangle with the corners
  x_0 (the mean), x_1, x_2, N = (x_1 - x_0) x (x_2 - x_0) and a pressure p has the force -p N / 6 at
  each of them, as a flat facet has; with e_a the side across from a corner the symmetric part of
  the derivative of minus that is p / 12 [e_b - e_a]x. Over a closed surface that is all of it. The
  curved edges of P2 are straight here.
*/
#include "lid.h"
#include "sbgeometry.h"

PetscErrorCode SbWallGather(SbSpace space, PetscInt nfacet, const SbFacet facets[], PetscInt *n,
                            SbWallFacet **facet)
{
  const SbMesh mesh = space->mesh;
  PetscInt nmine = 0;
  SbWallFacet *mine;
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(nfacet, &mine));
  for (const SbFacet *f = facets; f < facets + nfacet; f++) {
    if (f->cell >= mesh->ncell_owned)
      continue;
    for (int c = 0; c < 3; c++) {
      mine[nmine].vertex[c] = mesh->gvert[f->vertex[c]];
      mine[nmine].node[c] = space->gnode[SbSpaceCellNode(space, f->cell, f->corner[c])];
      for (int k = 0; k < 3; k++)
        mine[nmine].x[c][k] = mesh->x[3 * f->vertex[c] + k];
    }
    nmine++;
  }
  PetscCallMPI(MPI_Type_contiguous((int)sizeof(SbWallFacet), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(SbAllgatherv(space->comm, type, nmine, mine, n, facet, NULL));
  PetscCallMPI(MPI_Type_free(&type));
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLidsFind(SbLids *lids, SbEffect e, MPI_Comm comm, PetscInt n,
                          const SbWallFacet facet[], PetscInt nnode, const PetscInt all[])
{
  PetscInt nedge = 0;
  PetscInt *from, *to; /* [nedge] nodes of the edges of all rims */
  PetscBool *done;
  SbKey *key;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(3 * n, &key, 3 * n, &from, 3 * n, &to, 3 * n, &done));
  for (PetscInt i = 0; i < 3 * n; i++)
    key[i] = (SbKey){SbKeyOfPair(facet[i / 3].node[i % 3], facet[i / 3].node[(i + 1) % 3]), i};
  SbKeysSort(3 * n, key);
  for (PetscInt i = 0, m; i < 3 * n; i += m) {
    const PetscInt f = key[i].slot / 3;
    const PetscInt k = key[i].slot % 3;

    m = SbKeysAlike(3 * n, key, i);
    if (m != 1)
      continue;
    from[nedge] = facet[f].node[(k + 1) % 3];
    to[nedge] = facet[f].node[k];
    done[nedge++] = PETSC_FALSE;
  }
  PetscCall(PetscSortIntWithArray(nedge, from, to));

  /* around each rim */
  for (PetscInt i = 0; i < nedge; i++) {
    PetscInt size = 0;
    PetscInt at = i;
    SbLid lid = {0};

    while (!done[at]) {
      PetscInt next;

      PetscCall(SbReserve(lid.n + 1, sizeof(*lid.node), &size, &lid.node));
      PetscCall(PetscFindInt(from[at], nnode, all, &lid.node[lid.n++]));
      done[at] = PETSC_TRUE;

      /* the edge that begins where this one ends, the only one */
      PetscCall(PetscFindInt(to[at], nedge, from, &next));
      PetscCheck(next >= 0 && (next == 0 || from[next - 1] != to[at]) &&
                   (next == nedge - 1 || from[next + 1] != to[at]),
                 comm, PETSC_ERR_USER_INPUT,
                 "%s: rims of this surface touch each other at a vertex, so that no lid closes "
                 "them: take another set of facets",
                 e->on.option);
      at = next;
    }
    if (!lid.n)
      continue;
    PetscCall(SbReserve(lids->n + 1, sizeof(lid), &lids->size, &lids->lid));
    lids->lid[lids->n++] = lid;
  }
  PetscCall(PetscFree4(key, from, to, done));
  PetscCheck(lids->n > 0, comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_lids: the surface of %s has no opening: leave it out", e->name,
             e->on.option);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The place of a vertex of a lid's triangle i: 0 the middle, 1 and 2 those of the rim. */
static void lid_places(SbSpace space, PetscInt number, const SbLid *lid, PetscInt i,
                       const PetscReal middle[3], const PetscReal u[], PetscReal x[3][3])
{
  const PetscInt *node = space->couplings.node + space->couplings.start[number];

  for (int k = 0; k < 3; k++)
    x[0][k] = middle[k];
  for (int v = 0; v < 2; v++) {
    const PetscInt a = node[lid->node[(i + v) % lid->n]];

    for (int k = 0; k < 3; k++)
      x[1 + v][k] = space->node_x[3 * a + k] + (u ? u[3 * a + k] : 0);
  }
}

static void lid_middle(SbSpace space, PetscInt number, const SbLid *lid, const PetscReal u[],
                       PetscReal middle[3])
{
  const PetscInt *node = space->couplings.node + space->couplings.start[number];

  middle[0] = middle[1] = middle[2] = 0;
  for (PetscInt i = 0; i < 3 * lid->n; i++) {
    const PetscInt k = 3 * node[lid->node[i / 3]] + i % 3;

    middle[i % 3] += (space->node_x[k] + (u ? u[k] : 0)) / (PetscReal)lid->n;
  }
}

PetscReal SbLidsInside(const SbLids *lids, SbSpace space, PetscInt number, const PetscReal u[])
{
  PetscReal sum = 0;

  if (number < 0 || space->couplings.node[space->couplings.start[number]] >= space->nnode_owned)
    return 0;
  for (const SbLid *lid = lids->lid; lid < lids->lid + lids->n; lid++) {
    PetscReal middle[3];

    lid_middle(space, number, lid, u, middle);
    for (PetscInt i = 0; i < lid->n; i++) {
      PetscReal x[3][3], cross[3];

      lid_places(space, number, lid, i, middle, u, x);
      SbCross(x[1], x[2], cross);
      sum += SbDot3(x[0], cross) / 6;
    }
  }
  return sum;
}

void SbLidsPush(const SbLids *lids, SbSpace space, PetscInt number, PetscReal p,
                const PetscReal u[], PetscReal f[])
{
  for (const SbLid *lid = lids->lid; lid < lids->lid + lids->n && number >= 0; lid++) {
    const PetscInt *node = space->couplings.node + space->couplings.start[number];
    PetscReal middle[3];

    lid_middle(space, number, lid, u, middle);
    for (PetscInt i = 0; i < lid->n; i++) {
      PetscReal x[3][3], side[2][3], N[3];

      lid_places(space, number, lid, i, middle, u, x);
      SbSubtract(x[1], x[0], side[0]);
      SbSubtract(x[2], x[0], side[1]);
      SbCross(side[0], side[1], N);
      for (int k = 0; k < 3; k++) {
        f[3 * node[lid->node[i]] + k] -= p / 6 * N[k];
        f[3 * node[lid->node[(i + 1) % lid->n]] + k] -= p / 6 * N[k];
        for (PetscInt a = 0; a < lid->n; a++)
          f[3 * node[lid->node[a]] + k] -= p / 6 * N[k] / (PetscReal)lid->n;
      }
    }
  }
}

/* K[3 n][3 n] += `factor` times a 3 by 3 matrix for two nodes of a lid's triangle: number of the
   coupling, or -1, its middle. */
static void add_pair(const SbLid *lid, PetscInt a, PetscInt b, PetscReal factor,
                     const PetscReal B[9], PetscInt n, PetscReal K[])
{
  const PetscInt na = a < 0 ? lid->n : 1;
  const PetscInt nb = b < 0 ? lid->n : 1;

  for (PetscInt i = 0; i < na; i++)
    for (PetscInt j = 0; j < nb; j++)
      for (int k = 0; k < 9; k++)
        K[3 * n * (3 * (a < 0 ? lid->node[i] : a) + k / 3) + 3 * (b < 0 ? lid->node[j] : b) +
          k % 3] += factor / (PetscReal)(na * nb) * B[k];
}

void SbLidsTurn(const SbLids *lids, SbSpace space, PetscInt number, PetscReal factor,
                const PetscReal u[], PetscInt n, PetscReal K[])
{
  for (const SbLid *lid = lids->lid; lid < lids->lid + lids->n; lid++) {
    PetscReal middle[3];

    lid_middle(space, number, lid, u, middle);
    for (PetscInt i = 0; i < lid->n; i++) {
      const PetscInt at[3] = {-1, lid->node[i], lid->node[(i + 1) % lid->n]};
      PetscReal x[3][3];

      lid_places(space, number, lid, i, middle, u, x);
      for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
          PetscReal r[3];

          /* dN/dx_b = [e_b]x, e_b the side across from b: (e_b - e_a) / 2 of the symmetric part */
          for (int k = 0; k < 3; k++)
            r[k] = x[(b + 2) % 3][k] - x[(b + 1) % 3][k] - x[(a + 2) % 3][k] + x[(a + 1) % 3][k];
          add_pair(lid, at[a], at[b], factor / 12,
                   (const PetscReal[9]){0, -r[2], r[1], r[2], 0, -r[0], -r[1], r[0], 0}, n, K);
        }
    }
  }
}

PetscErrorCode SbLidsDestroy(SbLids *lids)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < lids->n; k++)
    PetscCall(PetscFree(lids->lid[k].node));
  PetscCall(PetscFree(lids->lid));
  PetscFunctionReturn(PETSC_SUCCESS);
}
