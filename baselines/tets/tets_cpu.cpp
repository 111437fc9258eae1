// The method in double precision: Gauss-Seidel, colour by colour. It is the oracle of the kernels.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "baselines/tets/tets.h"

namespace cutproof::baselines {

Parameters tets_parameters(const char* text) {
  const Parameters parameters(text, {{"youngs_modulus", 0},
                                     {"poisson_ratio", 0.4},
                                     {"density", 0},
                                     {"steps", 10},
                                     {"iterations", 1},
                                     {"damping", 0}});
  const auto require = [&](const char* name, bool is_right, const char* wanted) {
    if (!is_right) throw std::invalid_argument("parameter '" + std::string(name) + "' is out of range; give " + wanted);
  };
  const auto is_count = [&](const char* name) {
    const double value = parameters(name);
    return value >= 1 && value <= 1e6 && value == std::floor(value);
  };
  require("youngs_modulus", parameters("youngs_modulus") >= 0,
          "a modulus in Pa, or 0 for 2e7 times the spacing squared");
  require("poisson_ratio", parameters("poisson_ratio") >= 0 && parameters("poisson_ratio") < 0.5,
          "a ratio from 0 to below 0.5");
  require("density", parameters("density") >= 0, "a density in kg/m³, or 0 for the masses of the scene");
  require("steps", is_count("steps"), "a whole number from 1 to 1000000");
  require("iterations", is_count("iterations"), "a whole number from 1 to 1000000");
  require("damping", parameters("damping") >= 0, "a rate in 1/s that is not negative");
  return parameters;
}

namespace tets {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();  // compliance: without resistance

std::size_t at(int32_t i) { return static_cast<std::size_t>(i); }

// Adds the weighted gradients to the places; `c` is the value of the constraint.
template <std::size_t N>
void project(const std::array<Vec3*, N>& x, const std::array<double, N>& w, const std::array<Vec3, N>& gradient,
             double c, double compliance, double& multiplier) {
  double denominator = compliance;
  for (std::size_t k = 0; k < N; ++k) denominator += w[k] * gradient[k].squaredNorm();
  if (!(denominator > compliance) || !std::isfinite(denominator)) return;
  const double change = -(c + compliance * multiplier) / denominator;
  multiplier += change;
  for (std::size_t k = 0; k < N; ++k) *x[k] += w[k] * change * gradient[k];
}

}  // namespace

Stiffness stiffness_of(double youngs_modulus, double poisson_ratio) {
  poisson_ratio = std::max(poisson_ratio, 0.25);
  const double shear = youngs_modulus / (2 * (1 + poisson_ratio)), bulk = youngs_modulus / (3 - 6 * poisson_ratio);
  return {15 * shear / 6, poisson_ratio > 0.25 ? bulk - 5 * shear / 3 : 0};
}

template <std::size_t N>
std::vector<int32_t> colours_of(const std::vector<std::array<int32_t, N>>& constraints, int32_t vertices) {
  std::vector<std::vector<uint64_t>> taken(at(vertices));  // of each vertex: a bit for each colour
  std::vector<int32_t> colours;
  for (const auto& constraint : constraints) {
    std::size_t word = 0;
    const auto free = [&] {
      uint64_t all = 0;
      for (const int32_t i : constraint) all |= word < taken[at(i)].size() ? taken[at(i)][word] : 0;
      return ~all;
    };
    while (free() == 0) ++word;
    const int bit = std::countr_zero(free());
    for (const int32_t i : constraint) {
      if (taken[at(i)].size() <= word) taken[at(i)].resize(word + 1);
      taken[at(i)][word] |= uint64_t{1} << bit;
    }
    colours.push_back(static_cast<int32_t>(64 * word) + bit);
  }
  return colours;
}
template std::vector<int32_t> colours_of(const std::vector<std::array<int32_t, 2>>&, int32_t);
template std::vector<int32_t> colours_of(const std::vector<std::array<int32_t, 4>>&, int32_t);

namespace {

// Sorted by colours, and where each one begins.
template <class T>
std::vector<std::size_t> sort_by_colour(std::vector<T>& constraints, int32_t vertices) {
  const std::vector<int32_t> colours = colours_of(constraints, vertices);
  std::vector<std::size_t> starts = {0};
  for (const int32_t colour : colours) {
    if (starts.size() < at(colour) + 2) starts.resize(at(colour) + 2);
    ++starts[at(colour) + 1];
  }
  for (std::size_t k = 1; k < starts.size(); ++k) starts[k] += starts[k - 1];
  std::vector<std::size_t> next = starts;
  std::vector<T> sorted(constraints.size());
  for (std::size_t k = 0; k < constraints.size(); ++k) sorted[next[at(colours[k])]++] = constraints[k];
  constraints = std::move(sorted);
  return starts;
}

}  // namespace

Sweep sweep_of(const Mesh& mesh) {
  Sweep sweep = {mesh.edges(), mesh.tetrahedra(), {}, {}};
  sweep.edge_starts = sort_by_colour(sweep.edges, mesh.size());
  sweep.cell_starts = sort_by_colour(sweep.cells, mesh.size());
  return sweep;
}

Constraints constraints_of(const Mesh& mesh, const Sweep& sweep, const Stiffness& stiffness) {
  Constraints made;
  std::vector<double> around(mesh.edges().size());  // m³
  const auto volume_around = [&](int32_t a, int32_t b) -> double& { return around[mesh.edge_number(a, b)]; };
  const auto rest = [&](int32_t i) { return mesh.rest()[at(i)]; };
  for (const Tetrahedron& t : sweep.cells) {
    const double volume = volume_of(rest(t[0]), rest(t[1]), rest(t[2]), rest(t[3]));
    for (const auto& [k, l] : kCornersOfEdges)
      volume_around(t[static_cast<std::size_t>(k)], t[static_cast<std::size_t>(l)]) += volume;
    made.volume.push_back(volume);
    made.volume_compliance.push_back(volume > 0 && stiffness.volume > 0 ? volume / stiffness.volume : kNone);
  }
  for (const Edge& edge : sweep.edges) {
    const double length = (rest(edge[1]) - rest(edge[0])).norm();
    // A link has no tetrahedron. It counts as an edge of a lattice of its length: a sixth of a cube.
    const bool is_link = std::binary_search(mesh.links().begin(), mesh.links().end(), edge);
    const double volume = is_link ? length * length * length / 6 : volume_around(edge[0], edge[1]);
    made.length.push_back(length);
    made.distance_compliance.push_back(volume > 0 ? length * length / (stiffness.distance * volume) : kNone);
  }
  return made;
}

double density_of(const Scene& scene, const Mesh& mesh) {
  std::vector<uint8_t> is_corner(scene.mass.size());
  double mass = 0, volume = 0;
  for (std::size_t c = 0; c < mesh.tetrahedra().size(); ++c) {
    volume += mesh.volume()[c];
    for (const int32_t i : mesh.tetrahedra()[c]) is_corner[at(i)] = is_corner[at(i)] != 0 || mesh.volume()[c] > 0;
  }
  for (std::size_t i = 0; i < scene.mass.size(); ++i) mass += is_corner[i] != 0 ? scene.mass[i] : 0;
  return volume > 0 ? mass / volume : 0;
}

std::vector<double> masses_of(const Mesh& mesh, double density, const std::vector<double>& alone) {
  std::vector<double> mass(at(mesh.size()));
  for (std::size_t c = 0; c < mesh.tetrahedra().size(); ++c) {
    for (const int32_t i : mesh.tetrahedra()[c]) mass[at(i)] += density * mesh.volume()[c] / 4;
  }
  for (std::size_t i = 0; i < alone.size(); ++i) mass[i] = mass[i] > 0 ? mass[i] : alone[i];
  return mass;
}

void hold_new(const Mesh& mesh, std::vector<uint8_t>& held) {
  for (std::size_t i = held.size(); i < mesh.ends().size(); ++i)
    held.push_back(held[at(mesh.ends()[i][0])] & held[at(mesh.ends()[i][1])]);
}

void couple(const Mesh& mesh, Frame& frame) {
  frame.has_groups = true;
  const auto add = [&](const auto& members) {
    frame.members.insert(frame.members.end(), members.begin(), members.end());
    frame.offsets.push_back(static_cast<int64_t>(frame.members.size()));
  };
  for (const Tetrahedron& t : mesh.tetrahedra()) add(t);
  for (const Edge& link : mesh.links()) add(link);
}

void project_distance(std::array<Vec3*, 2> x, std::array<double, 2> w, double length, double compliance,
                      double& multiplier) {
  const Vec3 way = *x[1] - *x[0];
  const double distance = way.norm();
  if (!(distance > 0)) return;
  const Vec3 gradient = way / distance;
  project<2>(x, w, {-gradient, gradient}, distance - length, compliance, multiplier);
}

void project_volume(std::array<Vec3*, 4> x, std::array<double, 4> w, double volume, double compliance,
                    double& multiplier) {
  const Vec3 a = *x[1] - *x[0], b = *x[2] - *x[0], c = *x[3] - *x[0];
  const Vec3 of_1 = b.cross(c) / 6, of_2 = c.cross(a) / 6, of_3 = a.cross(b) / 6;
  project<4>(x, w, {-of_1 - of_2 - of_3, of_1, of_2, of_3}, a.dot(of_1) - volume, compliance, multiplier);
}

double elastic_energy(const Sweep& sweep, const Constraints& constraints, std::span<const Vec3> x) {
  double energy = 0;
  for (std::size_t e = 0; e < sweep.edges.size(); ++e) {
    const auto [a, b] = sweep.edges[e];
    const double c = (x[at(b)] - x[at(a)]).norm() - constraints.length[e];
    energy += c * c / (2 * constraints.distance_compliance[e]);
  }
  for (std::size_t t = 0; t < sweep.cells.size(); ++t) {
    const Tetrahedron& i = sweep.cells[t];
    const double c = volume_of(x[at(i[0])], x[at(i[1])], x[at(i[2])], x[at(i[3])]) - constraints.volume[t];
    energy += c * c / (2 * constraints.volume_compliance[t]);
  }
  return energy;
}

std::vector<Crossing> crossings(const Mesh& mesh, std::span<const Vec3> x, const Patch& patch, double thickness) {
  std::vector<Crossing> found;
  std::map<Edge, bool> is_found;
  for (const std::array<Vec3, 3>& p : {std::array{patch[0], patch[1], patch[2]}, {patch[0], patch[2], patch[3]}}) {
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]);
    const double thin = thickness * normal.norm();
    const auto height = [&](int32_t i) { return (x[at(i)] - p[0]).dot(normal); };
    const auto is_above = [&](int32_t i) {
      while (i >= mesh.particles() && std::abs(height(i)) < thin) i = mesh.parent()[at(i)];
      return height(i) >= 0;
    };
    for (const Edge& edge : mesh.edges()) {
      const auto [a, b] = edge;
      if (is_above(a) == is_above(b)) continue;
      // Where both ends lie on one side of the plane one of them is near. Where two new ones are near rounding decides
      // nothing.
      const double from = height(a), to = height(b), nearest = std::abs(from) < std::abs(to) ? 0 : 1;
      const bool is_thin = std::min(a, b) >= mesh.particles() && std::max(std::abs(from), std::abs(to)) < thin;
      const double share = is_thin ? 0.5 : (from >= 0) != (to >= 0) ? from / (from - to) : nearest;
      const Vec3 there = (1 - share) * x[at(a)] + share * x[at(b)];
      const auto inside = [&](const Vec3& q, const Vec3& r) { return (r - q).cross(there - q).dot(normal); };
      // Of the side that both triangles have, rounding must not put a point beyond both.
      const double shared = -1e-9 * normal.squaredNorm();
      const bool is_first = p[1] == patch[1];
      const bool is_crossed = inside(p[0], p[1]) >= (is_first ? 0 : shared) && inside(p[1], p[2]) >= 0 &&
                              inside(p[2], p[0]) >= (is_first ? shared : 0);
      if (is_crossed && is_found.emplace(edge, true).second) found.push_back({edge, share});
    }
  }
  return found;
}

namespace {

class Cpu : public Simulator {
 public:
  Cpu(const Scene& scene, const Parameters& parameters)
      : mesh_(scene),
        steps_(static_cast<int>(parameters("steps"))),
        iterations_(static_cast<int>(parameters("iterations"))),
        damping_(parameters("damping")),
        thickness_(kThickness * scene.spacing),
        density_(parameters("density") > 0 ? parameters("density") : density_of(scene, mesh_)),
        gravity_(scene.gravity),
        alone_(scene.mass),
        held_(scene.held),
        x_(scene.rest),
        v_(scene.velocity) {
    const double modulus = parameters("youngs_modulus");
    stiffness_ = stiffness_of(modulus > 0 ? modulus : 2e7 * scene.spacing * scene.spacing, parameters("poisson_ratio"));
    for (std::size_t i = 0; i < v_.size(); ++i) v_[i] = held_[i] != 0 ? Vec3(Vec3::Zero()) : v_[i];
    build();
  }

  int substeps() const override { return steps_; }
  double damping() const override { return damping_; }

  void kick(const std::vector<Vec3>& kick) override {
    const std::vector<int32_t> nearest = mesh_.nearest_particles();
    for (std::size_t i = 0; i < v_.size(); ++i) {
      if (inverse_mass_[i] > 0 && nearest[i] >= 0) v_[i] += kick[at(nearest[i])];
    }
  }

  void advance(double frame_time) override {
    const double dt = frame_time / steps_;
    for (int step = 0; step < steps_; ++step) substep(dt);
  }

  void cut(const std::vector<Patch>& patches) override {
    // One after the other: an edge that two blades cross falls into three.
    for (const Patch& patch : patches) {
      for (auto parts = mesh_.cut(crossings(mesh_, x_, patch, thickness_)); !parts.empty(); parts = mesh_.cut({})) {
        x_ = after_cut(mesh_, parts, x_);
        v_ = after_cut(mesh_, parts, v_);
      }
    }
    build();
  }

  Frame frame(bool changed) const override {
    Frame frame;
    frame.position = x_;
    frame.velocity = v_;
    frame.mass = mass_;
    frame.parent = mesh_.parent();
    if (changed) couple(mesh_, frame);
    return frame;
  }

 private:
  // What follows from the mesh.
  void build() {
    sweep_ = sweep_of(mesh_);
    constraints_ = constraints_of(mesh_, sweep_, stiffness_);
    mass_ = masses_of(mesh_, density_, alone_);
    hold_new(mesh_, held_);
    inverse_mass_.resize(mass_.size());
    for (std::size_t i = 0; i < mass_.size(); ++i)
      inverse_mass_[i] = held_[i] != 0 || !(mass_[i] > 0) ? 0 : 1 / mass_[i];
  }

  void substep(double dt) {
    const std::vector<Vec3> before = x_;
    const double decay = std::exp(-damping_ * dt), per_time = 1 / (dt * dt);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (inverse_mass_[i] > 0) x_[i] += dt * (v_[i] = decay * (v_[i] + dt * gravity_));
    }
    std::vector<double> of_edge(sweep_.edges.size()), of_cell(sweep_.cells.size());
    for (int iteration = 0; iteration < iterations_; ++iteration) {
      for (std::size_t e = 0; e < of_edge.size(); ++e) {
        const auto [a, b] = sweep_.edges[e];
        project_distance({&x_[at(a)], &x_[at(b)]}, {inverse_mass_[at(a)], inverse_mass_[at(b)]}, constraints_.length[e],
                         constraints_.distance_compliance[e] * per_time, of_edge[e]);
      }
      for (std::size_t c = 0; c < of_cell.size(); ++c) {
        const Tetrahedron& t = sweep_.cells[c];
        std::array<Vec3*, 4> x{};
        std::array<double, 4> w{};
        for (std::size_t k = 0; k < 4; ++k) x[k] = &x_[at(t[k])], w[k] = inverse_mass_[at(t[k])];
        project_volume(x, w, constraints_.volume[c], constraints_.volume_compliance[c] * per_time, of_cell[c]);
      }
    }
    for (std::size_t i = 0; i < x_.size(); ++i) v_[i] = (x_[i] - before[i]) / dt;
  }

  Mesh mesh_;
  Stiffness stiffness_;
  int steps_, iterations_;
  double damping_, thickness_, density_;
  Vec3 gravity_;
  std::vector<double> alone_;
  std::vector<uint8_t> held_;
  std::vector<Vec3> x_, v_;
  Sweep sweep_;
  Constraints constraints_;
  std::vector<double> mass_, inverse_mass_;
};

}  // namespace
}  // namespace tets

std::unique_ptr<Simulator> make_tets_cpu(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<tets::Cpu>(scene, parameters);
}

}  // namespace cutproof::baselines
