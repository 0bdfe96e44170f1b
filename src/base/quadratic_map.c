/*
  quadratic_map.c - P2 tet with ten nodes: basis, map, quadrature rules with positive weights on tet
  and facets.

  A tet with curved edges is x = sum_a phi_a(l) x_a. Its derivatives at the barycentric coordinates
  l are those of the P1 tet with the corners x_i' = (4 l_i - 1) x_i + sum_j 4 l_j x_ij, which thus
  has the gradients and the volume element (volume times weight) at that point. A constant stress is
  in equilibrium if the rule integrates grad phi_a det dx/dl, a polynomial of degree 3, exactly; the
  mean of grad phi_a det F det dx/dl and the mass matrix of linear fields require degree 5: 14
  points with positive weights (Walkington 2000), which leave no zero-energy modes and no massless
  modes.
*/
#include "sbkernel.h"

#define A 0.31088591926330060980
#define B 0.092735250310891226402
#define C 0.045503704125649649492
#define WA 0.11268792571801585080
#define WB 0.073493043116361949544
#define WC 0.042546020777081466438
const SbPointRule SbRuleQuintic = {SB_POINTS,
                                   {{1 - 3 * A, A, A, A},
                                    {A, 1 - 3 * A, A, A},
                                    {A, A, 1 - 3 * A, A},
                                    {A, A, A, 1 - 3 * A},
                                    {1 - 3 * B, B, B, B},
                                    {B, 1 - 3 * B, B, B},
                                    {B, B, 1 - 3 * B, B},
                                    {B, B, B, 1 - 3 * B},
                                    {0.5 - C, 0.5 - C, C, C},
                                    {0.5 - C, C, 0.5 - C, C},
                                    {0.5 - C, C, C, 0.5 - C},
                                    {C, 0.5 - C, 0.5 - C, C},
                                    {C, 0.5 - C, C, 0.5 - C},
                                    {C, C, 0.5 - C, 0.5 - C}},
                                   {WA, WA, WA, WA, WB, WB, WB, WB, WC, WC, WC, WC, WC, WC}};

#define P 0.10128650732345633  /* (6 - sqrt 15) / 21 */
#define Q 0.47014206410511505  /* (6 + sqrt 15) / 21 */
#define WP 0.12593918054482717 /* (155 - sqrt 15) / 1200 */
#define WQ 0.13239415278850616 /* (155 + sqrt 15) / 1200 */
const SbPointRule SbRuleFacet = {7,
                                 {{1 - 2 * P, P, P},
                                  {P, 1 - 2 * P, P},
                                  {P, P, 1 - 2 * P},
                                  {1 - 2 * Q, Q, Q},
                                  {Q, 1 - 2 * Q, Q},
                                  {Q, Q, 1 - 2 * Q},
                                  {1. / 3, 1. / 3, 1. / 3}},
                                 {WP, WP, WP, WQ, WQ, WQ, 9. / 40}};

void SbQuadraticBasis(const PetscReal L[4], PetscReal phi[SB_CELL_NODES])
{
  for (int a = 0; a < 4; a++)
    phi[a] = L[a] * (2 * L[a] - 1);
  for (int e = 0; e < 6; e++)
    phi[4 + e] = 4 * L[SbTetEdge[e][0]] * L[SbTetEdge[e][1]];
}

void SbQuadraticCorners(const PetscReal L[4], const PetscReal x[SB_CELL_NODES][3],
                        PetscReal corner[4][3])
{
  for (int k = 0; k < 12; k++)
    corner[k / 3][k % 3] = (4 * L[k / 3] - 1) * x[k / 3][k % 3];
  for (int k = 0; k < 18; k++) {
    const int i = SbTetEdge[k / 3][0];
    const int j = SbTetEdge[k / 3][1];

    corner[i][k % 3] += 4 * L[j] * x[4 + k / 3][k % 3];
    corner[j][k % 3] += 4 * L[i] * x[4 + k / 3][k % 3];
  }
}
