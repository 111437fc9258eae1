// What kernels do with one cell, in single precision. Each of its eight Gauss points has a polar decomposition of its
// own.
#pragma once
#include <cmath>

#include "baselines/fem/fem.h"
#include "baselines/parallel.h"

namespace cutproof::baselines::fem {

// --- Small matrices --------------------------------------------------------------------------------------------------

// The rotation R with the greatest tr(RᵀF), and S = RᵀF by what its changes need: (tr(S) I − S) axes[k] = sums[k]
// axes[k]. `trace`: tr(S). Row-major.
struct Rotation {
  float r[9], axes[3][3], sums[3], trace;
};

// tr(R(q)ᵀF) = qᵀ N q for unit quaternions q (Horn, Closed-form solution of absolute orientation, 1987). N has the
// eigenvalues tr(S), 2 σ_k − tr(S); the eigenvectors are those of the best rotation times the axes of S.
BASELINES_HOST_DEVICE inline Rotation rotation_of(const float* f) {
  const float trace = f[0] + f[4] + f[8];
  float n[4][4] = {{trace, f[7] - f[5], f[2] - f[6], f[3] - f[1]},
                   {0, 2 * f[0] - trace, f[1] + f[3], f[2] + f[6]},
                   {0, 0, 2 * f[4] - trace, f[5] + f[7]},
                   {0, 0, 0, 2 * f[8] - trace}};
  float q[4][4] = {};
  for (int i = 0; i < 4; ++i) {
    q[i][i] = 1;
    for (int j = 0; j < i; ++j) n[i][j] = n[j][i];
  }
  // Jacobi's method; it converges quadratically, and a sweep that changes nothing does no harm.
  for (int sweep = 0; sweep < 6; ++sweep) {
    for (int i = 0; i < 3; ++i) {
      for (int j = i + 1; j < 4; ++j) {
        if (n[i][j] == 0) continue;
        const float slope = 0.5f * (n[j][j] - n[i][i]) / n[i][j];
        const float t = (slope < 0 ? -1.0f : 1.0f) / (fabsf(slope) + sqrtf(1 + slope * slope));
        const float c = 1 / sqrtf(1 + t * t), s = t * c;
        for (int k = 0; k < 4; ++k) {
          const float a = n[k][i], b = n[k][j];
          n[k][i] = c * a - s * b, n[k][j] = s * a + c * b;
        }
        for (int k = 0; k < 4; ++k) {
          const float a = n[i][k], b = n[j][k], x = q[k][i], y = q[k][j];
          n[i][k] = c * a - s * b, n[j][k] = s * a + c * b;
          q[k][i] = c * x - s * y, q[k][j] = s * x + c * y;
        }
        n[i][j] = n[j][i] = 0;
      }
    }
  }
  int best = 0;
  for (int k = 1; k < 4; ++k) best = n[k][k] > n[best][best] ? k : best;
  const float w = q[0][best], x = q[1][best], y = q[2][best], z = q[3][best];
  const float d = 2 / (w * w + x * x + y * y + z * z);  // so that rounding of the length does not matter
  Rotation result = {{1 - d * (y * y + z * z), d * (x * y - w * z), d * (x * z + w * y),  //
                      d * (x * y + w * z), 1 - d * (x * x + z * z), d * (y * z - w * x),  //
                      d * (x * z - w * y), d * (y * z + w * x), 1 - d * (x * x + y * y)},
                     {},
                     {},
                     0};
  for (int k = 0; k < 9; ++k) result.trace += result.r[k] * f[k];
  for (int k = 0, axis = 0; k < 4; ++k) {
    if (k == best) continue;
    // The imaginary part of conj(q_best) q_k.
    const float e[4] = {q[0][k], q[1][k], q[2][k], q[3][k]};
    result.axes[axis][0] = w * e[1] - x * e[0] - (y * e[3] - z * e[2]);
    result.axes[axis][1] = w * e[2] - y * e[0] - (z * e[1] - x * e[3]);
    result.axes[axis][2] = w * e[3] - z * e[0] - (x * e[2] - y * e[1]);
    result.sums[axis++] = 0.5f * (n[best][best] - n[k][k]);
  }
  return result;
}

// The inverse of a symmetric matrix xx xy xz yy yz zz; zero where it is not positive. Scaled, so that the determinant
// of small cells' masses and stiffnesses does not underflow.
BASELINES_HOST_DEVICE inline void invert(const float* matrix, float* inverse) {
  const float unit = matrix[0] + matrix[3] + matrix[5];
  float a[6];
  for (int k = 0; k < 6; ++k) a[k] = unit > 0 ? matrix[k] / unit : 0;
  const float xx = a[3] * a[5] - a[4] * a[4], xy = a[2] * a[4] - a[1] * a[5], xz = a[1] * a[4] - a[2] * a[3];
  const float determinant = a[0] * xx + a[1] * xy + a[2] * xz;
  const float scale = determinant > 0 ? 1 / (determinant * unit) : 0;
  inverse[0] = scale * xx, inverse[1] = scale * xy, inverse[2] = scale * xz;
  inverse[3] = scale * (a[0] * a[5] - a[2] * a[2]), inverse[4] = scale * (a[1] * a[2] - a[0] * a[4]);
  inverse[5] = scale * (a[0] * a[3] - a[1] * a[1]);
}
BASELINES_HOST_DEVICE inline void multiply(const float* symmetric, const float* v, float* product) {
  product[0] = symmetric[0] * v[0] + symmetric[1] * v[1] + symmetric[2] * v[2];
  product[1] = symmetric[1] * v[0] + symmetric[3] * v[1] + symmetric[4] * v[2];
  product[2] = symmetric[2] * v[0] + symmetric[4] * v[1] + symmetric[5] * v[2];
}
BASELINES_HOST_DEVICE inline float dot3(const float* a, const float* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
BASELINES_HOST_DEVICE inline void cross3(const float* a, const float* b, float* product) {
  product[0] = a[1] * b[2] - a[2] * b[1], product[1] = a[2] * b[0] - a[0] * b[2];
  product[2] = a[0] * b[1] - a[1] * b[0];
}
// Of the parallelepiped with an edge from a to each of the others, six times a tetrahedron's.
BASELINES_HOST_DEVICE inline float volume_of(const float* a, const float* b, const float* c, const float* d) {
  const float u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]},
              w[3] = {d[0] - a[0], d[1] - a[1], d[2] - a[2]};
  float cross[3];
  cross3(u, v, cross);
  return dot3(cross, w);
}
// Whether the segment from a to b crosses the patch of four corners; as crosses() of dissection.h, by signed volumes.
BASELINES_HOST_DEVICE inline bool crosses_patch(const float* patch, const float* a, const float* b) {
  for (int half = 0; half < 2; ++half) {
    const float *p = patch, *q = patch + 3 + 3 * half, *r = patch + 6 + 3 * half;
    if ((volume_of(p, q, r, a) >= 0) == (volume_of(p, q, r, b) >= 0)) continue;
    const float one = volume_of(a, b, p, q), two = volume_of(a, b, q, r), three = volume_of(a, b, r, p);
    if ((one >= 0 && two >= 0 && three >= 0) || (one <= 0 && two <= 0 && three <= 0)) return true;
  }
  return false;
}
BASELINES_HOST_DEVICE inline bool crosses_any(const float* patches, int64_t count, const float* a, const float* b) {
  for (int64_t j = 0; j < count; ++j) {
    if (crosses_patch(patches + 12 * j, a, b)) return true;
  }
  return false;
}

// --- Cells -----------------------------------------------------------------------------------------------------------

// Cells around nodes: node i has slots[offsets[i]] .. slots[offsets[i + 1] - 1], each 8 · cell + corner.
struct CellsAround {
  int64_t cells;
  const int32_t *offsets, *slots;
};

// What kernels read and write. Arrays of cells have the cell as their last index, so that neighbours read neighbours.
struct View {
  int64_t cells, nodes;
  float mu, lambda;
  const int32_t *corners, *shape;    // [c][8] nodes; [c] which shape a cell has
  const float *gradients, *volumes;  // [shapes][8 points][8 corners][3] 1/m; [shapes][9] m³, the last: the sum
  const float *mass, *x;             // [p] kg; [p][3] m
  const uint8_t* fixed;              // [p] 1: held, or without mass
  const int32_t* component;          // [p]
  CellsAround around;
  float *rotation, *twist;  // [8 points][9][c]; [8][6][c] N/m²
  float *force, *product;   // [8 corners][3][c] N
};

BASELINES_HOST_DEVICE inline const float* gradients_at(const View& s, int64_t c, int g) {
  return s.gradients + (int64_t{s.shape[c]} * 8 + g) * 24;
}
BASELINES_HOST_DEVICE inline void gather(const View& s, int64_t c, const float* of_nodes, float* u) {
  for (int a = 0; a < 8; ++a) {
    for (int k = 0; k < 3; ++k) u[3 * a + k] = of_nodes[3 * int64_t{s.corners[8 * c + a]} + k];
  }
}
// Σ u_a ∇N_aᵀ
BASELINES_HOST_DEVICE inline void gradient_of(const float* u, const float* slopes, float* f) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      float sum = 0;
      for (int a = 0; a < 8; ++a) sum += u[3 * a + i] * slopes[3 * a + j];
      f[3 * i + j] = sum;
    }
  }
}
// out_a += scale · P ∇N_a
BASELINES_HOST_DEVICE inline void add_pull(const float* p, const float* slopes, float scale, float* out) {
  for (int a = 0; a < 8; ++a) {
    for (int i = 0; i < 3; ++i) out[3 * a + i] += scale * dot3(p + 3 * i, slopes + 3 * a);
  }
}

// Rotations, twist stiffness and forces of a cell, at places y [p][3].
BASELINES_HOST_DEVICE inline void linearise_cell(const View& s, int64_t c, const float* y) {
  float u[24], f[8][9];
  gather(s, c, y, u);
  for (int a = 7; a >= 0; --a) {  // places beside the first corner are small, and so is their rounding
    for (int k = 0; k < 3; ++k) u[3 * a + k] -= u[k];
  }
  const float* const volumes = s.volumes + 9 * int64_t{s.shape[c]};
  Rotation points[8];
  float mean = 0;
  for (int g = 0; g < 8; ++g) {
    gradient_of(u, gradients_at(s, c, g), f[g]);
    points[g] = rotation_of(f[g]);
    mean += volumes[g] * (points[g].trace - 3);
  }
  mean /= volumes[8];
  float force[24] = {};
  for (int g = 0; g < 8; ++g) {
    const Rotation& at = points[g];
    float stress[9], twist[6] = {};
    for (int k = 0; k < 9; ++k) {
      stress[k] = 2 * s.mu * (f[g][k] - at.r[k]) + s.lambda * mean * at.r[k];
      s.rotation[(9 * g + k) * s.cells + c] = at.r[k];
    }
    add_pull(stress, gradients_at(s, c, g), -volumes[g], force);
    for (int axis = 0; axis < 3; ++axis) {
      const float* const e = at.axes[axis];
      const float size = fminf((2 * s.mu - s.lambda * mean) / fmaxf(at.sums[axis], 1e-3f), s.mu);
      for (int i = 0, k = 0; i < 3; ++i) {
        for (int j = i; j < 3; ++j) twist[k++] += size * e[i] * e[j];
      }
    }
    for (int k = 0; k < 6; ++k) s.twist[(6 * g + k) * s.cells + c] = twist[k];
  }
  for (int k = 0; k < 24; ++k) s.force[k * s.cells + c] = force[k];
}

// product = K̂ u, of a cell. `u` [p][3].
BASELINES_HOST_DEVICE inline void apply_cell(const View& s, int64_t c, const float* of_nodes) {
  float u[24], out[24] = {}, volumetric[24] = {};
  gather(s, c, of_nodes, u);
  const float* const volumes = s.volumes + 9 * int64_t{s.shape[c]};
  for (int g = 0; g < 8; ++g) {
    const float* const slopes = gradients_at(s, c, g);
    float df[9], r[9], t[6], local[9], change[3];
    gradient_of(u, slopes, df);
    for (int k = 0; k < 9; ++k) r[k] = s.rotation[(9 * g + k) * s.cells + c];
    for (int k = 0; k < 6; ++k) t[k] = s.twist[(6 * g + k) * s.cells + c];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) local[3 * i + j] = r[i] * df[j] + r[3 + i] * df[3 + j] + r[6 + i] * df[6 + j];
    }
    const float tau[3] = {local[7] - local[5], local[2] - local[6], local[3] - local[1]};
    multiply(t, tau, change);
    // 2 μ dF − R [T τ]ₓ
    float stress[9];
    for (int i = 0; i < 3; ++i) {
      const float* const row = r + 3 * i;
      stress[3 * i] = 2 * s.mu * df[3 * i] - (row[1] * change[2] - row[2] * change[1]);
      stress[3 * i + 1] = 2 * s.mu * df[3 * i + 1] - (row[2] * change[0] - row[0] * change[2]);
      stress[3 * i + 2] = 2 * s.mu * df[3 * i + 2] - (row[0] * change[1] - row[1] * change[0]);
    }
    add_pull(stress, slopes, volumes[g], out);
    if (s.lambda != 0) add_pull(r, slopes, volumes[g], volumetric);
  }
  if (s.lambda != 0) {
    float along = 0;
    for (int k = 0; k < 24; ++k) along += volumetric[k] * u[k];
    along *= s.lambda / volumes[8];
    for (int k = 0; k < 24; ++k) out[k] += along * volumetric[k];
  }
  for (int k = 0; k < 24; ++k) s.product[k * s.cells + c] = out[k];
}

// block += K̂ of a cell between two fields of corner weights [8], 3 × 3 row-major:
// Σ_g V_g (2 μ ∇a · ∇b I − Aᵀ T B) + λ q_a q_bᵀ / V, where A has the columns ∇a × (row i of R).
BASELINES_HOST_DEVICE inline void add_block(const View& s, int64_t c, const float* a, const float* b, float* block) {
  const float* const volumes = s.volumes + 9 * int64_t{s.shape[c]};
  float along_a[3] = {}, along_b[3] = {};
  for (int g = 0; g < 8; ++g) {
    const float* const slopes = gradients_at(s, c, g);
    float da[3] = {}, db[3] = {}, t[6], arm_a[3][3], arm_b[3][3], bent[3][3];
    for (int corner = 0; corner < 8; ++corner) {
      for (int k = 0; k < 3; ++k) {
        da[k] += a[corner] * slopes[3 * corner + k];
        db[k] += b[corner] * slopes[3 * corner + k];
      }
    }
    for (int k = 0; k < 6; ++k) t[k] = s.twist[(6 * g + k) * s.cells + c];
    for (int i = 0; i < 3; ++i) {
      float row[3];
      for (int k = 0; k < 3; ++k) row[k] = s.rotation[(9 * g + 3 * i + k) * s.cells + c];
      cross3(da, row, arm_a[i]);
      cross3(db, row, arm_b[i]);
      multiply(t, arm_b[i], bent[i]);
      along_a[i] += volumes[g] * dot3(row, da);
      along_b[i] += volumes[g] * dot3(row, db);
    }
    const float straight = 2 * s.mu * dot3(da, db);
    for (int k = 0; k < 9; ++k)
      block[k] += volumes[g] * ((k % 4 == 0 ? straight : 0) - dot3(arm_a[k / 3], bent[k % 3]));
  }
  for (int k = 0; k < 9; ++k) block[k] += s.lambda / volumes[8] * along_a[k / 3] * along_b[k % 3];
}

// sums[0 .. width - 1]: at a node, of what its cells' corners have in [8 corners][width][c]. Eight at once are read
// before any is awaited.
template <int width>
BASELINES_HOST_DEVICE inline void sum_around(const CellsAround& around, int64_t i, const float* of_corners,
                                             float* sums) {
  for (int k = 0; k < width; ++k) sums[k] = 0;
  const int32_t end = around.offsets[i + 1];
  for (int32_t first = around.offsets[i]; first < end; first += 8) {
    for (int32_t at = first; at < first + 8; ++at) {
      if (at >= end) continue;
      const int64_t c = around.slots[at] >> 3, corner = around.slots[at] & 7;
      for (int k = 0; k < width; ++k) sums[k] += of_corners[(corner * width + k) * around.cells + c];
    }
  }
}

}  // namespace cutproof::baselines::fem
