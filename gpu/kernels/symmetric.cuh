// Eigenvalues of symmetric 3 × 3 matrices.
#pragma once
#include <cmath>

#include "gpu/launch/block.h"

namespace cutproof::gpu {

// Cyclic Jacobi of a symmetric matrix: eigenvalues on the diagonal of `n`, eigenvectors in the columns of `v`.
CUTPROOF_BOTH inline void diagonalise(float (&n)[3][3], float (&v)[3][3]) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) v[row][column] = row == column ? 1.0f : 0.0f;
  }
  for (int sweep = 0; sweep < 6; ++sweep) {
    for (int pair = 0; pair < 3; ++pair) {
      const int p = pair == 2 ? 1 : 0, q = pair == 0 ? 1 : 2, r = 3 - p - q;
      if (n[p][q] == 0) continue;
      const float theta = (n[q][q] - n[p][p]) / (2.0f * n[p][q]);
      const float t = copysignf(1.0f, theta) / (fabsf(theta) + sqrtf(1.0f + theta * theta));
      const float c = 1.0f / sqrtf(1.0f + t * t), s = t * c;
      n[p][p] -= t * n[p][q];
      n[q][q] += t * n[p][q];
      n[p][q] = n[q][p] = 0;
      const float rp = n[r][p], rq = n[r][q];
      n[r][p] = n[p][r] = c * rp - s * rq;
      n[r][q] = n[q][r] = s * rp + c * rq;
      for (int k = 0; k < 3; ++k) {
        const float vp = v[k][p], vq = v[k][q];
        v[k][p] = c * vp - s * vq;
        v[k][q] = s * vp + c * vq;
      }
    }
  }
}

}  // namespace cutproof::gpu
