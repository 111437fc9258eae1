#include "baselines/mpm/mpm.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>

#include "baselines/mpm/mpm_kernels.h"

namespace cutproof::baselines::mpm_test {
namespace {

using namespace mpm;

constexpr double kSpacing = 0x1p-7;  // m
constexpr double kEps = std::numeric_limits<double>::epsilon();

// --- What tests draw. Each prints its seed when it fails. ---

class Draw {
 public:
  explicit Draw(uint64_t seed) : random_(seed), trace_(__FILE__, __LINE__, "seed " + std::to_string(seed)) {}
  double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  Vec3 vector(double most) { return {number(-most, most), number(-most, most), number(-most, most)}; }
  Mat3 matrix(double most) {
    Mat3 m;
    for (int row = 0; row < 3; ++row) m.row(row) = vector(most).transpose();
    return m;
  }
  Mat3 rotation() {
    return Eigen::Quaterniond(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1))
        .normalized()
        .toRotationMatrix();
  }

 private:
  std::mt19937_64 random_;
  testing::ScopedTrace trace_;
};

// --- Scenes ---

// A block of particles, of which `is_there` keeps some; tissue joins neighbours along axes.
Scene block(
    std::array<int32_t, 3> size, int frames = 4,
    const std::function<bool(int, int, int)>& is_there = [](int, int, int) { return true; }) {
  Scene scene;
  scene.spacing = kSpacing;
  scene.frame_time = 0x1p-7;
  scene.blade.resize(static_cast<std::size_t>(frames));
  std::map<std::array<int32_t, 3>, int32_t> number;
  for (int32_t x = 0; x < size[0]; ++x) {
    for (int32_t y = 0; y < size[1]; ++y) {
      for (int32_t z = 0; z < size[2]; ++z) {
        if (!is_there(x, y, z)) continue;
        number[{x, y, z}] = static_cast<int32_t>(scene.rest.size());
        scene.node.push_back({x, y, z});
        scene.rest.push_back(kSpacing * Vec3(x, y, z));
      }
    }
  }
  for (const auto& [at, i] : number) {
    for (const auto& next :
         {std::array<int32_t, 3>{at[0] + 1, at[1], at[2]}, {at[0], at[1] + 1, at[2]}, {at[0], at[1], at[2] + 1}}) {
      if (number.count(next) != 0) scene.edges.push_back({std::min(i, number[next]), std::max(i, number[next])});
    }
  }
  const std::size_t n = scene.rest.size();
  scene.velocity.assign(n, Vec3::Zero());
  scene.mass.assign(n, 1000 * kSpacing * kSpacing * kSpacing);
  scene.held.assign(n, 0);
  scene.kick.assign(n, Vec3::Zero());
  return scene;
}

// Across x, through everything, at so many spacings.
Patch wall(double at, double size = 40) {
  const double x = at * kSpacing, s = size * kSpacing;
  return {Vec3(x, -s, -s), Vec3(x, s, -s), Vec3(x, s, s), Vec3(x, -s, s)};
}

Parameters given(const std::string& text = "") { return {text.c_str(), known_parameters()}; }

// One of the programs.
struct Named {
  const char* name;
  Factory make;
};
void PrintTo(const Named& program, std::ostream* out) { *out << program.name; }
std::string why_not(const Named& program) {
#ifdef BASELINES_HAVE_CUDA
  if (std::string(program.name) != "cuda") return "";
  try {
    require_device();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
#endif
  (void)program;
  return "";
}
class EachProgram : public testing::TestWithParam<Named> {
 protected:
  void SetUp() override {
    const std::string why = why_not(GetParam());
    if (!why.empty()) GTEST_SKIP() << "no CUDA device: " << why;
  }
  std::unique_ptr<Simulator> make(const Scene& scene, const std::string& text = "") const {
    return GetParam().make(scene, given(text));
  }
  // Unit roundoff of its arithmetic.
  static double u() { return std::string(GetParam().name) == "cpu" ? kEps / 2 : 0x1p-24; }
};
const Named kPrograms[] = {
    {"cpu", make_mpm_cpu},
    {"host", make_mpm_host},
#ifdef BASELINES_HAVE_CUDA
    {"cuda", make_mpm_cuda},
#endif
};
std::string name_of(const testing::TestParamInfo<Named>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Mpm, EachProgram, testing::ValuesIn(kPrograms), name_of);
class Kernels : public EachProgram {};
INSTANTIATE_TEST_SUITE_P(Mpm, Kernels, testing::ValuesIn(kPrograms + 1, kPrograms + std::size(kPrograms)), name_of);

// The frames of a scene.
std::vector<Frame> run(Simulator& simulator, const Scene& scene) {
  std::vector<Frame> frames;
  for (std::size_t f = 0; f < scene.blade.size(); ++f) {
    if (static_cast<int>(f) == scene.kick_frame) simulator.kick(scene.kick);
    if (f > 0) simulator.advance(scene.frame_time);
    if (!scene.blade[f].empty()) simulator.cut(scene.blade[f]);
    simulator.finish();
    frames.push_back(simulator.frame(true));
  }
  return frames;
}

// What coupling joins, by members of some weight.
std::vector<int32_t> coupled(const Frame& frame, double least = 1e-6) {
  std::vector<std::array<int32_t, 2>> pairs;
  for (std::size_t g = 0; g + 1 < frame.offsets.size(); ++g) {
    int32_t first = -1;
    for (auto k = static_cast<std::size_t>(frame.offsets[g]); k < static_cast<std::size_t>(frame.offsets[g + 1]); ++k) {
      if (frame.weights[k] <= least) continue;
      if (first >= 0) pairs.push_back({first, frame.members[k]});
      first = frame.members[k];
    }
  }
  return components(static_cast<int32_t>(frame.position.size()), pairs);
}

bool is_finite(const Frame& frame) {
  const auto is_fine = [](const Vec3& a) { return a.allFinite(); };
  return std::all_of(frame.position.begin(), frame.position.end(), is_fine) &&
         std::all_of(frame.velocity.begin(), frame.velocity.end(), is_fine) &&
         std::all_of(frame.spin.begin(), frame.spin.end(), is_fine) &&
         std::all_of(frame.weights.begin(), frame.weights.end(), [](double w) { return w >= 0 && w <= 1; });
}

Vec3 momentum(const Scene& scene, const Frame& frame) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < scene.mass.size(); ++i) sum += scene.mass[i] * frame.velocity[i];
  return sum;
}
Vec3 angular_momentum(const Scene& scene, const Frame& frame) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < scene.mass.size(); ++i)
    sum += frame.position[i].cross(scene.mass[i] * frame.velocity[i]) + frame.spin[i];
  return sum;
}

// --- Small functions ---

TEST(MpmStencil, WeightsSumToOneAndAreCentred) {
  Draw draw(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const double cell = draw.number(0.5, 2);
    const Vec3 x = draw.vector(10);
    const Stencil stencil = stencil_of(x, cell);
    double sum = 0;
    Vec3 way = Vec3::Zero();
    Mat3 second = Mat3::Zero();
    for (int k = 0; k < 27; ++k) {
      const double w = stencil.weight[static_cast<std::size_t>(k)];
      const Vec3 to = place_of(node_of(stencil, k), cell) - x;
      ASSERT_GE(w, 0);
      ASSERT_LE(to.cwiseAbs().maxCoeff(), 1.5 * cell * (1 + 1e-12));
      sum += w;
      way += w * to;
      second += w * to * to.transpose();
    }
    EXPECT_NEAR(sum, 1, 1e-14);
    EXPECT_LE(way.norm(), 1e-13);
    EXPECT_LE((second - cell * cell / 4 * Mat3::Identity()).norm(), 1e-13);  // the D of APIC
  }
}

TEST(MpmMaterial, RotationsAreFreeOfStress) {
  Draw draw(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Mat3 r = draw.rotation();
    EXPECT_LE(kirchhoff_stress(r, 3, 5).norm(), 1e-13);
    EXPECT_LE((rotation_of(r) - r).norm(), 1e-13);
  }
}

TEST(MpmMaterial, StressIsTheGradientOfTheEnergy) {
  Draw draw(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Mat3 f = draw.rotation() * (Mat3::Identity() + draw.matrix(0.3));
    if (std::abs(f.determinant()) < 0.1) continue;
    const Mat3 stress = kirchhoff_stress(f, 3, 5) * f.inverse().transpose();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        const double step = 1e-5;
        Mat3 more = f, less = f;
        more(row, column) += step;
        less(row, column) -= step;
        const double slope = (energy_density(more, 3, 5) - energy_density(less, 3, 5)) / (2 * step);
        EXPECT_NEAR(stress(row, column), slope, 1e-7);
      }
    }
    EXPECT_LE((kirchhoff_stress(f, 3, 5) - kirchhoff_stress(f, 3, 5).transpose()).norm(), 1e-12);
  }
}

// General, inverted, flat and slender ones.
std::vector<Mat3> hard_deformations(Draw& draw) {
  std::vector<Mat3> all = {Mat3::Identity(), -Mat3::Identity() + 0.1 * draw.matrix(1), 1e-3 * draw.rotation()};
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 stretch[] = {{1.2, 1, 0.8}, {1.5, 0.9, -0.3}, {2, 1, 0}, {3, 0.01, 0.001}, {1, 1, 1}, {1.1, 0.7, -0.2}};
    all.push_back(draw.rotation() * stretch[trial % 6].asDiagonal() * draw.rotation());
  }
  return all;
}

TEST(MpmMaterial, NoRotationIsNearer) {
  Draw draw(4);
  for (const Mat3& f : hard_deformations(draw)) {
    const Mat3 r = rotation_of(f);
    ASSERT_LE((r * r.transpose() - Mat3::Identity()).norm(), 1e-13);
    ASSERT_GT(r.determinant(), 0);
    for (int other = 0; other < 50; ++other)
      EXPECT_GE((r.transpose() * f).trace(), (draw.rotation().transpose() * f).trace() - 1e-12);
    const Mat3 near = r * Eigen::AngleAxisd(0.01, draw.vector(1).normalized()).toRotationMatrix();
    EXPECT_GE((r.transpose() * f).trace(), (near.transpose() * f).trace() - 1e-12);
  }
}

mpm_kernels::M3 in_single(const Mat3& m) {
  mpm_kernels::M3 result;
  for (int row = 0; row < 3; ++row)
    result.row[row] = {static_cast<float>(m(row, 0)), static_cast<float>(m(row, 1)), static_cast<float>(m(row, 2))};
  return result;
}
Mat3 in_double(const mpm_kernels::M3& m) {
  Mat3 result;
  for (int row = 0; row < 3; ++row) result.row(row) << m.row[row].x, m.row[row].y, m.row[row].z;
  return result;
}

TEST(MpmMaterial, KernelsHaveTheSameRotationAndStress) {
  Draw draw(5);
  for (const Mat3& given_f : hard_deformations(draw)) {
    const Mat3 f = in_double(in_single(given_f));
    const Mat3 r = in_double(mpm_kernels::nearest_rotation(in_single(f)));
    EXPECT_LE((r * r.transpose() - Mat3::Identity()).norm(), 3e-6);
    EXPECT_GT(r.determinant(), 0);
    EXPECT_NEAR((r.transpose() * f).trace(), (rotation_of(f).transpose() * f).trace(), 3e-6 * f.norm()) << f;
    const mpm_kernels::M3 stress = mpm_kernels::stress_of(in_single(f), 3, 5);
    EXPECT_EQ(in_double(stress), in_double(stress).transpose());
    // Where the least singular values cancel, several rotations are best.
    const Eigen::Vector3d s = Eigen::JacobiSVD<Mat3>(f).singularValues();
    if (s[1] + (f.determinant() < 0 ? -s[2] : s[2]) > 0.1) {
      EXPECT_LE((in_double(stress) - kirchhoff_stress(f, 3, 5)).norm(), 3e-5 * (1 + f.squaredNorm())) << f;
    }
  }
}

TEST(MpmPlate, SideAndDistanceOfPlaces) {
  const Patch patch = {Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(2, 1, 0), Vec3(0, 1, 0)};
  for (const Vec3& foot : {Vec3(0.1, 0.9, 0), Vec3(1.9, 0.1, 0), Vec3(1, 0.5, 0)}) {
    const Near above = near_plate(patch, foot + 0.3 * Vec3::UnitZ(), 1),
               below = near_plate(patch, foot - 0.2 * Vec3::UnitZ(), 1);
    EXPECT_EQ(above.side, 1);
    EXPECT_NEAR(above.distance, 0.3, 1e-15);
    EXPECT_LE((above.normal - Vec3::UnitZ()).norm(), 1e-15);
    EXPECT_EQ(below.side, -1);
    EXPECT_NEAR(below.distance, -0.2, 1e-15);
    EXPECT_EQ(near_plate(patch, foot + 1.1 * Vec3::UnitZ(), 1).side, 0);  // beyond the reach
  }
  EXPECT_EQ(near_plate(patch, {2.1, 0.5, 0.1}, 1).side, 0);  // beside it
  EXPECT_EQ(near_plate(patch, {1, -0.1, 0.1}, 1).side, 0);
  const Vec3 point(1, 1, 1);
  EXPECT_EQ(near_plate({point, point, point, point}, point, 1).side, 0);  // no area
}

TEST(MpmPlate, LiesInTheTissueOnTheWay) {
  Draw draw(6);
  Scene scene = block({3, 3, 3});
  const Vec3 thrown = draw.vector(1);
  scene.velocity.assign(scene.rest.size(), thrown);
  scene.gravity = draw.vector(10);
  for (const int frame : {1, 3}) scene.blade[static_cast<std::size_t>(frame)] = {wall(1.5)};
  const int steps = 7;
  const double dt = scene.frame_time / steps;
  Vec3 x = Vec3::Zero(), v = thrown;  // of a free point
  std::map<int, std::vector<Vec3>> off;
  for (int frame = 1; frame < 4; ++frame) {
    for (int s = 0; s <= steps; ++s) {
      for (const Plate& plate : plates_at(scene, frame, s, steps)) off[frame].push_back(plate.patch[2] - x);
      if (s == steps) break;
      v += dt * scene.gravity;
      if (frame == 3) {
        EXPECT_LE((plates_at(scene, frame, s, steps)[0].velocity - v).norm(), 1e-13);
      }
      x += dt * v;
    }
    if (frame == 2) continue;
    ASSERT_EQ(off[frame].size(), static_cast<std::size_t>(steps) + 1);
    for (const Vec3& other : off[frame]) EXPECT_LE((other - off[frame][0]).norm(), 1e-14);
    EXPECT_EQ(plates_at(scene, frame, steps, steps)[0].patch, wall(1.5));
  }
  EXPECT_TRUE(plates_at(scene, 2, 0, steps).empty());
}

TEST(MpmPlate, GoesOnWhereItLiesInTheSamePlane) {
  Scene scene = block({3, 3, 3}, 4);
  Patch turned = wall(1.5, 20);
  std::reverse(turned.begin(), turned.end());
  scene.blade[1] = {wall(0.5), wall(1.5)};
  scene.blade[2] = {wall(1.5), wall(0.51), wall(0.8)};
  scene.blade[3] = {turned};
  const double cell = 2 * kSpacing;
  EXPECT_EQ(continued_plates(scene, 1, 10, cell), (std::vector<int32_t>{0, 0}));
  EXPECT_EQ(continued_plates(scene, 2, 10, cell), (std::vector<int32_t>{2, 1, 0}));
  EXPECT_EQ(continued_plates(scene, 3, 10, cell), (std::vector<int32_t>{-1}));
}

// --- Transfers ---

Points drawn_points(Draw& draw, int count = 60) {
  Points points;
  for (int i = 0; i < count; ++i) {
    points.x.push_back(draw.vector(3));
    points.v.push_back(draw.vector(2));
    points.affine.push_back(draw.matrix(1));
    points.deformation.push_back(Mat3::Identity() + draw.matrix(0.3));
    points.mass.push_back(draw.number(0.5, 2));
    points.volume.push_back(draw.number(0.5, 2));
  }
  points.label.assign(points.x.size(), 0);
  points.held.assign(points.x.size(), 0);
  points.impulse.assign(points.x.size(), Vec3::Zero());
  return points;
}
Settings settings_for(double cell) {
  Settings settings;
  settings.cell = cell;
  settings.mu = 3;
  settings.lambda = 5;
  return settings;
}
struct Sums {
  double mass = 0;
  Vec3 momentum = Vec3::Zero(), angular = Vec3::Zero();
};
Sums sums_of(const Points& points, double cell) {
  Sums sums;
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    const Mat3& c = points.affine[p];
    sums.mass += points.mass[p];
    sums.momentum += points.mass[p] * points.v[p];
    sums.angular += points.mass[p] * (points.x[p].cross(points.v[p]) +
                                      cell * cell / 4 * Vec3(c(2, 1) - c(1, 2), c(0, 2) - c(2, 0), c(1, 0) - c(0, 1)));
  }
  return sums;
}
Sums sums_of(const Grid& grid) {  // whose velocities are still momenta
  Sums sums;
  for (std::size_t i = 0; i < grid.node.size(); ++i) {
    sums.mass += grid.mass[i];
    sums.momentum += grid.velocity[i];
    sums.angular += place_of({grid.node[i][1], grid.node[i][2], grid.node[i][3]}, grid.cell).cross(grid.velocity[i]);
  }
  return sums;
}

TEST(MpmTransfer, ToTheGridKeepsMassAndMomenta) {
  Draw draw(7);
  const Points points = drawn_points(draw);
  Grid grid = grid_of(points, 0.9);
  to_grid(grid, points, settings_for(0.9), 0.01);
  const Sums before = sums_of(points, 0.9), after = sums_of(grid);
  EXPECT_NEAR(after.mass, before.mass, 1e-12);
  EXPECT_LE((after.momentum - before.momentum).norm(), 1e-11);
  EXPECT_LE((after.angular - before.angular).norm(), 1e-11);
}

TEST(MpmTransfer, BackToPointsKeepsMomenta) {
  Draw draw(8);
  Points points = drawn_points(draw);
  const Settings settings = settings_for(0.9);
  const Sums before = sums_of(points, 0.9);
  substep(points, settings, {}, Vec3::Zero(), 0.01);
  const Sums after = sums_of(points, 0.9);
  EXPECT_LE((after.momentum - before.momentum).norm(), 1e-11);
  EXPECT_LE((after.angular - before.angular).norm(), 1e-11);
}

TEST(MpmTransfer, ThereAndBackReproducesAffineFields) {
  Draw draw(9);
  Points points = drawn_points(draw);
  const Vec3 a = draw.vector(1);
  const Mat3 b = draw.matrix(1);
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    points.v[p] = a + b * points.x[p];
    points.affine[p] = b;
    points.deformation[p] = draw.rotation();  // no stress
  }
  const Points before = points;
  const double dt = 0.01;
  substep(points, settings_for(0.9), {}, Vec3::Zero(), dt);
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    EXPECT_LE((points.v[p] - before.v[p]).norm(), 1e-11);
    EXPECT_LE((points.affine[p] - b).norm(), 1e-11);
    EXPECT_LE((points.x[p] - before.x[p] - dt * before.v[p]).norm(), 1e-12);
    EXPECT_LE((points.deformation[p] - (Mat3::Identity() + dt * b) * before.deformation[p]).norm(), 1e-12);
  }
}

TEST(MpmTransfer, PointsOfDifferentLabelsShareNoNode) {
  Draw draw(10);
  Points points = drawn_points(draw);
  for (std::size_t p = 0; p < points.x.size(); ++p) points.label[p] = static_cast<int32_t>(p % 2);
  Points kicked = points;
  kicked.v[0] += Vec3(1, 2, 3);
  substep(points, settings_for(0.9), {}, Vec3::Zero(), 0.01);
  substep(kicked, settings_for(0.9), {}, Vec3::Zero(), 0.01);
  int moved = 0;
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    if (p % 2 == 1) {
      EXPECT_EQ(points.x[p], kicked.x[p]);
    }
    moved += points.x[p] != kicked.x[p];
  }
  EXPECT_GT(moved, 1);
}

// --- The plate in the tissue ---

struct Cut {
  Points points;
  Settings settings;
  std::vector<Plate> plates;
};
// A block that moves at random, with a plate through its middle.
Cut cut_block(Draw& draw, double speed) {
  const Scene scene = block({8, 4, 4});
  Cut cut;
  cut.settings = settings_of(scene, given());
  Points& points = cut.points;
  points.x = scene.rest;
  points.mass = scene.mass;
  points.volume = cut.settings.volume;
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    points.v.push_back(draw.vector(speed));
    points.affine.push_back(draw.matrix(speed / kSpacing));
    points.deformation.push_back(Mat3::Identity() + draw.matrix(0.01));
  }
  points.label.assign(points.x.size(), 0);
  points.held.assign(points.x.size(), 0);
  points.impulse.assign(points.x.size(), Vec3::Zero());
  cut.plates = {{wall(3.4), draw.vector(speed)}};
  return cut;
}

TEST(MpmPlate, ChangesTheMomentumOfEachPieceByItsImpulseAlone) {
  Draw draw(11);
  Cut cut = cut_block(draw, 0.05);
  const Points before = cut.points;
  const Vec3 gravity(1, 2, -9);
  const double dt = 1e-4;
  const int steps = 20;
  for (int s = 0; s < steps; ++s) substep(cut.points, cut.settings, cut.plates, gravity, dt);
  for (const bool right : {false, true}) {
    Vec3 gained = Vec3::Zero(), from_plate = Vec3::Zero();
    double mass = 0;
    for (std::size_t p = 0; p < before.x.size(); ++p) {
      if ((before.x[p].x() > 3.4 * kSpacing) != right) continue;
      mass += before.mass[p];
      gained += before.mass[p] * (cut.points.v[p] - before.v[p]);
      from_plate += cut.points.impulse[p];
    }
    EXPECT_GT(from_plate.norm(), 1e-3 * mass * 0.05);
    EXPECT_LE((gained - from_plate - steps * dt * mass * gravity).norm(), 1e-12 * mass);
  }
}

TEST(MpmPlate, LetsNothingThrough) {
  Draw draw(12);
  Cut one = cut_block(draw, 0.05), other = one;
  for (std::size_t p = 0; p < one.points.x.size(); ++p) {
    if (one.points.x[p].x() < 3.4 * kSpacing) other.points.v[p] += Vec3(-0.1, 0.2, 0.1);
  }
  for (int s = 0; s < 20; ++s) {
    substep(one.points, one.settings, one.plates, Vec3::Zero(), 1e-4);
    substep(other.points, other.settings, other.plates, Vec3::Zero(), 1e-4);
  }
  for (std::size_t p = 0; p < one.points.x.size(); ++p)
    EXPECT_EQ(one.points.v[p] == other.points.v[p], p >= 64) << "point " << p;
}

TEST_P(EachProgram, LeavesRestingTissueAloneWhenAPlateIsThere) {
  Scene scene = block({6, 4, 4});
  scene.blade[1] = scene.blade[2] = {wall(2.3)};
  const auto simulator = make(scene, "labels=0");
  for (const Frame& frame : run(*simulator, scene)) {
    EXPECT_EQ(frame.position, scene.rest);
    EXPECT_EQ(*frame.contact_impulse, Vec3(0, 0, 0));
  }
}

TEST_P(EachProgram, StopsWhatIsThrownAtThePlate) {
  Scene scene = block({8, 4, 4}, 12);
  for (std::size_t f = 1; f < 12; ++f) scene.blade[f] = {wall(3.5)};
  scene.kick_frame = 1;
  for (std::size_t i = 0; i < 64; ++i) scene.kick[i] = Vec3(0.2, 0.1, 0);  // 0.25 spacings a frame
  for (const double friction : {0.0, 0.5}) {
    SCOPED_TRACE(friction);
    const auto simulator = make(scene, "labels=0,friction=" + std::to_string(friction));
    const std::vector<Frame> frames = run(*simulator, scene);
    const double thrown = 64 * scene.mass[0] * 0.2;
    Vec3 impulse = Vec3::Zero();
    for (const Frame& frame : frames) impulse += *frame.contact_impulse;
    EXPECT_LT(impulse.x(), -thrown);  // it turns back
    for (std::size_t i = 0; i < 64; ++i) EXPECT_LT(frames.back().position[i].x(), 3.5 * kSpacing);
    if (friction == 0) {
      // Nothing but the stresses of a sheared stencil that the plate cuts off.
      EXPECT_LE(std::abs(impulse.y()), 1e-3 * thrown);
    } else {
      // Coulomb: a share of the normal impulse, against the motion, and no more than stops it.
      EXPECT_LT(impulse.y(), -0.1 * thrown);
      EXPECT_GE(impulse.y(), -std::min(0.5 * -impulse.x(), 0.5 * thrown) * 1.01);
    }
    EXPECT_LE((momentum(scene, frames.back()) - 64 * scene.mass[0] * scene.kick[0] - impulse).norm(),
              1e3 * u() * thrown);
  }
}

TEST_P(EachProgram, DrivesBackWhatHasGoneThrough) {
  // Half a spacing of tissue slips behind a plate that is carried on meanwhile.
  Scene scene = block({4, 4, 4}, 6);
  scene.blade[1] = {wall(3.3)};
  for (std::size_t f = 2; f < 6; ++f) scene.blade[f] = {wall(3.3 - 0.09 * static_cast<double>(f - 1))};
  const auto simulator = make(scene, "labels=0"), weak = make(scene, "labels=0,push=0");
  const Frame pushed = run(*simulator, scene).back(), left = run(*weak, scene).back();
  EXPECT_LT(pushed.position[63].x(), 3 * kSpacing);  // behind the plate in the last frames, at 2.94 spacings
  EXPECT_GE(left.position[63].x(), 3 * kSpacing * (1 - 1e-6));
}

// --- Whole runs ---

TEST_P(EachProgram, FallsFreely) {
  Draw draw(13);
  Scene scene = block({5, 3, 2}, 6);
  const Vec3 thrown = draw.vector(0.5), gravity(1, -2, -9.81);
  scene.velocity.assign(scene.rest.size(), thrown);
  scene.gravity = gravity;
  scene.blade[2] = {wall(2.4)};
  for (Vec3& corner : scene.blade[2][0])
    corner += 2 * scene.frame_time * thrown + 2 * scene.frame_time * scene.frame_time * gravity;
  const auto simulator = make(scene);
  const std::vector<Frame> frames = run(*simulator, scene);
  const double dt = scene.frame_time / simulator->substeps();
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const double steps = static_cast<double>(f) * simulator->substeps();
    for (std::size_t i = 0; i < scene.rest.size(); ++i) {
      const Vec3 x = scene.rest[i] + steps * dt * thrown + 0.5 * steps * (steps + 1) * dt * dt * gravity;
      EXPECT_LE((frames[f].position[i] - x).norm(), 1e3 * u() * 8 * kSpacing) << "frame " << f;
      EXPECT_LE((frames[f].velocity[i] - thrown - steps * dt * gravity).norm(), 1e3 * u());
    }
  }
}

TEST_P(EachProgram, KeepsTheSpinOfAFreeBlock) {
  Scene scene = block({5, 4, 3}, 100);
  const Vec3 centre = kSpacing * Vec3(2, 1.5, 1);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) scene.velocity[i] = Vec3(1, 2, -3).cross(scene.rest[i] - centre);
  const auto simulator = make(scene);
  const std::vector<Frame> frames = run(*simulator, scene);
  const Vec3 first = angular_momentum(scene, frames.front());
  for (const Frame& frame : frames)
    EXPECT_LE((angular_momentum(scene, frame) - first).norm(), 2000 * u() * first.norm());
  EXPECT_GT((frames.back().position[0] - scene.rest[0]).norm(), kSpacing);  // it has turned
}

// Scenes with all that there is, with lengths, velocities, and accelerations of `unit`.
Scene drawn_scene(uint64_t seed, double unit = 1) {
  Draw draw(seed);
  const auto drawn_holes = [&](int, int, int) { return draw.number(0, 1) > 0.1; };
  Scene scene = block({draw.whole(3, 6), draw.whole(2, 4), draw.whole(1, 4)}, 6, drawn_holes);
  const Mat3 turning = draw.matrix(2);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) {
    scene.velocity[i] = turning * scene.rest[i] + draw.vector(0.2 * kSpacing);
    scene.held[i] = seed % 3 == 0 && scene.node[i][0] == 0;
    scene.rest[i] += draw.vector(0.2 * kSpacing);
    scene.mass[i] *= draw.number(0.5, 2);
  }
  scene.gravity = draw.vector(5);
  for (const std::size_t frame : {1, 2, 4}) {
    const Vec3 middle = kSpacing * Vec3(draw.number(1, 3), draw.number(0, 2), draw.number(0, 2));
    const Mat3 turn = draw.rotation();
    Patch patch;
    for (std::size_t c = 0; c < 4; ++c)
      patch[c] = middle + turn * (kSpacing * Vec3(0, c == 0 || c == 3 ? -3.3 : 4.1, c < 2 ? -3.7 : 3.9));
    scene.blade[frame].push_back(patch);
  }
  scene.spacing *= unit;
  scene.gravity *= unit;
  for (auto* const list : {&scene.rest, &scene.velocity}) {
    for (Vec3& a : *list) a *= unit;
  }
  for (double& m : scene.mass) m *= unit * unit * unit;
  for (auto& patches : scene.blade) {
    for (Patch& patch : patches) {
      for (Vec3& corner : patch) corner *= unit;
    }
  }
  return scene;
}

TEST_P(EachProgram, HasNoUnits) {
  const std::string text = "friction=0.3,youngs_modulus=";
  for (uint64_t seed = 100; seed < 104; ++seed) {
    const Scene scene = drawn_scene(seed), twice = drawn_scene(seed, 2);
    const auto one = make(scene, text + "1000"), other = make(twice, text + "4000");
    ASSERT_EQ(one->substeps(), other->substeps());
    const std::vector<Frame> frames = run(*one, scene), of_twice = run(*other, twice);
    for (std::size_t f = 0; f < frames.size(); ++f) {
      for (std::size_t i = 0; i < scene.rest.size(); ++i) {
        EXPECT_EQ(2 * frames[f].position[i], of_twice[f].position[i]) << "seed " << seed << ", frame " << f;
        EXPECT_EQ(2 * frames[f].velocity[i], of_twice[f].velocity[i]);
      }
      EXPECT_EQ(16 * *frames[f].contact_impulse, *of_twice[f].contact_impulse);
      EXPECT_EQ(frames[f].members, of_twice[f].members);
    }
  }
}

TEST_P(EachProgram, KeepsMomentum) {
  for (uint64_t seed = 200; seed < 206; ++seed) {
    const Scene scene = drawn_scene(seed);
    const auto simulator = make(scene, "friction=0.2");
    const std::vector<Frame> frames = run(*simulator, scene);
    const double mass = std::accumulate(scene.mass.begin(), scene.mass.end(), 0.0);
    for (std::size_t f = 1; f < frames.size(); ++f) {
      const Vec3 gained = momentum(scene, frames[f]) - momentum(scene, frames[f - 1]);
      EXPECT_LE((gained - scene.frame_time * mass * scene.gravity - *frames[f].contact_impulse).norm(),
                1e3 * u() * mass * 0.5)
          << "seed " << seed << ", frame " << f;
    }
    const bool is_held = std::count(scene.held.begin(), scene.held.end(), 1) > 0;
    for (std::size_t i = 0; is_held && i < scene.rest.size(); ++i) {
      if (scene.held[i] != 0) {
        EXPECT_EQ(frames.back().position[i], frames.front().position[i]);
      }
    }
  }
}

TEST_P(EachProgram, DecaysByTheDamping) {
  Scene scene = block({3, 3, 3}, 5);
  scene.velocity.assign(scene.rest.size(), Vec3(0.1, 0.2, 0.3));
  const auto simulator = make(scene, "damping=20");
  EXPECT_EQ(simulator->damping(), 20);
  const std::vector<Frame> frames = run(*simulator, scene);
  const double kept = std::exp(-20 * 4 * scene.frame_time);
  for (const Vec3& v : frames.back().velocity) EXPECT_LE((v - kept * scene.velocity[0]).norm(), 1e3 * u());
}

// A bar that is held at one end hangs by its stresses: it comes to rest, and does not creep. Its sag is that of a beam
// in bending and shear, ρ g L⁴ / 8 E I + ρ g L² / 2 κ G with κ = 5/6. The grid knows the clamp's place within half a
// cell of the 8 cells of L: 1.0625⁴ = 1.27; a beam of two cells' thickness on splines, and a Poisson's ratio of 0, take
// 8 % more.
TEST_P(EachProgram, HeldBarHangsLikeABeam) {
  constexpr int kHeld = 8, kFree = 16, kThick = 4;
  Scene scene = block({kHeld + kFree, kThick, kThick}, 40);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) scene.held[i] = scene.node[i][0] < kHeld;
  scene.gravity = Vec3(0, 0, -9.81);
  const double young = 5e5, length = kFree * kSpacing, thick = kThick * kSpacing, weight = 1000 * 9.81;
  const double bending = weight * std::pow(length, 4) * 12 / (8 * young * thick * thick);
  const double shear = weight * length * length / (2 * (5.0 / 6) * (young / 2));
  const auto simulator = make(scene, "youngs_modulus=5e5,poisson_ratio=0,damping=80");
  const std::vector<Frame> frames = run(*simulator, scene);
  const auto sag = [&](const Frame& frame, int32_t layer) {
    double sum = 0;
    for (std::size_t i = 0; i < scene.rest.size(); ++i) {
      if (scene.node[i][0] == layer) sum += scene.rest[i].z() - frame.position[i].z();
    }
    return sum / (kThick * kThick);
  };
  const int32_t tip = kHeld + kFree - 1;
  std::printf("sag of the tip %.4g m, of a beam %.4g m; of the first free layer %.3g m\n", sag(frames.back(), tip),
              bending + shear, sag(frames.back(), kHeld));
  EXPECT_NEAR(sag(frames.back(), tip) / (bending + shear), 1, 0.35);
  EXPECT_NEAR(sag(frames[30], tip), sag(frames.back(), tip), 0.005 * bending);
  EXPECT_LT(std::abs(sag(frames.back(), kHeld)), 0.05 * bending);
  // At rest the clamp bears the weight.
  const double mass = static_cast<double>(scene.rest.size()) * scene.mass[0];
  EXPECT_LE((*frames.back().contact_impulse + mass * scene.frame_time * scene.gravity).norm(),
            0.01 * mass * scene.frame_time * 9.81);
}

TEST_P(EachProgram, AnswersTwiceWithTheSameBits) {
  const Scene scene = drawn_scene(300);
  const auto one = make(scene), other = make(scene);
  const std::vector<Frame> frames = run(*one, scene), again = run(*other, scene);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    EXPECT_EQ(frames[f].position, again[f].position);
    EXPECT_EQ(frames[f].members, again[f].members);
    EXPECT_EQ(frames[f].weights, again[f].weights);
  }
}

// Cut through, the blade is withdrawn, and one piece is kicked.
double ghost_force(const std::function<std::unique_ptr<Simulator>(const Scene&)>& make, Scene scene) {
  scene.blade[2] = {wall(3.4)};
  scene.kick_frame = 3;
  const std::vector<Frame> frames = run(*make(scene), scene);
  for (std::size_t i = 0; i < 64; ++i) scene.kick[i] = Vec3(-0.3, 0.2, 0.1);
  const std::vector<Frame> kicked = run(*make(scene), scene);
  double most = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    for (std::size_t i = 64; i < 128; ++i)
      most = std::max(most, (frames[f].position[i] - kicked[f].position[i]).norm());
  }
  EXPECT_NE(frames.back().position[0], kicked.back().position[0]);
  return most;
}

TEST_P(EachProgram, LabelsKeepPiecesApartToTheBit) {
  Scene scene = block({8, 4, 4}, 8);
  Draw draw(14);
  for (Vec3& v : scene.velocity) v = draw.vector(0.01);
  EXPECT_EQ(ghost_force([&](const Scene& s) { return make(s, "labels=1"); }, scene), 0);
  EXPECT_GT(ghost_force([&](const Scene& s) { return make(s, "labels=0"); }, scene), 0.01 * kSpacing);
}

// The published method: coupled, parted while the plate is there, coupled again.
TEST_P(EachProgram, HealsWithoutLabels) {
  Scene scene = block({6, 4, 4}, 5);
  scene.blade[2] = scene.blade[3] = {wall(2.4)};
  const auto pieces = [&](const Frame& frame) {
    const std::vector<int32_t> piece = coupled(frame);
    return 1 + *std::max_element(piece.begin(), piece.end());
  };
  for (const bool labels : {false, true}) {
    const auto simulator = make(scene, labels ? "labels=1" : "labels=0");
    const std::vector<Frame> frames = run(*simulator, scene);
    std::vector<int> counts;
    for (const Frame& frame : frames) counts.push_back(pieces(frame));
    EXPECT_EQ(counts, (std::vector<int>{1, 1, 2, 2, labels ? 2 : 1}));
  }
}

TEST_P(EachProgram, KickIsFeltAcrossAGapNarrowerThanTheKernel) {
  const Factory factory = GetParam().make;
  std::printf("gap / dx, share of a kick felt across it with labels=0 and 1\n");
  double last = 1;
  for (const double gap : {0.25, 0.45, 0.75, 1.0, 1.5, 2.0, 2.5, 2.9, 3.05, 4.0}) {
    const double felt = kick_felt_across(factory, gap, 0), with_labels = kick_felt_across(factory, gap, 1);
    std::printf("%4.2f  %.3g  %.3g\n", gap, felt, with_labels);
    EXPECT_EQ(with_labels, 0);
    if (gap < 0.5) {
      EXPECT_GT(felt, 0.01);
    }
    if (gap > 3) {
      EXPECT_EQ(felt, 0);
    }
    // Beyond, what is left is as small as waves in the block.
    if (gap <= 2) {
      EXPECT_LT(felt, last);
    }
    last = felt;
  }
}

TEST_P(EachProgram, GroupsArePointsAtNodes) {
  const Scene scene = drawn_scene(400);
  const auto simulator = make(scene);
  const Frame frame = simulator->frame(true);
  for (std::size_t g = 0; g + 1 < frame.offsets.size(); ++g) {
    const auto begin = static_cast<std::size_t>(frame.offsets[g]), end = static_cast<std::size_t>(frame.offsets[g + 1]);
    ASSERT_LT(begin, end);
    EXPECT_EQ(*std::max_element(&frame.weights[begin], &frame.weights[0] + end), 1);
    const std::set<int32_t> members(&frame.members[begin], &frame.members[0] + end);
    EXPECT_EQ(members.size(), end - begin);
    // All members see one node: they lie in a cube of three cells.
    for (const int32_t a : members) {
      for (const int32_t b : members) {
        const Vec3 way = frame.position[static_cast<std::size_t>(a)] - frame.position[static_cast<std::size_t>(b)];
        EXPECT_LE(way.cwiseAbs().maxCoeff(), 3 * 2 * kSpacing * (1 + 8 * u()));
      }
    }
  }
  // Each point's greatest weight in its groups is at least that of its nearest node alone.
  std::vector<int> groups(scene.rest.size(), 0);
  for (const int32_t i : frame.members) ++groups[static_cast<std::size_t>(i)];
  EXPECT_GE(*std::min_element(groups.begin(), groups.end()), 8);
}

// --- Kernels against the program in double precision ---

TEST_P(Kernels, AStepIsThatOfTheProgramInDoublePrecision) {
  int contacts = 0, parted = 0;
  for (uint64_t seed = 500; seed < 540; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Scene scene = drawn_scene(seed);
    scene.frame_time = 0x1p-10;
    const std::string text = "steps=1,friction=0.3,labels=" + std::to_string(seed % 2);
    const auto cpu = make_mpm_cpu(scene, given(text)), other = make(scene, text);
    ASSERT_EQ(cpu->substeps(), 1);
    ASSERT_EQ(other->substeps(), 1);
    scene.blade.resize(2);
    const Frame expected = run(*cpu, scene).back(), found = run(*other, scene).back();
    const double mass = *std::max_element(scene.mass.begin(), scene.mass.end());
    for (std::size_t i = 0; i < scene.rest.size(); ++i) {
      EXPECT_LE((found.position[i] - expected.position[i]).norm(), 1e-5 * kSpacing);
      EXPECT_LE((found.velocity[i] - expected.velocity[i]).norm(), 1e-5 * kSpacing / scene.frame_time);
      EXPECT_LE((found.spin[i] - expected.spin[i]).norm(), 1e-4 * mass * kSpacing * kSpacing / scene.frame_time);
    }
    EXPECT_LE((*found.contact_impulse - *expected.contact_impulse).norm(),
              1e-5 * mass * static_cast<double>(scene.rest.size()) * kSpacing / scene.frame_time);
    EXPECT_EQ(coupled(found, 1e-5), coupled(expected, 1e-5));
    contacts += expected.contact_impulse->norm() > 0;
    const std::vector<int32_t> piece = coupled(expected);
    parted += *std::max_element(piece.begin(), piece.end()) > 0;
  }
  EXPECT_GT(contacts, 20);
  EXPECT_GT(parted, 10);
}

TEST_P(Kernels, RunsStayBesideThoseInDoublePrecision) {
  for (uint64_t seed = 600; seed < 612; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scene scene = drawn_scene(seed);
    const auto cpu = make_mpm_cpu(scene, given()), other = make(scene);
    const std::vector<Frame> expected = run(*cpu, scene), found = run(*other, scene);
    for (std::size_t f = 0; f < expected.size(); ++f) {
      for (std::size_t i = 0; i < scene.rest.size(); ++i)
        ASSERT_LE((found[f].position[i] - expected[f].position[i]).norm(), 1e-3 * kSpacing) << "frame " << f;
      ASSERT_EQ(coupled(found[f], 1e-5), coupled(expected[f], 1e-5)) << "frame " << f;
    }
  }
}

// On a device each allocation and each copy to the host waits for all kernels before it.
struct Counting : Host {
  inline static int waits = 0;
  template <class T>
  struct Array : Host::Array<T> {
    explicit Array(std::size_t size = 0) : Host::Array<T>(size) { waits += size > 0; }
    explicit Array(const std::vector<T>& values) : Host::Array<T>(values) { ++waits; }
    std::vector<T> copy() const {
      ++waits;
      return Host::Array<T>::copy();
    }
  };
};

TEST(MpmKernels, SubstepsDoNotWait) {
  const Scene scene = drawn_scene(500);
  mpm_kernels::Program<Counting> program(scene, given());
  program.advance(scene.frame_time);
  Counting::waits = 0;
  program.advance(scene.frame_time);
  EXPECT_EQ(Counting::waits, 0);
}

// --- Hard cases ---

// Finite, or refused with a sentence.
testing::AssertionResult is_sane(const std::function<std::unique_ptr<Simulator>()>& make, const Scene& scene) {
  try {
    const auto simulator = make();
    for (const Frame& frame : run(*simulator, scene)) {
      if (!is_finite(frame)) return testing::AssertionFailure() << "a frame holds what is no number";
      if (frame.position.size() != scene.rest.size()) return testing::AssertionFailure() << "points are missing";
    }
  } catch (const std::exception& error) {
    if (std::string(error.what()).find("; ") == std::string::npos)
      return testing::AssertionFailure() << "no remedy in: " << error.what();
  }
  return testing::AssertionSuccess();
}

TEST_P(EachProgram, StaysFiniteInHardCases) {
  std::map<std::string, Scene> scenes;
  scenes["no particle"] = block({0, 0, 0});
  scenes["one particle"] = block({1, 1, 1});
  scenes["one cell"] = block({2, 2, 2});
  Scene& cut = scenes["everything cut away"] = block({3, 3, 3});
  for (const double at : {0.5, 1.5}) cut.blade[1].push_back(wall(at));
  for (int axis = 1; axis < 3; ++axis) {
    for (const double at : {0.5, 1.5}) {
      Patch patch = wall(at);
      for (Vec3& corner : patch) std::swap(corner[0], corner[axis]);
      cut.blade[1].push_back(patch);
    }
  }
  scenes["isolated"] = block({5, 5, 1}, 4, [](int x, int y, int) { return (x + y) % 2 == 0; });
  Scene& one_place = scenes["all at one place"] = block({3, 3, 3});
  one_place.rest.assign(one_place.rest.size(), Vec3(0.1, 0.1, 0.1));
  Scene& inverted = scenes["inverted"] = block({4, 4, 4}, 6);
  for (std::size_t i = 0; i < inverted.rest.size(); ++i) inverted.velocity[i] = -150.0 * inverted.rest[i];
  Scene& sliver = scenes["flattened"] = block({4, 4, 4}, 6);
  for (std::size_t i = 0; i < sliver.rest.size(); ++i) sliver.velocity[i].x() = -60.0 * sliver.rest[i].x();
  Scene& fast = scenes["fast"] = block({3, 3, 3});
  for (std::size_t i = 0; i < fast.rest.size(); ++i) fast.velocity[i] = (i % 2 == 0 ? 1e4 : -1e4) * Vec3(1, 1, 1);
  Scene& long_frame = scenes["a long frame"] = block({3, 3, 3});
  long_frame.frame_time = 10;
  long_frame.velocity[0] = Vec3(1, 0, 0);
  scenes["a very long frame"] = long_frame;
  scenes["a very long frame"].frame_time = 1e9;
  Scene& flat = scenes["a plate without area"] = block({3, 3, 3});
  flat.blade[1] = {wall(1.5, 0)};
  Scene& on_plate = scenes["points in the plate"] = block({3, 3, 3});
  on_plate.blade[1] = on_plate.blade[2] = {wall(1)};
  Scene& twice = scenes["the same plate twice"] = block({3, 3, 3});
  twice.blade[1] = {wall(1.4), wall(1.4)};
  for (auto& [name, scene] : scenes) {
    SCOPED_TRACE(name);
    if (scene.rest.size() > 1 && scene.velocity[1].norm() == 0) scene.velocity[1] = Vec3(0.01, 0, 0);
    if (name == "a long frame") scene.blade.resize(2);
    EXPECT_TRUE(is_sane([&] { return make(scene); }, scene));
    EXPECT_TRUE(is_sane([&] { return make(scene, "labels=0,friction=1"); }, scene));
  }
  EXPECT_THROW(make(scenes["a very long frame"]), std::invalid_argument);
  // Each particle a piece of its own.
  const auto simulator = make(cut);
  const std::vector<int32_t> piece = coupled(run(*simulator, cut).back());
  EXPECT_EQ(*std::max_element(piece.begin(), piece.end()), 26);
}

TEST_P(EachProgram, RefusesBadParametersByName) {
  const Scene scene = block({2, 2, 2});
  for (const char* const bad : {"youngs_modulus=-1", "poisson_ratio=0.5", "poisson_ratio=-1", "density=-1", "steps=0",
                                "steps=1.5", "steps=1e7", "damping=-1", "cell=0", "cell=17", "labels=2", "friction=-1",
                                "push=-1", "push=11", "stepz=1", "steps=nan", "steps="}) {
    try {
      make(scene, bad);
      ADD_FAILURE() << bad << " is taken";
    } catch (const std::invalid_argument& error) {
      const std::string name = std::string(bad).substr(0, std::string(bad).find('='));
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("; give "), std::string::npos) << error.what();
    }
  }
  Scene massless = scene;
  massless.mass[3] = 0;
  EXPECT_THROW(make(massless), std::invalid_argument);
}

TEST_P(Kernels, TakeSixteenPlatesAFrame) {
  Scene scene = block({2, 2, 2});
  scene.blade[1].assign(16, wall(0.5));
  EXPECT_NO_THROW(run(*make(scene), scene));
  scene.blade[1].push_back(wall(0.5));
  EXPECT_THROW(make(scene), std::invalid_argument);
}

TEST(MpmSettings, SubstepsFollowTheSpeedOfWaves) {
  // Soft tissue: 10 kPa, 0.45, 1000 kg/m³. λ + 2 μ = 37.9 kPa, c = 6.16 m/s, 0.3 dx / c = 0.195 ms at dx = 4 mm.
  Scene scene = block({2, 2, 2});
  scene.spacing = 0.002;
  scene.frame_time = 0.016;
  const Settings settings = settings_of(scene, given("youngs_modulus=10000,poisson_ratio=0.45,density=1000,steps=1"));
  const double c = std::sqrt(1e4 * 0.55 / (1.45 * 0.1) / 1000);
  EXPECT_EQ(settings.substeps, static_cast<int>(std::ceil(0.016 * c / (0.3 * 0.004))));
  EXPECT_NEAR(settings.volume[0], scene.mass[0] / 1000, 1e-18);
  EXPECT_EQ(settings_of(scene, given("youngs_modulus=10,steps=7")).substeps, 7);
}

// --- The judge ---

std::pair<int, std::string> judged(const std::string& arguments) {
  const char* const other = std::getenv("CUTPROOF");
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("cutproof.mpm." + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const std::string command = "cd '" + folder.string() + "' && '" + (other != nullptr ? other : CUTPROOF_PROGRAM) +
                              "' judge " + arguments + " 2>&1";
  FILE* const pipe = popen(command.c_str(), "r");
  std::string output;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) output += static_cast<char>(c);
  const int status = pclose(pipe);
  std::filesystem::remove_all(folder);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, output};
}

TEST(MpmJudge, HoldsWithLabels) {
  for (const char* const plugin : {PLUGINS "/mpm_cpu.so", PLUGINS "/mpm_host.so"}) {
    const auto [status, output] = judged("'" + std::string(plugin) + "' dissect --cases 20 --seed 1");
    EXPECT_EQ(status, 0) << output;
    EXPECT_NE(output.find("all hold"), std::string::npos) << output;
  }
}

const std::string kCpu = "'" PLUGINS "/mpm_cpu.so'";

TEST(MpmJudge, FindsThatThePublishedMethodHeals) {
  const auto [status, output] = judged(kCpu + " dissect --cases 20 --seed 1 --shrink 0 --parameters labels=0");
  EXPECT_EQ(status, 1) << output;
  EXPECT_NE(output.find("no coupling across pieces"), std::string::npos) << output;
}

TEST(MpmJudge, SaysWhichParameterIsBad) {
  const auto [status, output] = judged(kCpu + " dissect --cases 1 --parameters cell=0");
  EXPECT_EQ(status, 2) << output;
  EXPECT_NE(output.find("'cell'"), std::string::npos) << output;
}

}  // namespace
}  // namespace cutproof::baselines::mpm_test
