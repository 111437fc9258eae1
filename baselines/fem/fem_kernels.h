// The method in single precision, as kernels for an executor of parallel.h. Conjugate gradients apply K̂ cell by cell
// and gather at nodes, so nothing is added by atomics. Nodes lie in the order of their components: a scalar product is
// a sum over one component's segment, and each component has its own step lengths and its own end. No bit of a
// component depends on another one.
#pragma once
#include "baselines/fem/fem_multigrid.h"

namespace cutproof::baselines::fem {

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
      greatest_ = std::max(greatest_, static_cast<float>(greatest_of_jacobi(rest, lame_)));
      const Shape shape = shape_of(rest);
      gradients.insert(gradients.end(), shape.gradients.begin(), shape.gradients.end());
      volumes.insert(volumes.end(), shape.volumes.begin(), shape.volumes.end());
    }
    gradients_ = Array<float>(gradients), volumes_ = Array<float>(volumes);
    std::vector<float> eighth;
    for (const double mass : mesh_.cell_mass) eighth.push_back(static_cast<float>(mass / 8));
    eighth_ = Array<float>(eighth);
    std::vector<Vec3> velocity = interpolated(mesh_, scene.velocity);
    for (std::size_t i = 0; i < velocity.size(); ++i) {
      if (mesh_.held[i] != 0) velocity[i].setZero();
    }
    load(mesh_.rest, velocity);
  }

  int substeps() const override { return settings_.steps; }
  double damping() const override { return settings_.damping; }
  int64_t iterations() const { return iterations_; }  // of conjugate gradients so far
  const Multigrid<Executor>& multigrid() const { return multigrid_; }

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
    if (grids_for_ != scale && cells > 0) {  // not yet made, or for another step
      const double h = std::cbrt(volume_of(corners_of(mesh_.rest, mesh_.cells.front())));
      const double density = mesh_.cell_mass.front() / (h * h * h);
      multigrid_.make(mesh_, host_corners_, host_fixed_, scale * (2 * lame_.mu + lame_.lambda) / (density * h * h),
                      settings_.grids);
      grids_for_ = scale;
      iteration_.forget();
    }
    float *const x = x_.data(), *const v = v_.data(), *const start = start_.data(), *const w = w_.data();
    float *const way = p_.data(), *const y = y_.data(), *const r = r_.data();
    float *const delta = delta_.data(), *const inverse = inverse_.data();
    float* const blocks = blocks_.data();
    const float damping = Multigrid<Executor>::kDamping / greatest_;
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
      executor_.for_each(8 * cells, [=] BASELINES_KERNEL(int64_t k) {
        const int64_t c = k % s.cells, corner = k / s.cells;
        float one[8] = {}, block[9] = {};
        one[corner] = 1;
        add_block(s, c, one, one, block);
        for (int row = 0, at = 0; row < 3; ++row) {
          for (int column = row; column < 3; ++column)
            blocks[(6 * corner + at++) * s.cells + c] = block[3 * row + column];
        }
      });
      executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
        float block[6];
        sum_around<6>(s.around, i, blocks, block);
        for (float& each : block) each *= scale;
        block[0] += s.mass[i], block[3] += s.mass[i], block[5] += s.mass[i];
        invert(block, inverse + 6 * i);
        for (int k = 0; k < 6; ++k) inverse[6 * i + k] *= damping;
        const float g[3] = {gx, gy, gz};
        float force[3], product[3];
        sum_around<3>(s.around, i, s.force, force);
        sum_around<3>(s.around, i, s.product, product);
        for (int k = 0; k < 3; ++k) {
          const int64_t at = 3 * i + k;
          r[at] = s.fixed[i] != 0 ? 0 : s.mass[i] * (dt * g[k] - (v[at] - start[at])) + dt * force[k] - product[k];
        }
      });
      multigrid_.assemble(executor_, s, eighth_.data(), scale);
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

  // z = an approximation of A⁻¹ r, and the nodes' r · z.
  void precondition(float scale) {
    const View s = view();
    float *const r = r_.data(), *const z = z_.data(), *const dots = dots_.data();
    multigrid_.solve(executor_, s, {s.around, s.mass, s.fixed, scale, s.product, inverse_.data(), z, r, y_.data()});
    executor_.for_each(place_.size(), [=] BASELINES_KERNEL(int64_t i) { dots[i] = dot3(r + 3 * i, z + 3 * i); });
  }

  // Conjugate gradients for r, from delta = 0.
  void solve(float scale) {
    float *const p = p_.data(), *const z = z_.data(), *const rz = rz_.data(), *const least = least_.data();
    int32_t* const active = active_.data();
    const auto factor = static_cast<float>(settings_.tolerance * settings_.tolerance);
    precondition(scale);
    sum_up(rz_);
    executor_.for_each(3 * place_.size(), [=] BASELINES_KERNEL(int64_t k) { p[k] = z[k]; });
    executor_.for_each(starts_.size() - 1, [=] BASELINES_KERNEL(int64_t k) {
      least[k] = factor * rz[k];
      active[k] = state_of(rz[k], least[k]);
    });
    for (int iteration = 0; iteration < settings_.iterations; ++iteration) {
      // Components end by themselves; how often that is looked up changes nothing.
      constexpr int kBetweenLooks = 2;
      if (iteration % kBetweenLooks == 0 && !goes_on()) return;
      ++iterations_;
      executor_.repeat(iteration_, [&] { iterate(scale); });
    }
    goes_on();
  }

  // Of a component: 1 while it iterates, 0 where it has converged, -1 where r · z shows that rounding has made an
  // operator indefinite.
  static BASELINES_HOST_DEVICE int32_t state_of(float rz, float least) { return rz < 0 ? -1 : rz > least ? 1 : 0; }
  bool goes_on() const {
    const std::vector<int32_t> state = active_.copy();
    if (std::find(state.begin(), state.end(), -1) != state.end())
      throw std::runtime_error(
          "single precision does not solve the system of equations; take more steps, or a lower modulus");
    return std::find(state.begin(), state.end(), 1) != state.end();
  }

  void iterate(float scale) {
    const std::size_t nodes = place_.size();
    const View s = view();
    float *const p = p_.data(), *const q = y_.data(), *const r = r_.data(), *const z = z_.data();
    float *const delta = delta_.data(), *const dots = dots_.data();
    float *const rz = rz_.data(), *const next = next_.data(), *const pq = pq_.data(), *const least = least_.data();
    int32_t* const active = active_.data();
    executor_.for_each(mesh_.cells.size(), [=] BASELINES_KERNEL(int64_t c) {
      if (active[s.component[s.corners[8 * c]]] > 0) apply_cell(s, c, p);
    });
    executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
      float product[3];
      sum_around<3>(s.around, i, s.product, product);
      for (int k = 0; k < 3; ++k) {
        const int64_t at = 3 * i + k;
        q[at] = s.fixed[i] != 0 ? 0 : s.mass[i] * p[at] + scale * product[k];
      }
      dots[i] = dot3(p + 3 * i, q + 3 * i);
    });
    sum_up(pq_);
    executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
      const int32_t k = s.component[i];
      if (active[k] <= 0 || !(pq[k] > 0)) return;
      const float step = rz[k] / pq[k];
      for (int64_t at = 3 * i; at < 3 * i + 3; ++at) delta[at] += step * p[at], r[at] -= step * q[at];
    });
    precondition(scale);
    sum_up(next_);
    executor_.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) {
      const int32_t k = s.component[i];
      if (active[k] <= 0) return;
      const float share = next[k] / rz[k];
      for (int64_t at = 3 * i; at < 3 * i + 3; ++at) p[at] = z[at] + share * p[at];
    });
    executor_.for_each(starts_.size() - 1, [=] BASELINES_KERNEL(int64_t k) {
      if (active[k] <= 0) return;
      rz[k] = next[k];
      active[k] = pq[k] > 0 ? state_of(next[k], least[k]) : pq[k] < 0 ? -1 : 0;
    });
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
            {static_cast<int64_t>(mesh_.cells.size()), offsets_.data(), slots_.data()},
            rotation_.data(),
            twist_.data(),
            force_.data(),
            product_.data()};
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
        if (mesh_.is_removed[k / 8] == 0) see(static_cast<std::size_t>(corners[k]), static_cast<int32_t>(k));
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
    host_corners_ = corners, host_fixed_ = fixed, grids_for_ = 0;
    iteration_.forget();
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
  int64_t iterations_ = 0;             // of conjugate gradients, in all
  float greatest_ = 1;                 // eigenvalue of D⁻¹K̂ at rest
  float grids_for_ = 0;                // factor of K̂ that coarser grids were made for; 0: none
  std::vector<int32_t> host_corners_;  // [8 c]
  std::vector<uint8_t> host_fixed_;    // [p]
  Multigrid<Executor> multigrid_;
  typename Executor::Recording iteration_;
  std::vector<int32_t> shape_of_cell_;
  std::vector<std::size_t> place_;  // of a particle among nodes in the order of components
  Executor executor_;
  Array<float> gradients_, volumes_, eighth_, mass_, x_, v_;
  Array<uint8_t> fixed_;
  Array<int32_t> corners_, shape_, component_, starts_, chunk_starts_, offsets_, slots_, links_, active_;
  Array<float> start_, w_, p_, y_, r_, z_, delta_, dots_, inverse_, chunks_, rz_, next_, pq_, least_;
  Array<float> rotation_, twist_, force_, product_, blocks_;
};

extern template class Kernels<Host>;

}  // namespace cutproof::baselines::fem
