// The second target of a cluster that keeps its volume: the nearest matrix of determinant 1 (docs/design/method.md §3,
// Volume). It uses + - · / and roots alone, so every backend has the same bits.
#pragma once
#include "gpu/kernels/symmetric.cuh"
#include "gpu/launch/block.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

namespace volume_detail {

// Columns of G = U diag(σ) Zᵀ, orthogonalised by one-sided Jacobi rotations (Hestenes 1958).
struct Svd {
  Float3 u[3], z[3];
  float sigma[3];
};

// Of the two columns the one with the greater norm first.
CUTPROOF_BOTH inline void order(Float3& a, Float3& za, Float3& b, Float3& zb) {
  if (!(dot(a, a) < dot(b, b))) return;
  const Float3 kept = a, kept_z = za;
  a = b;
  za = zb;
  b = kept;
  zb = kept_z;
}

CUTPROOF_BOTH inline Float3 part_across(Float3 v, Float3 unit) { return v - dot(unit, v) * unit; }

// U and Z are rotations, σ1 >= σ2 >= |σ3|. Where A determines no axis, U takes that of R.
CUTPROOF_BOTH inline Svd svd_of(Float3 (&g)[3], const Matrix3& r) {
  constexpr int kSweeps = 5;
  constexpr float kOrthogonal = 0x1p-42f;  // squared cosine: a turn by less moves V by less than rounding
  Svd svd = {{}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}};
  Float3(&z)[3] = svd.z;
  bool turned = true;
  CUTPROOF_ROLLED for (int sweep = 0; sweep < kSweeps && turned; ++sweep) {
    turned = false;
    for (int pair = 0; pair < 3; ++pair) {
      const int p = pair == 2 ? 1 : 0, q = pair == 0 ? 1 : 2;
      const float mixed = dot(g[p], g[q]), of_p = dot(g[p], g[p]), of_q = dot(g[q], g[q]), difference = of_q - of_p;
      if (mixed * mixed <= kOrthogonal * (of_p * of_q)) continue;
      turned = true;
      const float denominator = fabsf(difference) + sqrtf(difference * difference + 4.0f * (mixed * mixed));
      const float t = denominator > 0 ? copysignf(2.0f, difference) * mixed / denominator : 0.0f;
      const float c = 1.0f / sqrtf(1.0f + t * t), s = t * c;
      const Float3 gp = g[p], zp = z[p];
      g[p] = c * gp - s * g[q];
      g[q] = s * gp + c * g[q];
      z[p] = c * zp - s * z[q];
      z[q] = s * zp + c * z[q];
    }
  }
  order(g[0], z[0], g[1], z[1]);
  order(g[0], z[0], g[2], z[2]);
  order(g[1], z[1], g[2], z[2]);
  const Float3 right = cross(z[0], z[1]);
  if (dot(right, z[2]) < 0) g[2] = -1.0f * g[2];
  z[2] = right;
  Float3(&u)[3] = svd.u;
  const float greatest = norm(g[0]);
  u[0] = greatest > 0 ? (1.0f / greatest) * g[0] : r * z[0];
  Float3 second = part_across(g[1], u[0]);
  if (!(norm(second) > 0x1p-20f * greatest)) {
    const Float3 one = part_across(r * z[1], u[0]), other = part_across(r * z[2], u[0]);
    second = dot(one, one) > dot(other, other) ? one : other;
  }
  u[1] = (1.0f / norm(second)) * second;
  u[2] = cross(u[0], u[1]);
  for (int k = 0; k < 3; ++k) svd.sigma[k] = dot(u[k], g[k]);
  return svd;
}

// The positive p nearest to σ with p1 p2 p3 = D, as functions of p3: p1 and p2 are the greater roots of p (p - σ) = μ.
struct Product {
  float sigma[3], per_product;

  CUTPROOF_BOTH float mu(float p3) const { return p3 * (p3 - sigma[2]); }
  CUTPROOF_BOTH float spread(int k, float p3) const { return sqrtf(fmaxf(0.0f, sigma[k] * sigma[k] + 4.0f * mu(p3))); }
  CUTPROOF_BOTH float value(int k, float p3) const { return 0.5f * (sigma[k] + spread(k, p3)); }
  CUTPROOF_BOTH float ratio(float p3) const { return per_product * (value(0, p3) * value(1, p3) * p3); }
  // Of log ratio by log p3.
  CUTPROOF_BOTH float slope(float p3) const {
    const float by = p3 * (2.0f * p3 - sigma[2]);
    return 1.0f + (by / (value(0, p3) * spread(0, p3)) + by / (value(1, p3) * spread(1, p3)));
  }
  CUTPROOF_BOTH float squared_distance(float p3) const {
    const float a = value(0, p3) - sigma[0], b = value(1, p3) - sigma[1], c = p3 - sigma[2];
    return a * a + b * b + c * c;
  }

  static constexpr int kSteps = 48;
  static constexpr float kOff = 0x1p-22f;

  // p3 with ratio 1 between `low`, where it is below, and `high`. Newton's method; by halves where it leaves them.
  CUTPROOF_BOTH float between(float low, float high, float p) const {
    CUTPROOF_ROLLED for (int step = 0; step < kSteps; ++step) {
      const float now = ratio(p);
      if (fabsf(now - 1.0f) <= kOff) break;
      if (now > 1.0f) {
        high = p;
      } else {
        low = p;
      }
      const float next = p - p * ((now - 1.0f) / (now * slope(p)));
      p = next > low && next < high ? next : 0.5f * (low + high);
    }
    return p;
  }
  // The first one above `low`; 0 if the ratio does not rise to 1 below `high`.
  CUTPROOF_BOTH float rising(float low, float high) const {
    float p = low;
    CUTPROOF_ROLLED for (int step = 0; step < kSteps && p < high; ++step) {
      const float now = ratio(p), rise = slope(p);
      if (!(rise > 0)) return 0;
      if (fabsf(now - 1.0f) <= kOff) return p;
      p = p - p * ((now - 1.0f) / (now * rise));
    }
    return 0;
  }
  // Above σ3 / 2 the answer of small strains; below it that of a cluster stretched by more than 1.9 in all directions.
  // `above`: no answer is greater.
  CUTPROOF_BOTH float nearest(float above) const {
    const float middle = 0.5f * sigma[2], least = 1.0f / (per_product * (sigma[0] * sigma[1]));
    const bool has_regular = !(middle > 0) || ratio(middle) <= 1.0f;
    float regular = 0;
    if (has_regular) {
      const float low = fmaxf(middle, 0.0f);
      regular = between(low, above, sigma[2] > low && sigma[2] < above ? sigma[2] : above);
    }
    if (!(least < middle)) return regular;
    if (!has_regular) return between(least, middle, least);
    const float collapsed = rising(least, middle);
    return collapsed > 0 && squared_distance(collapsed) < squared_distance(regular) ? collapsed : regular;
  }
};

// F along the extent of a cluster at rest, R across it.
CUTPROOF_BOTH inline Matrix3 flat_map(const float (&a0)[3][3], const Matrix3& moved, const Matrix3& r) {
  float n[3][3], axes[3][3];
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) n[row][column] = a0[row][column];
  }
  diagonalise(n, axes);
  const float least = static_cast<float>(kFlatExtent) * fmaxf(n[0][0], fmaxf(n[1][1], n[2][2]));
  Matrix3 v = {{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  for (int k = 0; k < 3; ++k) {
    const Float3 axis = {axes[0][k], axes[1][k], axes[2][k]};
    const Float3 image = n[k][k] > least ? (1.0f / n[k][k]) * (moved * axis) : r * axis - axis;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) v(row, column) += image[row] * axis[column];
    }
  }
  return v;
}

}  // namespace volume_detail

// V - F and V - I of a cluster. A flat one has V - F = 0.
struct VolumeMaps {
  Matrix3 pull = {{0, 0, 0, 0, 0, 0, 0, 0, 0}}, target = {{0, 0, 0, 0, 0, 0, 0, 0, 0}};
};
// Given rest = A0 and change = A - A0: V is the matrix of determinant 1 nearest to F = A A0⁻¹, in the norm of A0. All
// are zero where `change` is zero.
CUTPROOF_BOTH inline VolumeMaps volume_maps(const float (&rest)[3][3], const Matrix3& change, const Matrix3& r) {
  using namespace volume_detail;
  VolumeMaps found;
  Matrix3 turned = r, moved;
  for (int k = 0; k < 9; k += 4) turned.m[k] -= 1.0f;
  const float trace = rest[0][0] + rest[1][1] + rest[2][2], scale = 1.0f / trace;
  float a0[3][3];
  bool is_moved = false;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      a0[row][column] = scale * rest[row][column];
      moved(row, column) = scale * change(row, column);
      is_moved = is_moved || moved(row, column) != 0;
    }
  }
  // A0 = L Lᵀ. The norm of A0 is that of V L.
  const float l00 = sqrtf(fmaxf(a0[0][0], 0.0f)), l10 = a0[1][0] / l00, l20 = a0[2][0] / l00;
  const float l11 = sqrtf(fmaxf(a0[1][1] - l10 * l10, 0.0f)), l21 = (a0[2][1] - l20 * l10) / l11;
  const float l22 = sqrtf(fmaxf(a0[2][2] - l20 * l20 - l21 * l21, 0.0f));
  const float product = l00 * l11 * l22;
  if (!(product * product > static_cast<float>(kFlatVolume))) {
    found.target = trace > 0 ? flat_map(a0, moved, r) : turned;
    return found;
  }
  if (!is_moved) return found;
  // G = F L = L + (A - A0) L⁻ᵀ, by columns.
  Float3 d[3];
  for (int k = 0; k < 3; ++k) d[k] = {moved(0, k), moved(1, k), moved(2, k)};
  d[0] = (1.0f / l00) * d[0];
  d[1] = (1.0f / l11) * (d[1] - l10 * d[0]);
  d[2] = (1.0f / l22) * (d[2] - (l20 * d[0] + l21 * d[1]));
  Float3 g[3] = {d[0] + Float3{l00, l10, l20}, d[1] + Float3{0, l11, l21}, d[2] + Float3{0, 0, l22}};
  const Svd svd = svd_of(g, r);
  const Product of = {{svd.sigma[0], svd.sigma[1], svd.sigma[2]}, 1.0f / product};
  // √(1 / 3) bounds the cube root of det L where the trace of A0 is 1.
  const float p3 = of.nearest(0.57736f);
  // V L - G = U diag(p - σ) Zᵀ, and G - L: small numbers where the strain is small.
  const float off[3] = {of.mu(p3) / of.value(0, p3), of.mu(p3) / of.value(1, p3), p3 - svd.sigma[2]};
  Float3 e[3] = {};
  for (int k = 0; k < 3; ++k) {
    e[0] = e[0] + (off[k] * svd.z[k].x) * svd.u[k];
    e[1] = e[1] + (off[k] * svd.z[k].y) * svd.u[k];
    e[2] = e[2] + (off[k] * svd.z[k].z) * svd.u[k];
  }
  const auto per_root = [&](Float3(&column)[3]) {  // times L⁻¹
    column[2] = (1.0f / l22) * column[2];
    column[1] = (1.0f / l11) * (column[1] - l21 * column[2]);
    column[0] = (1.0f / l00) * (column[0] - (l10 * column[1] + l20 * column[2]));
  };
  per_root(d);
  per_root(e);
  bool is_finite = true;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      found.pull(row, k) = e[k][row];
      found.target(row, k) = d[k][row] + e[k][row];
      is_finite = is_finite && fabsf(e[k][row]) <= 3.0e38f;
    }
  }
  if (is_finite) return found;
  found.pull = {{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  found.target = turned;
  return found;
}

// (1 - β) (R - I) + β v. With v = V - F it is C - (1 - β) I, which moves members; with v = V - I it is B - I, which
// moves points beside a member.
CUTPROOF_BOTH inline Matrix3 map_towards(float volume_share, const Matrix3& v, const Matrix3& r) {
  Matrix3 map;
  for (int k = 0; k < 9; ++k) {
    map.m[k] = (1.0f - volume_share) * (r.m[k] - (k % 4 == 0 ? 1.0f : 0.0f)) + volume_share * v.m[k];
  }
  return map;
}

}  // namespace cutproof::gpu
