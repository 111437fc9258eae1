// The method in single precision, as kernels for an executor of parallel.h. Every cell has its eight Gauss points' own
// polar decompositions; conjugate gradients apply K̂ cell by cell and gather at nodes, so nothing is added by atomics.
// Nodes lie in the order of their components: a scalar product is a sum over one component's segment, and each
// component has its own step lengths and its own end. No bit of a component depends on another one.
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

// The inverse of a symmetric matrix xx xy xz yy yz zz; zero where it is not positive.
BASELINES_HOST_DEVICE inline void invert(const float* a, float* inverse) {
  const float xx = a[3] * a[5] - a[4] * a[4], xy = a[2] * a[4] - a[1] * a[5], xz = a[1] * a[4] - a[2] * a[3];
  const float determinant = a[0] * xx + a[1] * xy + a[2] * xz;
  const float scale = determinant > 0 ? 1 / determinant : 0;
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
// Of the parallelepiped with an edge from a to each of the others, six times a tetrahedron's.
BASELINES_HOST_DEVICE inline float volume_of(const float* a, const float* b, const float* c, const float* d) {
  const float u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]},
              w[3] = {d[0] - a[0], d[1] - a[1], d[2] - a[2]};
  const float cross[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
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

// What kernels read and write. Arrays of cells have the cell as their last index, so that neighbours read neighbours.
struct View {
  int64_t cells, nodes;
  float mu, lambda;
  const int32_t *corners, *shape;    // [c][8] nodes; [c] which shape a cell has
  const float *gradients, *volumes;  // [shapes][8 points][8 corners][3] 1/m; [shapes][9] m³, the last: the sum
  const float *mass, *x;             // [p] kg; [p][3] m
  const uint8_t* fixed;              // [p] 1: held, or without mass
  const int32_t *component, *offsets, *slots;  // [p]; [p + 1]; around a node: corner · cells + cell
  float *rotation, *twist;                     // [8 points][9][c]; [8][6][c] N/m²
  float *force, *product;                      // [8 corners][3][c] N
  float* blocks;                               // [8 corners][6][c] N/m: diagonal blocks of K̂
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

// The diagonal block of K̂ of one corner of a cell: 2 μ |∇N|² I − R Xᵀ T X Rᵀ + λ q qᵀ / V, with X v = ∇N × v.
BASELINES_HOST_DEVICE inline void block_of(const View& s, int64_t c, int a) {
  const float* const volumes = s.volumes + 9 * int64_t{s.shape[c]};
  float block[6] = {}, mean[3] = {};
  for (int g = 0; g < 8; ++g) {
    const float* const n = gradients_at(s, c, g) + 3 * a;
    float r[9], t[6];
    for (int k = 0; k < 9; ++k) r[k] = s.rotation[(9 * g + k) * s.cells + c];
    for (int k = 0; k < 6; ++k) t[k] = s.twist[(6 * g + k) * s.cells + c];
    float arm[3][3], bent[3][3];  // ∇N × (row i of R), and T times it
    for (int i = 0; i < 3; ++i) {
      const float* const row = r + 3 * i;
      arm[i][0] = n[1] * row[2] - n[2] * row[1];
      arm[i][1] = n[2] * row[0] - n[0] * row[2];
      arm[i][2] = n[0] * row[1] - n[1] * row[0];
      multiply(t, arm[i], bent[i]);
      mean[i] += volumes[g] * dot3(row, n);
    }
    for (int i = 0, k = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j)
        block[k++] += volumes[g] * ((i == j ? 2 * s.mu * dot3(n, n) : 0) - dot3(arm[i], bent[j]));
    }
  }
  for (int i = 0, k = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j, ++k)
      s.blocks[(6 * a + k) * s.cells + c] = block[k] + s.lambda / volumes[8] * mean[i] * mean[j];
  }
}

// The sum at a node of what its cells' corners have: component k of [8 corners][width][c].
BASELINES_HOST_DEVICE inline float sum_around(const View& s, int64_t i, const float* of_corners, int width, int k) {
  float sum = 0;
  for (int32_t slot = s.offsets[i]; slot < s.offsets[i + 1]; ++slot) {
    const int64_t corner = s.slots[slot] / s.cells, c = s.slots[slot] % s.cells;
    sum += of_corners[(corner * width + k) * s.cells + c];
  }
  return sum;
}

// Mean place of `count` corners of a cell.
BASELINES_HOST_DEVICE inline void mean_of(const View& s, int64_t c, const int* which, int count, float* mean) {
  mean[0] = mean[1] = mean[2] = 0;
  for (int a = 0; a < count; ++a) {
    for (int k = 0; k < 3; ++k)
      mean[k] += s.x[3 * int64_t{s.corners[8 * c + which[a]]} + k] / static_cast<float>(count);
  }
}
BASELINES_HOST_DEVICE inline void centre_of(const View& s, int64_t c, float* centre) {
  const int all[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  mean_of(s, c, all, 8, centre);
}

// --- The simulator ---------------------------------------------------------------------------------------------------

// The gradients of the shape functions at the Gauss points of a cell, and volumes: by cofactors of the Jacobian.
struct Shape {
  std::array<float, 192> gradients;
  std::array<float, 9> volumes;
};
inline Shape shape_of(const Corners& rest) {
  Shape shape;
  double sum = 0;
  for (int g = 0; g < 8; ++g) {
    double weight[3][2];  // 1 − t and t at the point, on each axis
    for (int k = 0; k < 3; ++k) {
      weight[k][1] = kEnds[g][k] == 1 ? 0.78867513459481288 : 0.21132486540518712;
      weight[k][0] = 1 - weight[k][1];
    }
    double slopes[8][3], columns[3][3] = {};
    for (int a = 0; a < 8; ++a) {
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        slopes[a][k] = (kEnds[a][k] == 1 ? 1 : -1) * weight[l][kEnds[a][l]] * weight[m][kEnds[a][m]];
        for (int i = 0; i < 3; ++i) columns[k][i] += rest(a, i) * slopes[a][k];
      }
    }
    const Vec3 u(columns[0]), v(columns[1]), w(columns[2]);
    const double determinant = u.dot(v.cross(w));
    for (int a = 0; a < 8; ++a) {
      const Vec3 n = (slopes[a][0] * v.cross(w) + slopes[a][1] * w.cross(u) + slopes[a][2] * u.cross(v)) / determinant;
      for (int k = 0; k < 3; ++k)
        shape.gradients[static_cast<std::size_t>(24 * g + 3 * a + k)] = static_cast<float>(n[k]);
    }
    shape.volumes[static_cast<std::size_t>(g)] = static_cast<float>(determinant / 8);
    sum += determinant / 8;
  }
  shape.volumes[8] = static_cast<float>(sum);
  return shape;
}

template <class Executor>
class Kernels : public Simulator {
 public:
  template <class T>
  using Array = typename Executor::template Array<T>;

  Kernels(const Scene& scene, const Parameters& parameters)
      : settings_(settings_of(parameters, scene.spacing)),
        lame_(lame_of(settings_.youngs_modulus, settings_.poisson_ratio)),
        gravity_{static_cast<float>(scene.gravity[0]), static_cast<float>(scene.gravity[1]),
                 static_cast<float>(scene.gravity[2])},
        mesh_(mesh_of(scene, settings_.refine, settings_.density)) {
    // Cells of a grid have one shape; their corners differ by rounding.
    std::map<std::array<int64_t, 24>, int32_t> known;
    std::vector<float> gradients, volumes;
    for (const auto& cell : mesh_.cells) {
      const Corners rest = corners_of(mesh_.rest, cell);
      const double size = (rest.row(6) - rest.row(0)).norm();
      std::array<int64_t, 24> key;
      for (int k = 0; k < 24; ++k)
        key[static_cast<std::size_t>(k)] = std::llround((rest(k / 3, k % 3) - rest(0, k % 3)) / scene.spacing * 0x1p24);
      if (!(size < 0x1p30 * scene.spacing))
        throw std::invalid_argument("the spacing does not fit the hexahedra; give the length of their edges");
      const auto [found, is_new] = known.try_emplace(key, static_cast<int32_t>(known.size()));
      shape_of_cell_.push_back(found->second);
      if (!is_new) continue;
      const Shape shape = shape_of(rest);
      gradients.insert(gradients.end(), shape.gradients.begin(), shape.gradients.end());
      volumes.insert(volumes.end(), shape.volumes.begin(), shape.volumes.end());
    }
    gradients_ = Array<float>(gradients), volumes_ = Array<float>(volumes);
    std::vector<Vec3> velocity = interpolated(mesh_, scene.velocity);
    for (std::size_t i = 0; i < velocity.size(); ++i) {
      if (mesh_.held[i] != 0) velocity[i].setZero();
    }
    load(mesh_.rest, velocity);
  }

  int substeps() const override { return settings_.steps; }
  double damping() const override { return settings_.damping; }

  void kick(const std::vector<Vec3>& kick) override {
    const std::vector<Vec3> by = interpolated(mesh_, kick);
    std::vector<float> velocity = v_.copy();
    for (std::size_t i = 0; i < by.size(); ++i) {
      if (mesh_.held[i] != 0) continue;
      for (int k = 0; k < 3; ++k) velocity[3 * place_[i] + static_cast<std::size_t>(k)] += static_cast<float>(by[i][k]);
    }
    v_ = Array<float>(velocity);
  }

  void advance(double frame_time) override {
    if (++frames_ == 1) split_nodes();  // as in the program in double precision
    const auto dt = static_cast<float>(frame_time / settings_.steps);
    for (int step = 0; step < settings_.steps; ++step) move(dt);
  }

  void cut(const std::vector<Patch>& patches) override {
    std::vector<float> corners;
    for (const Patch& patch : patches) {
      for (const Vec3& corner : patch) {
        for (int k = 0; k < 3; ++k) corners.push_back(static_cast<float>(corner[k]));
      }
    }
    const Array<float> blade(corners);
    const float* const patch = blade.data();
    const auto count = static_cast<int64_t>(patches.size());
    const View s = view();
    bool is_new = false;
    if (settings_.removes_cells) {
      Array<uint8_t> met(mesh_.cells.size());
      uint8_t* const is_met = met.data();
      std::vector<int32_t> table;  // count of corners, of the first end, of the second
      for (int k = 0; k < kSegments; ++k) {
        const Ends ends = segment(k);
        table.push_back(ends.count);
        table.insert(table.end(), ends.first, ends.first + 4);
        table.insert(table.end(), ends.second, ends.second + 4);
      }
      const Array<int32_t> all_segments(table);
      const int32_t* const segments = all_segments.data();
      executor_.for_each(mesh_.cells.size(), [=] BASELINES_KERNEL(int64_t c) {
        for (int k = 0; k < kSegments; ++k) {
          const int32_t* const ends = segments + 9 * k;
          float a[3], b[3];
          mean_of(s, c, ends + 1, ends[0], a);
          mean_of(s, c, ends + 5, ends[0], b);
          if (crosses_any(patch, count, a, b)) is_met[c] = 1;
        }
      });
      const std::vector<uint8_t> found = met.copy();
      for (std::size_t c = 0; c < found.size(); ++c) is_new |= found[c] != 0 && remove_cell(mesh_, c);
    } else {
      Array<uint8_t> crossed(mesh_.links.size());
      uint8_t* const is_crossed = crossed.data();
      const int32_t* const links = links_.data();
      executor_.for_each(mesh_.links.size(), [=] BASELINES_KERNEL(int64_t l) {
        float a[3], b[3];
        centre_of(s, links[2 * l], a);
        centre_of(s, links[2 * l + 1], b);
        if (crosses_any(patch, count, a, b)) is_crossed[l] = 1;
      });
      const std::vector<uint8_t> found = crossed.copy();
      for (std::size_t l = 0; l < found.size(); ++l) is_new |= found[l] != 0 && cut_link(mesh_, l);
    }
    if (is_new) split_nodes();
  }

  void finish() override { executor_.finish(); }

  Frame frame(bool changed) const override {
    Frame frame = frame_of(mesh_, changed || frames_ == 1);
    frame.position = by_particle(x_.copy());
    frame.velocity = by_particle(v_.copy());
    for (std::size_t i = 0; i < place_.size(); ++i) {
      if (!frame.position[i].allFinite() || !frame.velocity[i].allFinite())
        throw std::runtime_error("the motion is not finite any more; take more steps, or a lower modulus");
    }
    return frame;
  }

  // Functions with kernels are public: nvcc demands it.

  // One step of implicit Euler, as in fem_cpu.cpp.
  void move(float dt) {
    const std::size_t nodes = place_.size(), cells = mesh_.cells.size();
    if (nodes == 0) return;
    const View s = view();
    const auto b = static_cast<float>(settings_.rayleigh);
    const auto decay = static_cast<float>(std::exp(-settings_.damping * dt));
    const float scale = dt * (dt + b);
    float *const x = x_.data(), *const v = v_.data(), *const start = start_.data(), *const w = w_.data();
    float *const way = p_.data(), *const y = y_.data(), *const r = r_.data(), *const z = z_.data();
    float *const delta = delta_.data(), *const dots = dots_.data(), *const inverse = inverse_.data();
    const float gx = gravity_[0], gy = gravity_[1], gz = gravity_[2];
    executor_.for_each(3 * nodes, [=] BASELINES_KERNEL(int64_t k) {
      v[k] *= decay;
      start[k] = v[k];
      w[k] = 0;
    });
    for (int newton = 0; newton < settings_.newton; ++newton) {
      executor_.for_each(3 * nodes, [=] BASELINES_KERNEL(int64_t k) {
        way[k] = dt * (b * v[k] + dt * (v[k] - w[k]));
        y[k] = x[k] + dt * w[k];
        delta[k] = 0;
      });
      executor_.for_each(cells, [=] BASELINES_KERNEL(int64_t c) {
        linearise_cell(s, c, y);
        apply_cell(s, c, way);
      });
      executor_.for_each(8 * cells,
                         [=] BASELINES_KERNEL(int64_t k) { block_of(s, k % s.cells, static_cast<int>(k / s.cells)); });
      executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
        float block[6];
        for (int k = 0; k < 6; ++k) block[k] = scale * sum_around(s, i, s.blocks, 6, k);
        block[0] += s.mass[i], block[3] += s.mass[i], block[5] += s.mass[i];
        invert(block, inverse + 6 * i);
        const float g[3] = {gx, gy, gz};
        for (int k = 0; k < 3; ++k) {
          const int64_t at = 3 * i + k;
          r[at] = s.fixed[i] != 0 ? 0
                                  : s.mass[i] * (dt * g[k] - (v[at] - start[at])) +
                                        dt * sum_around(s, i, s.force, 3, k) - sum_around(s, i, s.product, 3, k);
        }
        multiply(inverse + 6 * i, r + 3 * i, z + 3 * i);
        for (int k = 0; k < 3; ++k) way[3 * i + k] = z[3 * i + k];
        dots[i] = dot3(r + 3 * i, z + 3 * i);
      });
      solve(scale);
      executor_.for_each(3 * nodes, [=] BASELINES_KERNEL(int64_t k) {
        v[k] += delta[k];
        w[k] = v[k];
      });
    }
    executor_.for_each(3 * nodes, [=] BASELINES_KERNEL(int64_t k) { x[k] += dt * v[k]; });
  }

  // The nodes' products, summed over each component: by chunks of it first, so that a large one occupies the device.
  void sum_up(Array<float>& of_components) {
    executor_.sums(dots_, chunk_starts_, chunks_);
    executor_.sums(chunks_, starts_, of_components);
  }

  // Conjugate gradients from delta = 0; r, z, p and the nodes' r · z are set.
  void solve(float scale) {
    const std::size_t nodes = place_.size(), cells = mesh_.cells.size(), components = starts_.size() - 1;
    const View s = view();
    float *const p = p_.data(), *const q = y_.data(), *const r = r_.data(), *const z = z_.data();
    float *const delta = delta_.data(), *const dots = dots_.data();
    const float* const inverse = inverse_.data();
    float *const rz = rz_.data(), *const next = next_.data(), *const pq = pq_.data(), *const least = least_.data();
    int32_t* const active = active_.data();
    const auto factor = static_cast<float>(settings_.tolerance * settings_.tolerance);
    sum_up(rz_);
    executor_.for_each(components, [=] BASELINES_KERNEL(int64_t k) {
      least[k] = factor * rz[k];
      active[k] = rz[k] > least[k] ? 1 : 0;
    });
    for (int iteration = 0; iteration < settings_.iterations; ++iteration) {
      // Components end by themselves; how often that is looked up changes nothing.
      constexpr int kBetweenLooks = 8;
      if (iteration % kBetweenLooks == 0) {
        const std::vector<int32_t> state = active_.copy();
        if (std::find(state.begin(), state.end(), 1) == state.end()) break;
      }
      executor_.for_each(cells, [=] BASELINES_KERNEL(int64_t c) {
        if (active[s.component[s.corners[8 * c]]] != 0) apply_cell(s, c, p);
      });
      executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
        for (int k = 0; k < 3; ++k) {
          const int64_t at = 3 * i + k;
          q[at] = s.fixed[i] != 0 ? 0 : s.mass[i] * p[at] + scale * sum_around(s, i, s.product, 3, k);
        }
        dots[i] = dot3(p + 3 * i, q + 3 * i);
      });
      sum_up(pq_);
      executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
        const int32_t k = s.component[i];
        if (active[k] == 0 || !(pq[k] > 0)) return;
        const float step = rz[k] / pq[k];
        for (int64_t at = 3 * i; at < 3 * i + 3; ++at) delta[at] += step * p[at], r[at] -= step * q[at];
        multiply(inverse + 6 * i, r + 3 * i, z + 3 * i);
        dots[i] = dot3(r + 3 * i, z + 3 * i);
      });
      sum_up(next_);
      executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
        const int32_t k = s.component[i];
        if (active[k] == 0) return;
        const float share = next[k] / rz[k];
        for (int64_t at = 3 * i; at < 3 * i + 3; ++at) p[at] = z[at] + share * p[at];
      });
      executor_.for_each(components, [=] BASELINES_KERNEL(int64_t k) {
        if (active[k] == 0) return;
        rz[k] = next[k];
        active[k] = pq[k] > 0 && next[k] > least[k] ? 1 : 0;
      });
    }
  }

 private:
  View view() {
    return {static_cast<int64_t>(mesh_.cells.size()),
            static_cast<int64_t>(place_.size()),
            static_cast<float>(lame_.mu),
            static_cast<float>(lame_.lambda),
            corners_.data(),
            shape_.data(),
            gradients_.data(),
            volumes_.data(),
            mass_.data(),
            x_.data(),
            fixed_.data(),
            component_.data(),
            offsets_.data(),
            slots_.data(),
            rotation_.data(),
            twist_.data(),
            force_.data(),
            product_.data(),
            blocks_.data()};
  }

  std::vector<Vec3> by_particle(const std::vector<float>& values) const {
    std::vector<Vec3> result;
    for (const std::size_t i : place_) result.emplace_back(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    return result;
  }

  void split_nodes() {
    std::vector<Vec3> x = by_particle(x_.copy()), v = by_particle(v_.copy());
    for (const int32_t parent : split(mesh_)) {
      x.push_back(Vec3(x[static_cast<std::size_t>(parent)]));
      v.push_back(Vec3(v[static_cast<std::size_t>(parent)]));
    }
    load(x, v);
  }

  // Places and velocities [p], and all that depends on which cells share which nodes. Removed cells stay, at a node of
  // no component: without any weight.
  void load(const std::vector<Vec3>& x, const std::vector<Vec3>& v) {
    const std::size_t nodes = x.size(), cells = mesh_.cells.size();
    const std::vector<int32_t> number = node_components(mesh_);
    std::vector<std::size_t> order(nodes);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return number[a] < number[b]; });
    place_.resize(nodes);
    const std::vector<double> mass_of = lumped_mass(mesh_);
    std::vector<float> places, velocities, mass;
    std::vector<uint8_t> fixed;
    std::vector<int32_t> component, starts, chunk_starts;
    constexpr int32_t kChunk = 512;
    for (std::size_t k = 0; k < nodes; ++k) {
      const std::size_t i = order[k];
      place_[i] = k;
      for (int axis = 0; axis < 3; ++axis) {
        places.push_back(static_cast<float>(x[i][axis]));
        velocities.push_back(static_cast<float>(v[i][axis]));
      }
      mass.push_back(static_cast<float>(mass_of[i]));
      fixed.push_back(mesh_.held[i] != 0 || !(mass_of[i] > 0) ? 1 : 0);
      if (!(mass_of[i] > 0)) std::fill(velocities.end() - 3, velocities.end(), 0.0f);  // the dead stay
      component.push_back(number[i]);
      const auto place = static_cast<int32_t>(k);
      const bool is_first = k == 0 || number[i] != number[order[k - 1]];
      if (is_first) starts.push_back(static_cast<int32_t>(chunk_starts.size()));
      if (is_first || place - chunk_starts.back() == kChunk) chunk_starts.push_back(place);
    }
    starts.push_back(static_cast<int32_t>(chunk_starts.size()));
    chunk_starts.push_back(static_cast<int32_t>(nodes));
    std::vector<int32_t> corners, offsets(nodes + 1, 0), slots;
    for (const auto& cell : mesh_.cells) {
      for (const int32_t i : cell) corners.push_back(static_cast<int32_t>(place_[static_cast<std::size_t>(i)]));
    }
    const auto each_corner = [&](const auto& see) {
      for (std::size_t k = 0; k < corners.size(); ++k) {
        if (mesh_.is_removed[k / 8] == 0)
          see(static_cast<std::size_t>(corners[k]), static_cast<int32_t>(k % 8 * cells + k / 8));
      }
    };
    each_corner([&](std::size_t i, int32_t) { ++offsets[i + 1]; });
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    slots.resize(static_cast<std::size_t>(offsets.back()));
    std::vector<int32_t> next = offsets;
    each_corner([&](std::size_t i, int32_t slot) { slots[static_cast<std::size_t>(next[i]++)] = slot; });
    std::vector<int32_t> links;
    for (const auto& link : mesh_.links) links.insert(links.end(), link.begin(), link.end());
    x_ = Array<float>(places), v_ = Array<float>(velocities), mass_ = Array<float>(mass);
    fixed_ = Array<uint8_t>(fixed), component_ = Array<int32_t>(component), starts_ = Array<int32_t>(starts);
    chunk_starts_ = Array<int32_t>(chunk_starts), chunks_ = Array<float>(chunk_starts.size() - 1);
    corners_ = Array<int32_t>(corners), shape_ = Array<int32_t>(shape_of_cell_), links_ = Array<int32_t>(links);
    offsets_ = Array<int32_t>(offsets), slots_ = Array<int32_t>(slots);
    for (Array<float>* const each : {&start_, &w_, &p_, &y_, &r_, &z_, &delta_}) *each = Array<float>(3 * nodes);
    dots_ = Array<float>(nodes), inverse_ = Array<float>(6 * nodes);
    for (Array<float>* const each : {&rz_, &next_, &pq_, &least_}) *each = Array<float>(starts.size() - 1);
    active_ = Array<int32_t>(starts.size() - 1);
    rotation_ = Array<float>(72 * cells), twist_ = Array<float>(48 * cells), blocks_ = Array<float>(48 * cells);
    force_ = Array<float>(24 * cells), product_ = Array<float>(24 * cells);
  }

  Settings settings_;
  Lame lame_;
  std::array<float, 3> gravity_;
  Mesh mesh_;
  int frames_ = 0;
  std::vector<int32_t> shape_of_cell_;
  std::vector<std::size_t> place_;  // of a particle among nodes in the order of components
  Executor executor_;
  Array<float> gradients_, volumes_, mass_, x_, v_;
  Array<uint8_t> fixed_;
  Array<int32_t> corners_, shape_, component_, starts_, chunk_starts_, offsets_, slots_, links_, active_;
  Array<float> start_, w_, p_, y_, r_, z_, delta_, dots_, inverse_, chunks_, rz_, next_, pq_, least_;
  Array<float> rotation_, twist_, force_, product_, blocks_;
};

}  // namespace cutproof::baselines::fem
