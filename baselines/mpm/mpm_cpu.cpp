// The method in double precision: simple, and the answer that kernels are compared with.
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "baselines/mpm/mpm.h"

namespace cutproof::baselines {
namespace mpm {

// --- Parameters and plates -------------------------------------------------------------------------------------------

std::map<std::string, double> known_parameters() {
  return {{"youngs_modulus", 0}, {"poisson_ratio", 0.3}, {"density", 0},  {"steps", 10}, {"damping", 0},
          {"cell", 2},           {"labels", 1},          {"friction", 0}, {"push", 1}};
}

namespace {

constexpr int kMostSubsteps = 1'000'000;
constexpr double kCourant = 0.3;         // share of a cell that a wave passes in a substep
constexpr double kLeastColoured = 1e-6;  // weight of the nodes beside a plate from which on a point has a side

}  // namespace

void require_in_range(const Parameters& parameters) {
  const auto require = [&](const char* name, bool is_fine, const char* range) {
    if (!is_fine) throw std::invalid_argument("parameter '" + std::string(name) + "' is out of range; give " + range);
  };
  const double steps = parameters("steps"), labels = parameters("labels"), cell = parameters("cell"),
               ratio = parameters("poisson_ratio");
  require("youngs_modulus", parameters("youngs_modulus") >= 0, "Pa, or 0 for 2e7 spacing² Pa");
  require("poisson_ratio", ratio > -1 && ratio < 0.5, "a number between -1 and 0.5, both excluded");
  require("density", parameters("density") >= 0, "kg/m³, or 0 for points of the volume spacing³");
  require("steps", steps >= 1 && steps <= kMostSubsteps && steps == std::floor(steps), "1 to 1000000, a whole number");
  require("damping", parameters("damping") >= 0, "0 or more [1/s]");
  require("cell", cell >= 0.5 && cell <= 16, "0.5 to 16 spacings");
  require("labels", labels == 0 || labels == 1, "0 or 1");
  require("friction", parameters("friction") >= 0, "0 or more");
  require("push", parameters("push") >= 0 && parameters("push") <= 10, "0 to 10");
}

Settings settings_of(const Scene& scene, const Parameters& parameters) {
  require_in_range(parameters);
  if (!(scene.spacing > 0)) throw std::invalid_argument("the scene has no spacing; give the distance of particles");
  const double given = parameters("youngs_modulus"), ratio = parameters("poisson_ratio");
  const double young = given > 0 ? given : 2e7 * scene.spacing * scene.spacing;
  Settings settings;
  settings.cell = parameters("cell") * scene.spacing;
  settings.mu = young / (2 * (1 + ratio));
  settings.lambda = young * ratio / ((1 + ratio) * (1 - 2 * ratio));
  settings.damping = parameters("damping");
  settings.friction = parameters("friction");
  settings.push = parameters("push");
  settings.keeps_labels = parameters("labels") == 1;
  const double density = parameters("density");
  double volume_of_mass = 0;  // 1 / ρ
  for (const double m : scene.mass) {
    if (!(m > 0)) throw std::invalid_argument("a particle has no mass; give masses that are positive");
    settings.volume.push_back(density > 0 ? m / density : scene.spacing * scene.spacing * scene.spacing);
    volume_of_mass = std::max(volume_of_mass, settings.volume.back() / m);
  }
  settings.rate = std::sqrt((settings.lambda + 2 * settings.mu) * volume_of_mass) / settings.cell;
  const double wanted = std::max(parameters("steps"), std::ceil(scene.frame_time * settings.rate / kCourant));
  if (!(wanted <= kMostSubsteps))
    throw std::invalid_argument("waves demand " + std::to_string(wanted) +
                                " substeps of a frame, and there may be 1000000; lower youngs_modulus or frame_time");
  settings.substeps = static_cast<int>(wanted);
  return settings;
}

std::vector<Plate> plates_at(const Scene& scene, int frame, int substep, int substeps) {
  std::vector<Plate> plates;
  if (frame < 1 || static_cast<std::size_t>(frame) >= scene.blade.size()) return plates;
  Vec3 thrown = Vec3::Zero(), gravity = scene.gravity;
  double mass = 0;
  for (std::size_t i = 0; i < scene.rest.size(); ++i) {
    thrown += scene.mass[i] * scene.velocity[i];
    mass += scene.mass[i];
  }
  thrown /= std::max(mass, 1e-300);
  if (std::find(scene.held.begin(), scene.held.end(), 1) != scene.held.end()) thrown = gravity = Vec3::Zero();
  // Substep k = 0 .. moves with the velocity thrown + gravity (start + (k + 1) dt), as a free point does.
  const double dt = scene.frame_time / substeps, start = (frame - 1) * scene.frame_time;
  const double left = substeps - substep, sum_of_k = 0.5 * left * (substeps + substep + 1);
  const Vec3 to_go = left * dt * thrown + dt * (left * start + dt * sum_of_k) * gravity;
  for (const Patch& patch : scene.blade[static_cast<std::size_t>(frame)]) {
    Plate plate{patch, thrown + (start + (substep + 1) * dt) * gravity};
    for (Vec3& corner : plate.patch) corner -= to_go;
    plates.push_back(plate);
  }
  return plates;
}

std::vector<int32_t> continued_plates(const Scene& scene, int frame, int substeps, double cell) {
  const std::vector<Plate> old = plates_at(scene, frame - 1, substeps, substeps),
                           now = plates_at(scene, frame, 0, substeps);
  const auto normal = [](const Patch& p) { return Vec3((p[2] - p[0]).cross(p[3] - p[1]).normalized()); };
  std::vector<int32_t> from(now.size(), 0);
  for (std::size_t k = 0; k < now.size(); ++k) {
    const Vec3 n = normal(now[k].patch);
    for (std::size_t o = 0; o < old.size() && from[k] == 0; ++o) {
      const bool in_plane = std::all_of(old[o].patch.begin(), old[o].patch.end(), [&](const Vec3& corner) {
        return std::abs(n.dot(corner - now[k].patch[0])) <= 0.05 * cell;
      });
      const auto number = static_cast<int32_t>(o + 1);
      if (in_plane) from[k] = n.dot(normal(old[o].patch)) > 0 ? number : -number;
    }
  }
  return from;
}

// --- Small functions -------------------------------------------------------------------------------------------------

Stencil stencil_of(const Vec3& x, double cell) {
  Stencil stencil;
  std::array<std::array<double, 3>, 3> along;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = x[static_cast<Eigen::Index>(axis)] / cell, base = std::floor(at - 0.5);
    if (!(std::abs(base) < 1e9)) throw std::runtime_error("a point is no longer finite; take more steps, or soften it");
    stencil.base[axis] = static_cast<int32_t>(base);
    const double f = at - base;
    along[axis] = {0.5 * (1.5 - f) * (1.5 - f), 0.75 - (f - 1) * (f - 1), 0.5 * (f - 0.5) * (f - 0.5)};
  }
  for (std::size_t k = 0; k < 27; ++k) stencil.weight[k] = along[0][k / 9] * along[1][k / 3 % 3] * along[2][k % 3];
  return stencil;
}

std::array<int32_t, 3> node_of(const Stencil& stencil, int k) {
  return {stencil.base[0] + k / 9, stencil.base[1] + k / 3 % 3, stencil.base[2] + k % 3};
}

Mat3 rotation_of(const Mat3& deformation) {
  const Eigen::JacobiSVD<Mat3> svd(deformation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;  // singular values descend
  return u * svd.matrixV().transpose();
}

double energy_density(const Mat3& deformation, double mu, double lambda) {
  const double volume = deformation.determinant() - 1;
  return mu * (deformation - rotation_of(deformation)).squaredNorm() + 0.5 * lambda * volume * volume;
}

Mat3 kirchhoff_stress(const Mat3& deformation, double mu, double lambda) {
  const double j = deformation.determinant();
  return 2 * mu * (deformation - rotation_of(deformation)) * deformation.transpose() +
         lambda * (j - 1) * j * Mat3::Identity();
}

Near near_plate(const Patch& patch, const Vec3& x, double reach) {
  Near near;
  for (const auto& [p, q, r] : {std::tie(patch[0], patch[1], patch[2]), std::tie(patch[0], patch[2], patch[3])}) {
    const Vec3 area = (q - p).cross(r - p);
    if (!(area.squaredNorm() > 0)) continue;
    const Vec3 normal = area.normalized();
    const auto is_inside = [&](const Vec3& a, const Vec3& b) { return (b - a).cross(x - a).dot(normal) >= 0; };
    const double distance = (x - p).dot(normal);
    if (std::abs(distance) > reach || !is_inside(p, q) || !is_inside(q, r) || !is_inside(r, p)) continue;
    if (near.side == 0 || std::abs(distance) < std::abs(near.distance))
      near = {distance >= 0 ? 1 : -1, distance, normal};
  }
  return near;
}

// --- Grid and points -------------------------------------------------------------------------------------------------

Grid grid_of(const Points& points, double cell) {
  struct Hash {
    std::size_t operator()(const std::array<int32_t, 4>& key) const {
      uint64_t hash = 0;
      for (const int32_t k : key) hash = (hash ^ static_cast<uint32_t>(k)) * 0x9E3779B97F4A7C15u, hash ^= hash >> 29;
      return hash;
    }
  };
  std::unordered_map<std::array<int32_t, 4>, int32_t, Hash> number;
  Grid grid;
  grid.cell = cell;
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    grid.stencil.push_back(stencil_of(points.x[p], cell));
    auto& of_point = grid.node_of_point.emplace_back();
    for (int k = 0; k < 27; ++k) {
      const auto [x, y, z] = node_of(grid.stencil[p], k);
      const std::array<int32_t, 4> key = {points.label[p], x, y, z};
      const auto [known, is_new] = number.emplace(key, static_cast<int32_t>(grid.node.size()));
      if (is_new) grid.node.push_back(key);
      of_point[static_cast<std::size_t>(k)] = known->second;
    }
  }
  grid.mass.assign(grid.node.size(), 0);
  grid.held_mass.assign(grid.node.size(), 0);
  grid.velocity.assign(grid.node.size(), Vec3::Zero());
  return grid;
}

namespace {

std::size_t node(const Grid& grid, std::size_t p, int k) {
  return static_cast<std::size_t>(grid.node_of_point[p][static_cast<std::size_t>(k)]);
}
double weight(const Grid& grid, std::size_t p, int k) { return grid.stencil[p].weight[static_cast<std::size_t>(k)]; }
// x_i - x_p
Vec3 way_to(const Grid& grid, const Points& points, std::size_t p, int k) {
  return place_of(node_of(grid.stencil[p], k), grid.cell) - points.x[p];
}

// The plate's plane as nodes show it to a point: the fit of d + n · (x_i - x_p) to their distances. Where they are too
// few for a fit, the heaviest one's.
Near plane_at(const Grid& grid, const Points& points, std::size_t p, std::size_t plate, std::size_t plates) {
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  Eigen::Vector4d sums = Eigen::Vector4d::Zero();
  double heaviest = 0;
  Near plane;
  for (int k = 0; k < 27; ++k) {
    const Near& of_node = grid.contact[node(grid, p, k) * plates + plate];
    const double w = weight(grid, p, k);
    if (of_node.side == 0) continue;
    const Vec3 way = way_to(grid, points, p, k);
    const Eigen::Vector4d terms(1, way[0] / grid.cell, way[1] / grid.cell, way[2] / grid.cell);
    squares += w * terms * terms.transpose();
    sums += w * of_node.distance * terms;
    if (w > heaviest) {
      heaviest = w;
      plane = {of_node.side, of_node.distance - of_node.normal.dot(way), of_node.normal};
    }
  }
  const Eigen::FullPivLU<Eigen::Matrix4d> solver = Eigen::FullPivLU<Eigen::Matrix4d>(squares).setThreshold(1e-6);
  if (!solver.isInvertible()) return plane;
  const Eigen::Vector4d fit = solver.solve(sums);
  const Vec3 slope = fit.tail<3>() / grid.cell;
  if (slope.norm() > 0.5) plane.distance = fit[0], plane.normal = slope.normalized();
  return plane;
}

}  // namespace

void colour(Grid& grid, Points& points, const std::vector<Plate>& plates) {
  const std::size_t count = plates.size();
  // No point beyond the plate uses a node farther away than this.
  const double reach = 1.5 * std::sqrt(3.0) * grid.cell;
  grid.contact.resize(grid.node.size() * count);
  points.contact.resize(points.x.size() * count);
  for (std::size_t i = 0; i < grid.node.size(); ++i) {
    const auto& [label, x, y, z] = grid.node[i];
    for (std::size_t r = 0; r < count; ++r)
      grid.contact[i * count + r] = near_plate(plates[r].patch, place_of({x, y, z}, grid.cell), reach);
  }
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    for (std::size_t r = 0; r < count; ++r) {
      Near& contact = points.contact[p * count + r];
      double beside = 0, distance = 0;
      for (int k = 0; k < 27; ++k) {
        const Near& of_node = grid.contact[node(grid, p, k) * count + r];
        if (of_node.side == 0) continue;
        beside += weight(grid, p, k);
        distance += weight(grid, p, k) * of_node.distance;
      }
      const int side = beside <= kLeastColoured ? 0 : contact.side != 0 ? contact.side : distance >= 0 ? 1 : -1;
      contact = side == 0 ? Near() : plane_at(grid, points, p, r, count);
      contact.side = side;
    }
  }
}

bool is_compatible(const Grid& grid, const Points& points, std::size_t point, int k) {
  const std::size_t plates = points.x.empty() ? 0 : points.contact.size() / points.x.size();
  for (std::size_t r = 0; r < plates; ++r) {
    if (grid.contact[node(grid, point, k) * plates + r].side * points.contact[point * plates + r].side < 0)
      return false;
  }
  return true;
}

namespace {

// What multiplies x_i - x_p in a point's momentum: m C - dt V₀ (4 / dx²) P Fᵀ.
Mat3 moved(const Points& points, std::size_t p, const Settings& settings, double dt) {
  const double scale = 4 * dt * points.volume[p] / (settings.cell * settings.cell);
  return points.mass[p] * points.affine[p] -
         scale * kirchhoff_stress(points.deformation[p], settings.mu, settings.lambda);
}

}  // namespace

void to_grid(Grid& grid, const Points& points, const Settings& settings, double dt) {
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    const Mat3 affine = moved(points, p, settings, dt);
    for (int k = 0; k < 27; ++k) {
      if (!is_compatible(grid, points, p, k)) continue;
      const double w = weight(grid, p, k);
      grid.mass[node(grid, p, k)] += w * points.mass[p];
      if (points.held[p] != 0) grid.held_mass[node(grid, p, k)] += w * points.mass[p];
      grid.velocity[node(grid, p, k)] += w * (points.mass[p] * points.v[p] + affine * way_to(grid, points, p, k));
    }
  }
}

bool is_clamped(const Grid& grid, std::size_t node) { return grid.held_mass[node] > kClampedShare * grid.mass[node]; }

void grid_velocities(Grid& grid, const Vec3& gravity, double dt) {
  for (std::size_t i = 0; i < grid.node.size(); ++i) {
    if (grid.mass[i] > 0) grid.velocity[i] = grid.velocity[i] / grid.mass[i] + dt * gravity;
    if (is_clamped(grid, i)) grid.velocity[i].setZero();
  }
}

void to_points(const Grid& grid, Points& points, const Settings& settings, const std::vector<Plate>& plates,
               const Vec3& gravity, double dt) {
  const std::size_t count = plates.size();
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    const Mat3 affine = moved(points, p, settings, dt);
    const double m = points.mass[p];
    // What it finds at nodes beyond a plate: its own velocity, that does not go on into the plate, rubs, and is driven
    // back where the point is behind it.
    const auto ghost = [&](int k) {
      Vec3 v = points.v[p] + dt * gravity;
      for (std::size_t r = 0; r < count; ++r) {
        const Near& contact = points.contact[p * count + r];
        if (grid.contact[node(grid, p, k) * count + r].side * contact.side >= 0) continue;
        const Vec3 n = contact.side * contact.normal;
        Vec3 slip = v - plates[r].velocity;
        const double into = -slip.dot(n);
        if (into > 0) {
          slip += into * n;
          const double speed = slip.norm();
          if (speed > 0) slip *= std::max(0.0, 1 - settings.friction * into / speed);
        }
        const double depth = std::max(0.0, -contact.side * contact.distance);
        v = plates[r].velocity + slip + settings.push * settings.rate * settings.rate * dt * depth * n;
      }
      return v;
    };
    Vec3 v = Vec3::Zero();
    Mat3 moment = Mat3::Zero();
    for (int k = 0; k < 27; ++k) {
      const double w = weight(grid, p, k);
      const Vec3 way = way_to(grid, points, p, k);
      Vec3 found = grid.velocity[node(grid, p, k)];
      if (!is_compatible(grid, points, p, k)) {
        found = ghost(k);
        points.impulse[p] += w * (m * (found - points.v[p] - dt * gravity) - affine * way);
      } else if (is_clamped(grid, node(grid, p, k))) {
        points.impulse[p] -= w * (m * (points.v[p] + dt * gravity) + affine * way);
      }
      v += w * found;
      moment += w * found * way.transpose();
    }
    points.affine[p] = 4 / (grid.cell * grid.cell) * moment;
    points.deformation[p] += dt * points.affine[p] * points.deformation[p];
    if (points.held[p] != 0) {
      points.impulse[p] -= m * v;
      v.setZero();
    }
    points.x[p] += dt * v;
    const double kept = settings.damping > 0 ? std::exp(-settings.damping * dt) : 1;
    points.v[p] = kept * v;
    points.affine[p] *= kept;
  }
}

void substep(Points& points, const Settings& settings, const std::vector<Plate>& plates, const Vec3& gravity,
             double dt) {
  Grid grid = grid_of(points, settings.cell);
  colour(grid, points, plates);
  to_grid(grid, points, settings, dt);
  grid_velocities(grid, gravity, dt);
  to_points(grid, points, settings, plates, gravity, dt);
}

void add_groups(const Grid& grid, const Points& points, Frame& frame) {
  std::vector<std::vector<std::pair<int32_t, double>>> at_node(grid.node.size());
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    for (int k = 0; k < 27; ++k) {
      if (weight(grid, p, k) > 0 && is_compatible(grid, points, p, k))
        at_node[node(grid, p, k)].emplace_back(static_cast<int32_t>(p), weight(grid, p, k));
    }
  }
  frame.has_groups = true;
  for (const auto& members : at_node) {
    if (members.empty()) continue;
    double greatest = 0;
    for (const auto& [p, w] : members) greatest = std::max(greatest, w);
    for (const auto& [p, w] : members) {
      frame.members.push_back(p);
      frame.weights.push_back(w / greatest);
    }
    frame.offsets.push_back(static_cast<int64_t>(frame.members.size()));
  }
}

double kick_felt_across(Factory make, double gap, int labels) {
  const double h = 0x1p-7, cell = 2 * h;
  Scene scene;
  scene.spacing = h;
  scene.frame_time = 0x1p-6;
  scene.blade.resize(4);
  for (int32_t x = 0; x < 8; ++x) {
    for (int32_t y = 0; y < 4; ++y) {
      for (int32_t z = 0; z < 4; ++z) {
        scene.rest.push_back(h * Vec3(x + 0.1, y, z) + (x < 4 ? 0 : gap * cell - h) * Vec3::UnitX());
        scene.node.push_back({x, y, z});
        const auto i = static_cast<int32_t>(scene.rest.size()) - 1;
        if (x % 4 < 3) scene.edges.push_back({i, i + 16});
        if (y < 3) scene.edges.push_back({i, i + 4});
        if (z < 3) scene.edges.push_back({i, i + 1});
      }
    }
  }
  const std::size_t n = scene.rest.size();
  scene.velocity.assign(n, Vec3::Zero());
  scene.mass.assign(n, 1000 * h * h * h);
  scene.held.assign(n, 0);
  const Vec3 kick(-0.1 * h / scene.frame_time, 0, 0);  // away from the other block
  std::vector<Vec3> kicks(n, Vec3::Zero());
  std::fill(kicks.begin(), kicks.begin() + static_cast<std::ptrdiff_t>(n / 2), kick);
  const std::string text = "labels=" + std::to_string(labels);
  const std::unique_ptr<Simulator> simulator = make(scene, Parameters(text.c_str(), known_parameters()));
  simulator->kick(kicks);
  simulator->advance(scene.frame_time);
  const Frame frame = simulator->frame(true);
  double gained = 0;
  for (std::size_t i = n / 2; i < n; ++i) gained += frame.velocity[i].x() / static_cast<double>(n / 2);
  return std::abs(gained / kick.x());
}

}  // namespace mpm

// --- The simulator ---------------------------------------------------------------------------------------------------

namespace {

class MpmCpu : public Simulator {
 public:
  MpmCpu(const Scene& scene, const Parameters& parameters)
      : scene_(scene), settings_(mpm::settings_of(scene, parameters)), is_broken_(scene.edges.size(), 0) {
    const std::size_t n = scene.rest.size();
    points_.x = scene.rest;
    points_.v = scene.velocity;
    points_.affine.assign(n, mpm::Mat3::Zero());
    points_.deformation.assign(n, mpm::Mat3::Identity());
    points_.mass = scene.mass;
    points_.volume = settings_.volume;
    points_.held = scene.held;
    points_.impulse.assign(n, Vec3::Zero());
    for (std::size_t i = 0; i < n; ++i) {
      if (scene.held[i] != 0) points_.v[i].setZero();
    }
    relabel();
  }
  int substeps() const override { return settings_.substeps; }
  double damping() const override { return settings_.damping; }
  void kick(const std::vector<Vec3>& kick) override {
    for (std::size_t i = 0; i < kick.size(); ++i) {
      if (points_.held[i] == 0) points_.v[i] += kick[i];
    }
  }

  void advance(double frame_time) override {
    ++frame_;
    std::fill(points_.impulse.begin(), points_.impulse.end(), Vec3::Zero());
    keep_sides();
    const int steps = settings_.substeps;
    for (int s = 0; s < steps; ++s)
      mpm::substep(points_, settings_, mpm::plates_at(scene_, frame_, s, steps), scene_.gravity, frame_time / steps);
    for (std::size_t i = 0; i < points_.x.size(); ++i) {
      if (!points_.x[i].allFinite() || !points_.v[i].allFinite() || !points_.affine[i].allFinite())
        throw std::runtime_error("a point is no longer finite; take more steps, or soften it");
    }
  }

  void cut(const std::vector<Patch>& patches) override {
    for (std::size_t e = 0; e < scene_.edges.size(); ++e) {
      const auto [a, b] = scene_.edges[e];
      for (const Patch& patch : patches) {
        if (crosses(patch, points_.x[static_cast<std::size_t>(a)], points_.x[static_cast<std::size_t>(b)]))
          is_broken_[e] = 1;
      }
    }
    relabel();
  }

  Frame frame(bool) const override {
    Frame frame;
    frame.position = points_.x;
    frame.velocity = points_.v;
    Vec3 impulse = Vec3::Zero();
    for (std::size_t i = 0; i < points_.x.size(); ++i) {
      const mpm::Mat3& c = points_.affine[i];
      const double inertia = points_.mass[i] * settings_.cell * settings_.cell / 4;
      frame.spin.push_back(inertia * Vec3(c(2, 1) - c(1, 2), c(0, 2) - c(2, 0), c(1, 0) - c(0, 1)));
      impulse += points_.impulse[i];
    }
    frame.contact_impulse = impulse;
    mpm::Points now = points_;
    mpm::Grid grid = mpm::grid_of(now, settings_.cell);
    mpm::colour(grid, now, mpm::plates_at(scene_, frame_, settings_.substeps, settings_.substeps));
    mpm::add_groups(grid, now, frame);
    return frame;
  }

 private:
  void relabel() {
    const auto n = static_cast<int32_t>(points_.x.size());
    std::vector<std::array<int32_t, 2>> whole;
    for (std::size_t e = 0; e < scene_.edges.size(); ++e) {
      if (is_broken_[e] == 0) whole.push_back(scene_.edges[e]);
    }
    points_.label = settings_.keeps_labels ? components(n, whole) : std::vector<int32_t>(points_.x.size(), 0);
  }
  // Points keep their sides of plates that go on; of others they forget them.
  void keep_sides() {
    const std::vector<int32_t> from = mpm::continued_plates(scene_, frame_, settings_.substeps, settings_.cell);
    const std::size_t n = points_.x.size(), old_count = n == 0 ? 0 : points_.contact.size() / n, count = from.size();
    std::vector<mpm::Near> contact(n * count);
    for (std::size_t k = 0; k < n * count; ++k) {
      const auto o = static_cast<std::size_t>(std::abs(from[k % count]));
      if (o > 0 && o <= old_count)
        contact[k].side = (from[k % count] > 0 ? 1 : -1) * points_.contact[k / count * old_count + o - 1].side;
    }
    points_.contact = std::move(contact);
  }

  const Scene scene_;
  const mpm::Settings settings_;
  std::vector<uint8_t> is_broken_;  // of tissue edges
  mpm::Points points_;
  int frame_ = 0;  // on the way to this one, or there
};

}  // namespace

std::unique_ptr<Simulator> make_mpm_cpu(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<MpmCpu>(scene, parameters);
}

}  // namespace cutproof::baselines
