// The method in double precision, written to be read: the oracle of the kernels.
#include <Eigen/CholmodSupport>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SVD>
#include <Eigen/Sparse>
#include <cmath>
#include <limits>
#include <sstream>

#include "baselines/fem/fem.h"

namespace cutproof::baselines {
namespace fem {

using Eigen::Matrix3d;

std::map<std::string, double> known_parameters() {
  const Settings s;
  return {{"youngs_modulus", s.youngs_modulus},
          {"poisson_ratio", s.poisson_ratio},
          {"density", s.density},
          {"damping", s.damping},
          {"rayleigh", s.rayleigh},
          {"steps", s.steps},
          {"newton", s.newton},
          {"solver", s.solver},
          {"tolerance", s.tolerance},
          {"iterations", s.iterations},
          {"grids", s.grids},
          {"refine", s.refine},
          {"remove", s.removes_cells ? 1 : 0}};
}

Settings settings_of(const Parameters& parameters, double spacing) {
  const auto refuse = [&](const char* name, const auto&... remedy) {
    std::ostringstream text;
    text << "parameter '" << name << "' is " << parameters(name) << "; give ";
    (text << ... << remedy);
    throw std::invalid_argument(text.str());
  };
  const auto within = [&](const char* name, double low, double high) {
    const double value = parameters(name);
    if (!(value >= low && value <= high)) refuse(name, "a number from ", low, " to ", high);
    return value;
  };
  const auto whole = [&](const char* name, int low, int high) {
    const double value = within(name, low, high);
    if (value != std::floor(value)) refuse(name, "a whole number");
    return static_cast<int>(value);
  };
  Settings s;
  s.youngs_modulus = within("youngs_modulus", 0, 1e15);
  if (s.youngs_modulus == 0) s.youngs_modulus = 2e7 * spacing * spacing;
  s.poisson_ratio = within("poisson_ratio", -0.99, 0.4999);
  s.density = within("density", 0, 1e9);
  s.damping = within("damping", 0, 1e6);
  s.rayleigh = within("rayleigh", 0, 1e6);
  s.steps = whole("steps", 1, 1'000'000);
  s.newton = whole("newton", 1, 1000);
  s.solver = whole("solver", 0, 1);
  s.tolerance = within("tolerance", 1e-15, 0.5);
  s.iterations = whole("iterations", 1, 1'000'000);
  s.grids = whole("grids", 0, 30);
  s.refine = whole("refine", 1, 16);
  s.removes_cells = whole("remove", 0, 1) == 1;
  return s;
}

Lame lame_of(double youngs_modulus, double poisson_ratio) {
  return {youngs_modulus / (2 * (1 + poisson_ratio)),
          youngs_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))};
}

Element element_of(const Corners& rest) {
  Element element;
  for (int g = 0; g < 8; ++g) {
    Corners slopes;  // of the shape functions Π (1 ± ξ_k) / 2 in −1 .. 1
    for (int a = 0; a < 8; ++a) {
      Vec3 sign, factor;
      for (int k = 0; k < 3; ++k) {
        sign[k] = 2 * kEnds[a][k] - 1;
        factor[k] = (1 + sign[k] * (2 * kEnds[g][k] - 1) / std::sqrt(3.0)) / 2;
      }
      slopes.row(a) << sign[0] * factor[1] * factor[2], sign[1] * factor[2] * factor[0],
          sign[2] * factor[0] * factor[1];
    }
    slopes /= 2;
    const Matrix3d jacobian = rest.transpose() * slopes;  // ∂X/∂ξ
    element.gradients[g] = slopes * jacobian.inverse();
    element.volumes[g] = jacobian.determinant();
    element.volume += element.volumes[g];
  }
  return element;
}

namespace {

// F = R V diag(stretch) Vᵀ with a rotation R; the last stretch is negative where F is inverted.
struct Polar {
  Matrix3d rotation, axes;
  Vec3 stretch;
};
Polar polar(const Matrix3d& f) {
  const Eigen::JacobiSVD<Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Polar p = {svd.matrixU() * svd.matrixV().transpose(), svd.matrixV(), svd.singularValues()};
  if (p.rotation.determinant() < 0) {
    Matrix3d u = svd.matrixU();
    u.col(2) *= -1;
    p.stretch[2] *= -1;
    p.rotation = u * p.axes.transpose();
  }
  return p;
}

struct Point {
  Matrix3d f;
  Polar polar;
};
// The Gauss points of a cell, and θ̄.
double points_of(const Element& element, const Corners& x, std::array<Point, 8>& points) {
  double mean = 0;
  for (int g = 0; g < 8; ++g) {
    points[g].f = x.transpose() * element.gradients[g];
    points[g].polar = polar(points[g].f);
    mean += element.volumes[g] * (points[g].polar.stretch.sum() - 3) / element.volume;
  }
  return mean;
}

}  // namespace

double energy_of(const Element& element, Lame lame, const Corners& x) {
  std::array<Point, 8> points;
  const double mean = points_of(element, x, points);
  double energy = element.volume * lame.lambda / 2 * mean * mean;
  for (int g = 0; g < 8; ++g)
    energy += element.volumes[g] * lame.mu * (points[g].f - points[g].polar.rotation).squaredNorm();
  return energy;
}

Linearised linearise(const Element& element, Lame lame, const Corners& x, bool projected) {
  std::array<Point, 8> points;
  const double mean = points_of(element, x, points);
  Linearised result = {Vector24::Zero(), Matrix24::Zero()};
  Eigen::Matrix<double, 8, 8> laplace = Eigen::Matrix<double, 8, 8>::Zero();
  Vector24 volumetric = Vector24::Zero();  // V ∂θ̄/∂x
  for (int g = 0; g < 8; ++g) {
    const Corners& gradients = element.gradients[g];
    const auto& [rotation, axes, stretch] = points[g].polar;
    const double volume = element.volumes[g];
    const Corners turned = gradients * rotation.transpose();
    const Corners force =
        gradients * (points[g].f - rotation).transpose() * (2 * lame.mu) + turned * lame.lambda * mean;
    // F changes by dF, so R by R [ω]ₓ with (tr(S) I − S) ω = τ, the axial vector of Rᵀ dF − dFᵀ R. The stress 2 μ (F −
    // R)
    // + λ θ̄ R changes by 2 μ dF − c dR + .., c = 2 μ − λ θ̄, and dF : dR = τ · ω. Along an axis of ω the eigenvalue is
    // 2 μ − 2 c / (sum of the other two stretches).
    const double c = 2 * lame.mu - lame.lambda * mean;
    Vec3 twist;
    for (int k = 0; k < 3; ++k) {
      twist[k] = c / std::max(stretch[(k + 1) % 3] + stretch[(k + 2) % 3], 1e-3);
      if (projected) twist[k] = std::min(twist[k], lame.mu);
    }
    Eigen::Matrix<double, 3, 24> tau;  // τ of a corner that moves by dx: ∇N × Rᵀ dx
    for (int a = 0; a < 8; ++a) {
      const Vec3 n = gradients.row(a);
      Matrix3d cross;
      cross << 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0;
      tau.middleCols<3>(3 * a) = cross * rotation.transpose();
      result.force.segment<3>(3 * a) -= volume * force.row(a).transpose();
      volumetric.segment<3>(3 * a) += volume * turned.row(a).transpose();
    }
    laplace += volume * gradients * gradients.transpose();
    const Eigen::Matrix<double, 3, 24> along = axes.transpose() * tau;
    result.stiffness -= volume * along.transpose() * twist.asDiagonal() * along;
  }
  for (int a = 0; a < 8; ++a) {
    for (int b = 0; b < 8; ++b)
      result.stiffness.block<3, 3>(3 * a, 3 * b).diagonal().array() += 2 * lame.mu * laplace(a, b);
  }
  result.stiffness += lame.lambda / element.volume * volumetric * volumetric.transpose();
  return result;
}

double greatest_of_jacobi(const Corners& rest, Lame lame) {
  const Matrix24 stiffness = linearise(element_of(rest), lame, rest).stiffness;
  // By the power method; from below, and close after so many rounds.
  constexpr int kRounds = 100;
  Vector24 v, w;
  for (int k = 0; k < 24; ++k) v[k] = std::sin(1.0 + k);
  double greatest = 0;
  for (int round = 0; round < kRounds; ++round) {
    const Vector24 product = stiffness * v;
    double inertia = 0;
    for (int k = 0; k < 24; k += 3) {
      const Matrix3d block = stiffness.block<3, 3>(k, k);
      w.segment<3>(k) = block.inverse() * product.segment<3>(k);
      inertia += v.segment<3>(k).dot(block * v.segment<3>(k));
    }
    greatest = v.dot(product) / inertia;
    v = w / w.norm();
  }
  return greatest;
}

double energy_of(const Mesh& mesh, Lame lame, const Vec3& gravity, const Frame& frame) {
  double energy = 0;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    if (mesh.is_removed[c] == 0)
      energy +=
          energy_of(element_of(corners_of(mesh.rest, mesh.cells[c])), lame, corners_of(frame.position, mesh.cells[c]));
  }
  const std::vector<double> mass = lumped_mass(mesh);
  for (std::size_t i = 0; i < mass.size(); ++i) {
    if (!frame.velocity.empty()) energy += mass[i] / 2 * frame.velocity[i].squaredNorm();
    energy -= mass[i] * gravity.dot(frame.position[i]);
  }
  return energy;
}

namespace {

// Nodes that cells join, and their system of equations. It is made, ordered and factored by itself, so that no bit of
// one component depends on another.
class Component {
 public:
  std::vector<int32_t> nodes, cells;

  // `local` [p]: set for nodes of this component to their first unknown, or -1 where held.
  void prepare(const Mesh& mesh, std::vector<int32_t>& local) {
    unknowns_ = 0;
    for (const int32_t i : nodes) {
      local[static_cast<std::size_t>(i)] = mesh.held[static_cast<std::size_t>(i)] != 0 ? -1 : unknowns_;
      if (mesh.held[static_cast<std::size_t>(i)] == 0) unknowns_ += 3;
    }
    std::vector<Eigen::Triplet<double>> entries;
    each_entry(mesh, local, [&](int row, int column, std::size_t, int, int) { entries.emplace_back(row, column, 0); });
    matrix_.resize(unknowns_, unknowns_);
    matrix_.setFromTriplets(entries.begin(), entries.end());
    slots_.clear();
    each_entry(mesh, local, [&](int row, int column, std::size_t, int, int) {
      const int* const first = matrix_.innerIndexPtr();
      slots_.push_back(static_cast<int32_t>(
          std::lower_bound(first + matrix_.outerIndexPtr()[column], first + matrix_.outerIndexPtr()[column + 1], row) -
          first));
    });
    factor_.reset();
  }

  // Solves (diagonal + scale · K) Δ = b. `diagonal` and `b` are [p], of which those of this component are used;
  // `of_cell` gives K of a cell.
  template <class OfCell>
  void solve(const Mesh& mesh, const std::vector<int32_t>& local, const Settings& settings, const OfCell& of_cell,
             double scale, const std::vector<double>& diagonal, const std::vector<Vec3>& b, std::vector<Vec3>& delta) {
    for (const int32_t i : nodes) delta[static_cast<std::size_t>(i)].setZero();
    if (unknowns_ == 0) return;
    double* const values = matrix_.valuePtr();
    std::fill(values, values + matrix_.nonZeros(), 0.0);
    const int32_t* slot = slots_.data();
    each_entry(mesh, local, [&](int, int, std::size_t k, int row, int column) {
      values[*slot++] += scale * of_cell(k)(row, column);
    });
    Eigen::VectorXd right(unknowns_);
    for (const int32_t i : nodes) {
      const int first = local[static_cast<std::size_t>(i)];
      if (first < 0) continue;
      for (int k = 0; k < 3; ++k) matrix_.coeffRef(first + k, first + k) += diagonal[static_cast<std::size_t>(i)];
      right.segment<3>(first) = b[static_cast<std::size_t>(i)];
    }
    Eigen::VectorXd solution;
    if (settings.solver == 1) {
      Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower> gradients;
      gradients.setTolerance(settings.tolerance);
      gradients.setMaxIterations(settings.iterations);
      solution = gradients.compute(matrix_).solve(right);
    } else {
      if (factor_ == nullptr) {
        // Supernodal factors are faster for large systems; their sums are those of a library for dense matrices.
        constexpr int kLarge = 3000;
        factor_ = std::make_unique<Factor>();
        factor_->cholmod().print = 0;  // what fails is thrown
        factor_->setMode(unknowns_ < kLarge ? Eigen::CholmodSimplicialLLt : Eigen::CholmodSupernodalLLt);
        factor_->analyzePattern(matrix_);
      }
      const auto fits = [&] {
        return factor_->cholmod().status != CHOLMOD_OUT_OF_MEMORY && factor_->cholmod().status != CHOLMOD_TOO_LARGE;
      };
      if (fits()) factor_->factorize(matrix_);
      if (!fits()) throw std::runtime_error("memory does not suffice to factor the system of equations; take solver=1");
      if (factor_->info() != Eigen::Success)
        throw std::runtime_error("the system of equations cannot be factored; take more steps, or a lower modulus");
      solution = factor_->solve(right);
    }
    for (const int32_t i : nodes) {
      const int first = local[static_cast<std::size_t>(i)];
      if (first >= 0) delta[static_cast<std::size_t>(i)] = solution.segment<3>(first);
    }
  }

 private:
  using Factor = Eigen::CholmodDecomposition<Eigen::SparseMatrix<double>, Eigen::Lower>;

  // Calls see(row, column, k, i, j) for the lower half: entry (i, j) of the component's k-th cell.
  template <class See>
  void each_entry(const Mesh& mesh, const std::vector<int32_t>& local, const See& see) const {
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const auto& cell = mesh.cells[static_cast<std::size_t>(cells[k])];
      for (int i = 0; i < 24; ++i) {
        for (int j = 0; j < 24; ++j) {
          const int a = local[static_cast<std::size_t>(cell[i / 3])], b = local[static_cast<std::size_t>(cell[j / 3])];
          if (a >= 0 && b >= 0 && a + i % 3 >= b + j % 3) see(a + i % 3, b + j % 3, k, i, j);
        }
      }
    }
  }

  int unknowns_ = 0;
  Eigen::SparseMatrix<double> matrix_;  // its lower half
  std::vector<int32_t> slots_;          // of each_entry(), among the matrix's values
  std::unique_ptr<Factor> factor_;
};

// Components of a mesh with cells. `local` as in prepare().
std::vector<Component> components_of(const Mesh& mesh, std::vector<int32_t>& local) {
  const std::vector<int32_t> number = node_components(mesh);
  std::vector<Component> all(
      number.empty() ? 0 : static_cast<std::size_t>(*std::max_element(number.begin(), number.end())) + 1);
  for (std::size_t i = 0; i < number.size(); ++i)
    all[static_cast<std::size_t>(number[i])].nodes.push_back(static_cast<int32_t>(i));
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    if (mesh.is_removed[c] == 0)
      all[static_cast<std::size_t>(number[static_cast<std::size_t>(mesh.cells[c][0])])].cells.push_back(
          static_cast<int32_t>(c));
  }
  std::erase_if(all, [](const Component& component) { return component.cells.empty(); });
  local.assign(mesh.rest.size(), -1);
  for (Component& component : all) component.prepare(mesh, local);
  return all;
}

std::vector<Element> elements_of(const Mesh& mesh) {
  std::vector<Element> elements;
  for (const auto& cell : mesh.cells) elements.push_back(element_of(corners_of(mesh.rest, cell)));
  return elements;
}

class Cpu : public Simulator {
 public:
  Cpu(const Scene& scene, const Parameters& parameters)
      : settings_(settings_of(parameters, scene.spacing)),
        lame_(lame_of(settings_.youngs_modulus, settings_.poisson_ratio)),
        gravity_(scene.gravity),
        mesh_(mesh_of(scene, settings_.refine, settings_.density)),
        x_(mesh_.rest),
        v_(interpolated(mesh_, scene.velocity)),
        elements_(elements_of(mesh_)) {
    for (std::size_t i = 0; i < v_.size(); ++i) {
      if (mesh_.held[i] != 0) v_[i].setZero();
    }
    prepare();
  }

  int substeps() const override { return settings_.steps; }
  double damping() const override { return settings_.damping; }
  void kick(const std::vector<Vec3>& kick) override {
    // Nodes that were split off may belong to another piece, and get nothing.
    const std::vector<Vec3> by = interpolated(mesh_, kick);
    for (std::size_t i = 0; i < by.size(); ++i) {
      if (mesh_.held[i] == 0) v_[i] += by[i];
    }
  }

  void advance(double frame_time) override {
    // Cells that only an edge or a node joins are no tissue. A run begins with the particles of its scene.
    if (++frames_ == 1) split_nodes();
    const double dt = frame_time / settings_.steps;
    for (int step = 0; step < settings_.steps; ++step) {
      for (Component& component : components_) move(component, dt);
      for (std::size_t i = 0; i < x_.size(); ++i) {
        if (mesh_.held[i] != 0) continue;
        if (mesh_.own_mass[i] > 0) v_[i] = std::exp(-settings_.damping * dt) * v_[i] + dt * gravity_;
        if (mass_[i] > 0) x_[i] += dt * v_[i];
        if (!x_[i].allFinite() || !v_[i].allFinite())
          throw std::runtime_error("the motion is not finite any more; take more steps, or a lower modulus");
      }
    }
  }

  void cut(const std::vector<Patch>& patches) override {
    const auto is_crossed = [&](const Vec3& a, const Vec3& b) {
      return std::any_of(patches.begin(), patches.end(), [&](const Patch& patch) { return crosses(patch, a, b); });
    };
    bool is_new = false;
    std::vector<Vec3> centre;
    for (std::size_t c = 0; c < mesh_.cells.size(); ++c) {
      const Corners corners = corners_of(x_, mesh_.cells[c]);
      centre.push_back(corners.colwise().mean());
      if (!settings_.removes_cells) continue;
      for (int s = 0; s < kSegments; ++s) {
        const Ends ends = segment(s);
        Vec3 a = Vec3::Zero(), b = Vec3::Zero();
        for (int k = 0; k < ends.count; ++k) {
          a += corners.row(ends.first[k]).transpose() / ends.count;
          b += corners.row(ends.second[k]).transpose() / ends.count;
        }
        if (is_crossed(a, b)) is_new |= remove_cell(mesh_, c);
      }
    }
    for (std::size_t l = 0; l < mesh_.links.size() && !settings_.removes_cells; ++l) {
      const auto [a, b] = mesh_.links[l];
      if (is_crossed(centre[static_cast<std::size_t>(a)], centre[static_cast<std::size_t>(b)]))
        is_new |= cut_link(mesh_, l);
    }
    if (is_new) split_nodes();
  }

  Frame frame(bool changed) const override {
    Frame frame = frame_of(mesh_, changed || frames_ == 1);
    frame.position = x_;
    frame.velocity = v_;
    return frame;
  }

 private:
  void split_nodes() {
    for (const int32_t parent : split(mesh_)) {
      x_.push_back(Vec3(x_[static_cast<std::size_t>(parent)]));
      v_.push_back(Vec3(v_[static_cast<std::size_t>(parent)]));
    }
    prepare();
  }
  void prepare() {
    mass_ = lumped_mass(mesh_);
    components_ = components_of(mesh_, local_);
  }

  // One step of implicit Euler for the velocities: M (v − v₀) = dt (f(x + dt v) + M g − D v). Each Newton step
  // linearises at x + dt w: w = 0 in the first, which is the published step, then w = v.
  void move(Component& component, double dt) {
    std::vector<Vec3>& w = linearised_at_;
    for (std::vector<Vec3>* const each : {&delta_, &right_, &start_, &w}) each->resize(x_.size());
    for (const int32_t node : component.nodes) {
      const auto i = static_cast<std::size_t>(node);
      v_[i] *= std::exp(-settings_.damping * dt);
      start_[i] = v_[i];
      w[i].setZero();
    }
    const double b = settings_.rayleigh;
    stiffness_.resize(component.cells.size());
    for (int k = 0; k < settings_.newton; ++k) {
      for (const int32_t node : component.nodes) {
        const auto i = static_cast<std::size_t>(node);
        right_[i] = mass_[i] * (dt * gravity_ - (v_[i] - start_[i]));
      }
      for (std::size_t c = 0; c < component.cells.size(); ++c) {
        const auto& cell = mesh_.cells[static_cast<std::size_t>(component.cells[c])];
        const Corners v = corners_of(v_, cell), before = corners_of(w, cell);
        const Linearised linear = linearise(elements_[static_cast<std::size_t>(component.cells[c])], lame_,
                                            corners_of(x_, cell) + dt * before);
        const Corners way = dt * (b * v + dt * (v - before));
        const Vector24 force =
            dt * linear.force - linear.stiffness * Vector24(way.transpose().reshaped<Eigen::ColMajor>());
        for (int a = 0; a < 8; ++a) right_[static_cast<std::size_t>(cell[a])] += force.segment<3>(3 * a);
        stiffness_[c] = linear.stiffness;
      }
      component.solve(
          mesh_, local_, settings_, [&](std::size_t c) -> const Matrix24& { return stiffness_[c]; }, dt*(dt + b), mass_,
          right_, delta_);
      for (const int32_t node : component.nodes) {
        const auto i = static_cast<std::size_t>(node);
        v_[i] += delta_[i];
        w[i] = v_[i];
      }
    }
  }

  Settings settings_;
  Lame lame_;
  Vec3 gravity_;
  Mesh mesh_;
  int frames_ = 0;
  std::vector<Vec3> x_, v_;  // [p] m, m/s
  std::vector<double> mass_;
  std::vector<Element> elements_;
  std::vector<int32_t> local_;
  std::vector<Component> components_;
  std::vector<Vec3> delta_, right_, start_, linearised_at_;  // of move()
  std::vector<Matrix24> stiffness_;
};

}  // namespace

std::vector<Vec3> equilibrium(const Mesh& mesh, Lame lame, const std::vector<Vec3>& load, std::vector<Vec3> x) {
  const std::vector<Element> elements = elements_of(mesh);
  std::vector<int32_t> local;
  std::vector<Component> components = components_of(mesh, local);
  std::vector<Vec3> delta(x.size());
  const std::vector<double> none(x.size(), 0);
  for (Component& component : components) {
    const auto energy_at = [&](const std::vector<Vec3>& places) {
      double energy = 0;
      for (const int32_t c : component.cells)
        energy += energy_of(elements[static_cast<std::size_t>(c)], lame,
                            corners_of(places, mesh.cells[static_cast<std::size_t>(c)]));
      for (const int32_t i : component.nodes)
        energy -= load[static_cast<std::size_t>(i)].dot(places[static_cast<std::size_t>(i)]);
      return energy;
    };
    constexpr int kMost = 200;
    double farthest_before = std::numeric_limits<double>::infinity();
    for (int step = 0;; ++step) {
      if (step == kMost) throw std::runtime_error("no equilibrium was found; apply the load in smaller parts");
      std::vector<Linearised> linear;
      std::vector<Vec3> right = load;
      for (const int32_t c : component.cells) {
        const auto& cell = mesh.cells[static_cast<std::size_t>(c)];
        linear.push_back(linearise(elements[static_cast<std::size_t>(c)], lame, corners_of(x, cell)));
        for (int a = 0; a < 8; ++a) right[static_cast<std::size_t>(cell[a])] += linear.back().force.segment<3>(3 * a);
      }
      component.solve(
          mesh, local, Settings(), [&](std::size_t c) -> const Matrix24& { return linear[c].stiffness; }, 1, none,
          right, delta);
      double slope = 0, size = 0, farthest = 0;
      for (const int32_t node : component.nodes) {
        const auto i = static_cast<std::size_t>(node);
        slope += right[i].dot(delta[i]);
        farthest = std::max(farthest, delta[i].norm());
        size = std::max(size, (mesh.rest[i] - mesh.rest[static_cast<std::size_t>(component.nodes[0])]).norm());
      }
      // Near the end rounding of energies hides whether they fall.
      const double before = energy_at(x);
      double part = 1;
      std::vector<Vec3> next = x;
      for (;; part /= 2) {
        for (const int32_t i : component.nodes)
          next[static_cast<std::size_t>(i)] =
              x[static_cast<std::size_t>(i)] + part * delta[static_cast<std::size_t>(i)];
        if (farthest < 1e-6 * size || part < 1e-6 || energy_at(next) <= before - 1e-4 * part * slope) break;
      }
      x = next;
      // Rounding is reached where steps that are tiny no longer shrink.
      if (farthest < 1e-10 * size && farthest > 0.5 * farthest_before) break;
      farthest_before = farthest;
    }
  }
  return x;
}

}  // namespace fem

std::unique_ptr<Simulator> make_fem_cpu(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<fem::Cpu>(scene, parameters);
}

}  // namespace cutproof::baselines
