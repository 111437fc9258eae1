#include "benchmarks/material.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "fixtures/build.h"
#include "fixtures/material.h"
#include "model/at.h"

namespace cutproof::benchmarks {

namespace {

constexpr double kYoungsModulus = 1e4, kDensity = 1000, kSpacing = 0.01;

Vec3 axis_of(const std::string& along) {
  const Vec3 axis = {double(along[0] - '0'), double(along[1] - '0'), double(along[2] - '0')};
  return axis / norm(axis);
}

Scene scene_of(const BarSpec& spec) {
  Scene scene;
  scene.body.align = false;
  scene.body.spacing = kSpacing;
  Shape& shape = scene.body.shape.emplace();
  const double across = spec.across * kSpacing, length = kSlenderness * across;
  if (spec.along == "100") {
    shape.size = {length, across, across};
  } else {
    shape.kind = Shape::Kind::cylinder;
    shape.radius = across / 2, shape.length = length, shape.along = axis_of(spec.along);
  }
  scene.material = MaterialSpec{kYoungsModulus, spec.poisson_ratio, kDensity};
  scene.clusters.side = spec.side;
  scene.clusters.method = spec.cooking;
  scene.step.substeps = 1;
  scene.skin.wanted = false;
  scene.frames = 1;
  remove_nothing(scene.detect);
  return scene;
}

// The fewest iterations, in powers of two, that leave a thousandth of a long wave's error.
int32_t enough_iterations(StepParameters step, double dt) {
  step.iterations = 4;
  while (step.iterations < 4096 && std::abs(fixtures::left_by_iterations(step, dt)) > 1e-3) step.iterations *= 2;
  return step.iterations;
}

double shear_modulus(double poisson_ratio) { return kYoungsModulus / (2 * (1 + poisson_ratio)); }

}  // namespace

MaterialBar::MaterialBar(Backend& backend, BarSpec spec)
    : backend_(backend), spec_(std::move(spec)), axis_(axis_of(spec_.along)) {
  fixtures::Built built = fixtures::build(scene_of(spec_), "command line");
  setup_ = std::move(built.setup);
  state_ = std::move(built.state);
  const int32_t n = particles();
  double high = -INFINITY;
  low_ = INFINITY;
  for (int32_t i = 0; i < n; ++i) {
    const double s = dot(axis_, setup_.body.rest_position(i));
    low_ = std::min(low_, s);
    high = std::max(high, s);
  }
  // The last layer ends half a spacing beyond its particles.
  length_ = high - low_ + kSpacing / 2;
  middle_ = (high - low_) / 2;
  area_ = n * std::pow(kSpacing, 3) / (kSlenderness * spec_.across * kSpacing);
  Grip held;
  for (int32_t i = 0; i < n; ++i) {
    if (place(i) < kSpacing / 2) held.particles.push_back(i);
  }
  setup_.grips.push_back(std::move(held));
}

double MaterialBar::place(int32_t particle) const { return dot(axis_, setup_.body.rest_position(particle)) - low_; }

Setup MaterialBar::in_steps(double dt, int64_t frames, double retardation) const {
  Setup setup = setup_;
  setup.substep_length.assign(at(frames), dt);
  for (Grip& grip : setup.grips) {
    grip.active.assign(at(frames), 1);
    grip.displacement.assign(at(frames), {});
  }
  setup.step.retardation = retardation;
  setup.step.iterations = spec_.iterations > 0 ? spec_.iterations : enough_iterations(setup.step, dt);
  return setup;
}

double MaterialBar::step_length(double longest) const {
  return std::min(longest, std::sqrt(19 / setup_.step.stiffness));
}

State MaterialBar::run(Setup setup, State state, const std::function<void(const State&)>& see) {
  const int64_t frames = setup.frame_count();
  backend_.load({std::move(setup)}, {std::move(state)});
  for (int64_t frame = 0; frame < frames; ++frame) {
    backend_.run({Stage::step, Stage::skin});
    if (see) see(backend_.snapshot().front());
  }
  return std::move(backend_.snapshot().front());
}

Mat3 MaterialBar::deformation_of_middle(const State& state) const {
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> sums = Eigen::Matrix<double, 4, 3>::Zero();
  for (int32_t i = 0; i < particles(); ++i) {
    // Weights fall off smoothly, because particles' strains vary within a cluster.
    const double off = (place(i) - middle_) / (length_ / 4);
    if (std::abs(off) >= 1) continue;
    const double weight = std::pow(std::cos(std::numbers::pi / 2 * off), 2);
    const Vec3 rest = setup_.body.rest_position(i), x = state.x[at(i)];
    const Eigen::Vector4d one(1, rest.x, rest.y, rest.z);
    moments += weight * one * one.transpose();
    sums += weight * one * Eigen::RowVector3d(x.x, x.y, x.z);
  }
  const Eigen::Matrix<double, 4, 3> fit = moments.ldlt().solve(sums);
  Mat3 f;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) f(row, column) = fit(column + 1, row);
  }
  return f;
}

std::vector<MaterialFigure> MaterialBar::hang() {
  // For three periods, with critical damping.
  const double omega = std::numbers::pi / (2 * length_) * std::sqrt(kYoungsModulus / kDensity);
  const double period = 2 * std::numbers::pi / omega, dt = step_length(period / 40);
  Setup setup = in_steps(dt, std::llround(3 * period / dt));
  // What hangs below the middle, and half of what is level with it.
  double below = 0;
  for (int32_t i = 0; i < particles(); ++i) {
    const double off = place(i) - middle_;
    below += setup_.body.mass[at(i)] * (std::abs(off) < 1e-6 * kSpacing ? 0.5 : off > 0 ? 1 : 0);
  }
  const double gravity = 0.01 * kYoungsModulus * area_ / below;
  setup.step.gravity = axis_ * gravity;
  setup.step.damping = 2 * omega;
  const Mat3 f = deformation_of_middle(run(std::move(setup), state_));
  const double strain = dot(axis_, f * axis_) - 1, across = (f(0, 0) + f(1, 1) + f(2, 2) - 3 - strain) / 2;
  return {{"hanging", "E", "Pa", kYoungsModulus, gravity * below / area_ / strain},
          {"hanging", "ν", "", spec_.poisson_ratio, -across / strain}};
}

MaterialFigure MaterialBar::pull() {
  const double omega = std::numbers::pi / length_ * std::sqrt(kYoungsModulus / kDensity);
  const double period = 2 * std::numbers::pi / omega, dt = step_length(period / 40);
  const int64_t ramp = std::llround(2 * period / dt);
  Setup setup = in_steps(dt, 2 * ramp);
  Grip pulled = setup.grips.front();
  pulled.particles.clear();
  for (int32_t i = 0; i < particles(); ++i) {
    if (place(i) > length_ - kSpacing) pulled.particles.push_back(i);
  }
  for (int64_t frame = 0; frame < ramp; ++frame)
    pulled.displacement[at(frame)] = axis_ * (0.2 * length_ / double(ramp));
  setup.grips.push_back(std::move(pulled));
  setup.step.damping = 2 * omega;
  const Mat3 f = deformation_of_middle(run(std::move(setup), state_));
  const double stretch = dot(axis_, f * axis_);
  const double volume = f(0, 0) * (f(1, 1) * f(2, 2) - f(1, 2) * f(2, 1)) -
                        f(0, 1) * (f(1, 0) * f(2, 2) - f(1, 2) * f(2, 0)) +
                        f(0, 2) * (f(1, 0) * f(2, 1) - f(1, 1) * f(2, 0));
  // As a bar of constant ν, by logarithmic strains.
  return {"pulled by a fifth", "volume", "", std::pow(stretch, 1 - 2 * spec_.poisson_ratio), volume};
}

MaterialBar::Oscillation MaterialBar::oscillation(const std::function<Vec3(int32_t)>& mode, double expected,
                                                  double retardation) {
  const double period = 2 * std::numbers::pi / expected, dt = step_length(period / 80);
  Setup setup = in_steps(dt, std::llround(period / 2 / dt), retardation);
  const double left = fixtures::left_by_iterations(setup.step, dt);
  State state = state_;
  const auto& held = setup.grips.front().particles;
  double greatest = 0;
  for (int32_t i = 0; i < particles(); ++i) greatest = std::max(greatest, norm(mode(i)));
  for (int32_t i = 0; i < particles(); ++i) {
    // Amplitudes of a thousandth of the length.
    if (!std::binary_search(held.begin(), held.end(), i))
      state.v[at(i)] = mode(i) * (1e-3 * length_ * expected / greatest);
  }
  std::vector<double> q = {0};
  run(std::move(setup), std::move(state), [&](const State& now) {
    double sum = 0;
    for (int32_t i = 0; i < particles(); ++i)
      sum += setup_.body.mass[at(i)] * dot(mode(i), now.x[at(i)] - setup_.body.rest_position(i));
    q.push_back(sum);
  });
  // q'' = a q' + b q, by least squares; implicit Euler has (1 + ω² dt (dt + τ)) q'' = (2 + ω² dt τ) q' − q.
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  Eigen::Vector2d sums = Eigen::Vector2d::Zero();
  for (std::size_t k = 2; k < q.size(); ++k) {
    const Eigen::Vector2d one(q[k - 1], q[k - 2]);
    moments += one * one.transpose();
    sums += one * q[k];
  }
  const Eigen::Vector2d fit = moments.ldlt().solve(sums);
  const double both = -1 / fit(1) - 1, late = -fit(0) / fit(1) - 2;
  return {std::sqrt(std::max(0.0, both - late)) / dt, late / (both - late) * dt, left};
}

MaterialBar::Oscillation MaterialBar::swing(double share) {
  const double wave = std::numbers::pi / (2 * length_), expected = wave * std::sqrt(kYoungsModulus / kDensity);
  Oscillation found =
      oscillation([&](int32_t i) { return axis_ * std::sin(wave * place(i)); }, expected, share / expected);
  found.of_closed_form = found.frequency / expected;
  return found;
}

MaterialFigure MaterialBar::swing_along() {
  const Oscillation found = swing(0);
  const double asked = (1 - found.left) * kYoungsModulus;
  return {"swinging along", "E", "Pa", spec_.iterations > 0 ? asked : kYoungsModulus,
          kYoungsModulus * std::pow(found.of_closed_form, 2)};
}

MaterialFigure MaterialBar::decay() {
  const Oscillation found = swing(0.2);
  return {"retarded", "τ", "s", 0.2 * found.of_closed_form / found.frequency, found.retardation};
}

MaterialFigure MaterialBar::twist() {
  // Of a square: J / I_p = 6 · 0.140577.
  const double shape = spec_.along == "100" ? 6 * 0.140577 : 1;
  const double wave = std::numbers::pi / (2 * length_), modulus = shear_modulus(spec_.poisson_ratio),
               expected = wave * std::sqrt(shape * modulus / kDensity);
  Vec3 centre;
  for (int32_t i = 0; i < particles(); ++i) centre = centre + setup_.body.rest_position(i) / particles();
  const auto mode = [&](int32_t i) {
    return cross(axis_, setup_.body.rest_position(i) - centre) * std::sin(wave * place(i));
  };
  const double omega = oscillation(mode, expected, 0).frequency;
  return {"twisted", "G", "Pa", modulus, kDensity / shape * std::pow(omega / wave, 2)};
}

MaterialFigure MaterialBar::swing_across() {
  // Euler's first mode with Rayleigh's inertia of turning, ∫ φ'² L² / ∫ φ² = 4.648, and Timoshenko's shear by
  // Dunkerley's rule.
  const double nu = spec_.poisson_ratio, across = spec_.across * kSpacing, root = 1.8751040687;
  const bool is_box = spec_.along == "100";
  const double radius2 = is_box ? across * across / 12 : across * across / 16;  // I / A
  const double kappa = is_box ? 10 * (1 + nu) / (12 + 11 * nu) : 6 * (1 + nu) / (7 + 6 * nu);
  const double bending2 =
      std::pow(root / length_, 4) * kYoungsModulus / kDensity * radius2 / (1 + 4.648 * radius2 / (length_ * length_));
  const double shear2 = std::pow(std::numbers::pi / (2 * length_), 2) * kappa * shear_modulus(nu) / kDensity;
  const double expected = std::sqrt(1 / (1 / bending2 + 1 / shear2));
  const Vec3 side = std::abs(axis_.z) > 0.5 ? Vec3{1, -1, 0} / std::sqrt(2.0) : Vec3{0, 0, 1};
  const double beta = root / length_, ratio = (std::cosh(root) + std::cos(root)) / (std::sinh(root) + std::sin(root));
  const auto mode = [&](int32_t i) {
    const double y = beta * place(i);
    return side * (std::cosh(y) - std::cos(y) - ratio * (std::sinh(y) - std::sin(y)));
  };
  const double omega = oscillation(mode, expected, 0).frequency;
  return {"swinging across", "E", "Pa", kYoungsModulus, kYoungsModulus * std::pow(omega / expected, 2)};
}

}  // namespace cutproof::benchmarks
