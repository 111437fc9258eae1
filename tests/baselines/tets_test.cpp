#include "baselines/tets/tets.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <string>

namespace cutproof::baselines::tets {
namespace {

using Random = std::mt19937_64;
using Make = std::unique_ptr<Simulator> (*)(const Scene&, const Parameters&);

constexpr double kRounding = 1e-13;  // of sums of some thousand numbers, relative

double number(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3 vector(Random& random, double most) {
  const double x = number(random, -most, most), y = number(random, -most, most);
  return {x, y, number(random, -most, most)};
}

// A block of cells around one diagonal of each cube, at rest, in the air.
Scene block(std::array<int, 3> nodes, double h, Vec3 origin = Vec3::Zero()) {
  Scene scene;
  scene.spacing = h;
  std::map<std::array<int, 3>, int32_t> of_node;
  for (int z = 0; z < nodes[2]; ++z) {
    for (int y = 0; y < nodes[1]; ++y) {
      for (int x = 0; x < nodes[0]; ++x) {
        of_node[{x, y, z}] = static_cast<int32_t>(scene.rest.size());
        scene.node.push_back({x, y, z});
        scene.rest.push_back(origin + h * Vec3(x, y, z));
      }
    }
  }
  for (const auto& [node, i] : of_node) {
    std::array<int32_t, 8> cube{};
    bool is_whole = true;
    for (int c = 0; c < 8; ++c) {
      const auto found = of_node.find({node[0] + (c & 1), node[1] + (c >> 1 & 1), node[2] + (c >> 2)});
      is_whole = is_whole && found != of_node.end();
      if (is_whole) cube[static_cast<std::size_t>(c)] = found->second;
    }
    if (!is_whole) continue;
    for (const auto& t :
         {std::array{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 3, 2, 7}, {0, 6, 4, 7}, {0, 5, 1, 7}}) {
      std::array<int32_t, 4> corners{};
      for (std::size_t k = 0; k < 4; ++k) corners[k] = cube[static_cast<std::size_t>(t[k])];
      scene.tetrahedra.push_back(corners);
    }
  }
  const std::size_t n = scene.rest.size();
  scene.velocity.assign(n, Vec3::Zero());
  scene.kick.assign(n, Vec3::Zero());
  scene.mass.assign(n, 1000 * h * h * h);
  scene.held.assign(n, 0);
  return scene;
}

// As a drawn scene: it falls, turns, stretches and shakes.
void disturb(Scene& scene, Random& random) {
  const Vec3 spin = vector(random, 2), stretch = vector(random, 2);
  scene.gravity = vector(random, 10);
  for (std::size_t i = 0; i < scene.rest.size(); ++i)
    scene.velocity[i] = spin.cross(scene.rest[i]) + stretch.cwiseProduct(scene.rest[i]) + vector(random, scene.spacing);
}

// A patch through all of the scene along a plane.
Patch plane(const Vec3& point, const Vec3& normal, double size) {
  const Vec3 along = normal.unitOrthogonal(), across = normal.normalized().cross(along);
  return {point + size * (along + across), point + size * (across - along), point - size * (along + across),
          point + size * (along - across)};
}

struct Totals {
  double mass = 0;
  Vec3 momentum = Vec3::Zero(), moment = Vec3::Zero(), spin = Vec3::Zero();  // moment: mass times place
};
Totals totals(const Frame& frame) {
  Totals sum;
  for (std::size_t i = 0; i < frame.position.size(); ++i) {
    sum.mass += frame.mass[i];
    sum.momentum += frame.mass[i] * frame.velocity[i];
    sum.moment += frame.mass[i] * frame.position[i];
    sum.spin += frame.mass[i] * frame.position[i].cross(frame.velocity[i]);
  }
  return sum;
}

// What each group joins; a piece is known by its number.
std::vector<int32_t> pieces(const Frame& frame) {
  std::vector<std::array<int32_t, 2>> pairs;
  for (std::size_t g = 0; g + 1 < frame.offsets.size(); ++g) {
    for (auto k = static_cast<std::size_t>(frame.offsets[g]) + 1; k < static_cast<std::size_t>(frame.offsets[g + 1]);
         ++k)
      pairs.push_back({frame.members[k - 1], frame.members[k]});
  }
  return components(static_cast<int32_t>(frame.position.size()), pairs);
}
int32_t count_of(const std::vector<int32_t>& numbers) {
  return numbers.empty() ? 0 : *std::max_element(numbers.begin(), numbers.end()) + 1;
}

double volume_at_rest(const Mesh& mesh) {
  double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra()) {
    const auto at = [&](std::size_t k) { return mesh.rest()[static_cast<std::size_t>(t[k])]; };
    sum += volume_of(at(0), at(1), at(2), at(3));
  }
  return sum;
}

void expect_near(const Vec3& a, const Vec3& b, double most, const char* what) {
  EXPECT_LE((a - b).norm(), most) << what << ": " << a.transpose() << " and " << b.transpose();
}

// --- Constraints -----------------------------------------------------------------------------------------------------

// Each projection is along gradients of a function that neither moves nor turns change.
TEST(TetsConstraint, EachKeepsLinearAndAngularMomentum) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    std::array<Vec3, 4> x;
    std::array<double, 4> w{};
    for (std::size_t k = 0; k < 4; ++k) x[k] = vector(random, 1), w[k] = number(random, 0.1, 10);
    const std::array<Vec3, 4> before = x;
    double multiplier = 0;
    if (trial % 2 == 0) {
      project_distance({&x[0], &x[1]}, {w[0], w[1]}, number(random, 0, 2), number(random, 0, 1), multiplier);
    } else {
      project_volume({&x[0], &x[1], &x[2], &x[3]}, w, number(random, -1, 1), number(random, 0, 1), multiplier);
    }
    Vec3 change = Vec3::Zero(), turn = Vec3::Zero();
    double size = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      change += (x[k] - before[k]) / w[k];
      turn += before[k].cross(x[k] - before[k]) / w[k];
      size += (x[k] - before[k]).norm() / w[k];
    }
    EXPECT_GT(size, 0);
    EXPECT_LE(change.norm(), 1e-13 * size) << trial;
    EXPECT_LE(turn.norm(), 1e-12 * size) << trial;
  }
}

// Without compliance one projection of a linear constraint solves it; of the volume it is a Newton step.
TEST(TetsConstraint, SolvesItsConstraint) {
  Vec3 a(0, 0, 0), b(3, 0, 0);
  double multiplier = 0;
  project_distance({&a, &b}, {1, 2}, 1, 0, multiplier);
  EXPECT_NEAR((b - a).norm(), 1, kRounding);
  EXPECT_NEAR(a[0], 2.0 / 3, kRounding);  // by its share of the inverse masses
  std::array<Vec3, 4> x = {Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
  for (int k = 0; k < 20; ++k) {
    multiplier = 0;
    project_volume({&x[0], &x[1], &x[2], &x[3]}, {1, 1, 1, 1}, 1.0 / 6, 0, multiplier);
  }
  EXPECT_NEAR(volume_of(x[0], x[1], x[2], x[3]), 1.0 / 6, kRounding);
}

// Of an inverted tetrahedron, too: the volume is signed.
TEST(TetsConstraint, AnInvertedTetrahedronTurnsBack) {
  std::array<Vec3, 4> x = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.1, 0.2, -0.5)};
  for (int k = 0; k < 100; ++k) {
    double multiplier = 0;
    project_volume({&x[0], &x[1], &x[2], &x[3]}, {1, 1, 1, 1}, 1.0 / 6, 0, multiplier);
  }
  EXPECT_NEAR(volume_of(x[0], x[1], x[2], x[3]), 1.0 / 6, 1e-9);
}

// With compliance α: C + α λ = 0 once repeated projections have converged, because the multiplier counts.
TEST(TetsConstraint, ConvergesToItsCompliance) {
  Vec3 a(0, 0, 0), b(3, 0, 0);
  double multiplier = 0;
  for (int k = 0; k < 50; ++k) project_distance({&a, &b}, {1, 1}, 1, 0.5, multiplier);
  EXPECT_NEAR((b - a).norm() - 1 + 0.5 * multiplier, 0, kRounding);
  EXPECT_NEAR((b - a).norm(), 1 + 2 * 0.5 / (0.5 + 2), kRounding);  // of the spring that it stands for
}

TEST(TetsConstraint, DegenerateOnesMoveNothing) {
  std::array<Vec3, 4> x = {Vec3(1, 1, 1), Vec3(1, 1, 1), Vec3(1, 1, 1), Vec3(1, 1, 1)};
  double multiplier = 0;
  project_distance({&x[0], &x[1]}, {1, 1}, 1, 0, multiplier);
  project_volume({&x[0], &x[1], &x[2], &x[3]}, {1, 1, 1, 1}, 1, 0, multiplier);
  x[1] = Vec3(2, 1, 1);
  project_distance({&x[0], &x[1]}, {0, 0}, 5, 0, multiplier);  // both held
  project_distance({&x[0], &x[1]}, {1, 1}, 5, std::numeric_limits<double>::infinity(), multiplier);
  EXPECT_EQ(x[0], Vec3(1, 1, 1));
  EXPECT_EQ(x[1], Vec3(2, 1, 1));
  EXPECT_EQ(multiplier, 0);
}

// --- Material --------------------------------------------------------------------------------------------------------

// Energy density of the inner cells under a small strain, by the constraints themselves.
struct Elasticity {
  Mesh mesh;
  Sweep sweep;
  Constraints constraints;
  double cell_volume;
  explicit Elasticity(double poisson_ratio)
      : mesh(block({2, 2, 2}, 1)),
        sweep(sweep_of(mesh)),
        constraints(constraints_of(mesh, sweep, stiffness_of(1000, poisson_ratio))),
        cell_volume(1) {}
  // A cell of the lattice has its own edges only in part. By energy each has what its tetrahedra give, so one is
  // enough.
  double energy(const Eigen::Matrix3d& strain) const {
    constexpr double kSmall = 1e-5;
    std::vector<Vec3> x;
    for (const Vec3& rest : mesh.rest()) x.push_back(rest + kSmall * (strain * rest));
    return elastic_energy(sweep, constraints, x) / cell_volume / (kSmall * kSmall);
  }
};
Eigen::Matrix3d rotation(Random& random) {
  const auto value = [&] { return std::normal_distribution<double>()(random); };
  const double w = value(), x = value(), y = value();
  return Eigen::Quaterniond(w, x, y, value()).normalized().toRotationMatrix();
}

// For ν = 1/4 and above: K = E / 3 (1 - 2 ν), and the shear modulus as a mean over all directions G = E / 2 (1 + ν).
TEST(TetsMaterial, HasTheModuliOfTheMaterial) {
  Random random(2);
  for (const double ratio : {0.25, 0.4, 0.49}) {
    const Elasticity lattice(ratio);
    const double bulk = 1000 / (3 - 6 * ratio), shear = 1000 / (2 + 2 * ratio);
    // tr ε = 3: W = K 9 / 2.
    EXPECT_NEAR(lattice.energy(Eigen::Matrix3d::Identity()), 4.5 * bulk, 1e-3 * bulk);
    Eigen::Matrix3d pure = Eigen::Matrix3d::Zero();
    pure(0, 1) = pure(1, 0) = 0.5;  // W = G / 2
    double sum = 0, most = 0, least = 1e9;
    constexpr int kDirections = 20000;
    for (int k = 0; k < kDirections; ++k) {
      const Eigen::Matrix3d turned = rotation(random);
      const double here = 2 * lattice.energy(turned * pure * turned.transpose());
      sum += here, most = std::max(most, here), least = std::min(least, here);
    }
    // The mean of so many is off by a thousandth of the spread, some times over.
    EXPECT_NEAR(sum / kDirections, shear, 0.02 * shear) << ratio;
    std::printf("ratio %.2f: shear modulus by direction %.2f to %.2f of the material's\n", ratio, least / shear,
                most / shear);
    EXPECT_GT(least, 0);
  }
}

// Distances and volumes of a cut mesh store what those of the whole one do: stiffness is by volume, not by cell.
TEST(TetsMaterial, ACutDoesNotSoftenWhatItLeaves) {
  Mesh mesh(block({3, 3, 3}, 1));
  const Stiffness stiffness = stiffness_of(1000, 0.4);
  const auto energy = [&] {
    const Sweep sweep = sweep_of(mesh);
    std::vector<Vec3> x;
    for (const Vec3& rest : mesh.rest()) x.push_back(1.00001 * rest);
    return elastic_energy(sweep, constraints_of(mesh, sweep, stiffness), x);
  };
  const double before = energy();
  for (auto parts = mesh.cut(crossings(mesh, mesh.rest(), plane({0.7, 0.8, 1.1}, {1, 0.4, 0.3}, 9), kThickness));
       !parts.empty(); parts = mesh.cut({})) {
  }
  EXPECT_GT(mesh.size(), 27);
  EXPECT_NEAR(energy(), before, 1e-4 * before);
}

// A bar hangs from its upper end. Its own weight stretches it by ρ g L² / 2 E. E along the axis is that of the lattice,
// from energies of strains with free sides: the least over lateral strains.
TEST(TetsMaterial, ABarStretchesUnderItsWeight) {
  constexpr double kRatio = 0.3, kYoung = 2e4, kLength = 0.08, kSpacing = 0.01;
  Scene scene = block({3, 3, 9}, kSpacing);
  scene.gravity = Vec3(0, 0, -10);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) scene.held[i] = scene.node[i][2] == 8;
  // The density of a bar is that of its volume.
  const auto simulator =
      make_tets_cpu(scene, tets_parameters("youngs_modulus=20000,poisson_ratio=0.3,density=1000,damping=40,steps=50"));
  for (int k = 0; k < 100; ++k) simulator->advance(0.01);
  double lowest = 0;
  const Frame frame = simulator->frame(false);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) lowest += scene.node[i][2] == 0 ? frame.position[i][2] / 9 : 0;
  const Elasticity lattice(kRatio);
  // The quadratic form of the six strains, and the compliance along z.
  Eigen::Matrix<double, 6, 6> form;
  const auto strain = [](int k) {
    Eigen::Matrix3d e = Eigen::Matrix3d::Zero();
    const int rows[6] = {0, 1, 2, 1, 0, 0}, columns[6] = {0, 1, 2, 2, 2, 1};
    e(rows[k], columns[k]) += 0.5;
    e(columns[k], rows[k]) += 0.5;
    return e;
  };
  for (int k = 0; k < 6; ++k) {
    for (int l = 0; l < 6; ++l)
      form(k, l) = (lattice.energy(strain(k) + strain(l)) - lattice.energy(strain(k)) - lattice.energy(strain(l))) *
                   kYoung / 1000;
  }
  const double young = 1 / form.inverse()(2, 2), expected = 1000 * 10 * kLength * kLength / (2 * young);
  std::printf("a bar: E along the axis is %.3f of the material's; it stretches by %.3f of the closed form\n",
              young / kYoung, -lowest / expected);
  // A clamp, few cells and one sweep a substep are what is left.
  EXPECT_NEAR(-lowest, expected, 0.15 * expected);
}

// --- Cutting ---------------------------------------------------------------------------------------------------------

// The least angle between two faces [degrees].
double least_angle(const Mesh& mesh) {
  double least = 180;
  for (const Tetrahedron& t : mesh.tetrahedra()) {
    std::array<Vec3, 4> x;
    for (std::size_t k = 0; k < 4; ++k) x[k] = mesh.rest()[static_cast<std::size_t>(t[k])];
    std::array<Vec3, 4> normal;  // outwards, of the face opposite
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3 a = x[(k + 1) % 4], b = x[(k + 2) % 4], c = x[(k + 3) % 4];
      normal[k] = (b - a).cross(c - a).normalized();
      if (normal[k].dot(x[k] - a) > 0) normal[k] = -normal[k];
    }
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t l = 0; l < k; ++l)
        least = std::min(least, 180 / M_PI * std::acos(std::clamp(-normal[k].dot(normal[l]), -1.0, 1.0)));
    }
  }
  return least;
}

// Faces that one cell alone has, by sorted corners.
std::set<std::array<int32_t, 3>> open_faces(const Mesh& mesh) {
  std::set<std::array<int32_t, 3>> open;
  for (const Tetrahedron& t : mesh.tetrahedra()) {
    for (std::size_t k = 0; k < 4; ++k) {
      std::array<int32_t, 3> face = {t[(k + 1) % 4], t[(k + 2) % 4], t[(k + 3) % 4]};
      std::sort(face.begin(), face.end());
      if (!open.insert(face).second) open.erase(face);
    }
  }
  return open;
}

// Whether the face lies in the surface of the block.
bool is_outside(const Mesh& mesh, const std::array<int32_t, 3>& face, double size) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double where : {0.0, size}) {
      bool all = true;
      for (const int32_t i : face)
        all = all && std::abs(mesh.rest()[static_cast<std::size_t>(i)][axis] - where) < 1e-12;
      if (all) return true;
    }
  }
  return false;
}

void cut_all(Mesh& mesh, const std::vector<Crossing>& crossed) {
  for (auto parts = mesh.cut(crossed); !parts.empty(); parts = mesh.cut({})) {
  }
}

// One tetrahedron, for each number of cut edges that part its corners: 1 + 3, 3 + 3, three and four parts.
TEST(TetsCut, SplitsATetrahedronAsItsEdgesAreCut) {
  const auto cells_of = [](const std::vector<std::array<int32_t, 2>>& edges) {
    Scene scene = block({2, 2, 2}, 1);
    scene.tetrahedra.resize(1);
    scene.tetrahedra[0] = {0, 1, 2, 4};
    Mesh mesh(scene);
    std::vector<Crossing> crossed;
    for (const auto& edge : edges) crossed.push_back({edge, 0.4});
    cut_all(mesh, crossed);
    EXPECT_NEAR(volume_at_rest(mesh), 1.0 / 6, kRounding);
    for (const double volume : mesh.volume()) EXPECT_GT(volume, 0);
    Frame frame;
    couple(mesh, frame);
    frame.position.resize(static_cast<std::size_t>(mesh.size()));
    return std::pair(mesh.tetrahedra().size(), count_of(pieces(frame)) - 4);  // 4 corners of the cube are alone
  };
  EXPECT_EQ(cells_of({}), std::pair(std::size_t{1}, 1));
  EXPECT_EQ(cells_of({{0, 1}}), std::pair(std::size_t{1}, 1));
  EXPECT_EQ(cells_of({{0, 1}, {0, 2}}), std::pair(std::size_t{1}, 1));
  EXPECT_EQ(cells_of({{0, 1}, {0, 2}, {1, 2}}), std::pair(std::size_t{1}, 1));  // all of a face
  EXPECT_EQ(cells_of({{0, 1}, {0, 2}, {0, 4}}), std::pair(std::size_t{4}, 2));
  EXPECT_EQ(cells_of({{0, 2}, {0, 4}, {1, 2}, {1, 4}}), std::pair(std::size_t{6}, 2));
  EXPECT_EQ(cells_of({{0, 1}, {0, 2}, {0, 4}, {1, 2}, {1, 4}}).second, 3);
  EXPECT_EQ(cells_of({{0, 1}, {0, 2}, {0, 4}, {1, 2}, {1, 4}, {2, 4}}).second, 4);
}

// A blade almost along an edge between particles: it crosses where it does, however near both ends are.
TEST(TetsCut, ParticlesNearTheBladeKeepTheirSides) {
  const Mesh mesh(block({2, 2, 2}, 1));
  const auto at = [](double x, double y) { return Vec3(x, y, 0.003 - 0.17 * x); };
  const auto found = crossings(mesh, mesh.rest(), {at(-1, -0.5), at(0.3, -0.5), at(0.3, 0.5), at(-1, 0.5)}, kThickness);
  const auto edge = std::find_if(found.begin(), found.end(), [](const Crossing& c) { return c.edge == Edge{0, 1}; });
  ASSERT_NE(edge, found.end());
  EXPECT_NEAR(edge->share, 0.003 / 0.17, 1e-12);
}

TEST(TetsCut, MarksAddUpOverFrames) {
  Scene scene = block({2, 2, 2}, 1);
  scene.tetrahedra = {{0, 1, 2, 4}};
  Mesh mesh(scene);
  EXPECT_TRUE(mesh.cut({{{0, 1}, 0.5}}).empty());
  EXPECT_TRUE(mesh.cut({{{0, 2}, 0.5}}).empty());
  EXPECT_FALSE(mesh.cut({{{0, 4}, 0.5}}).empty());
  EXPECT_EQ(mesh.tetrahedra().size(), 4u);
}

// Two cells share a face. The first is cut between corner 0 and the others, and again nearer to the corner; then the
// second one is cut. On the corner's side it gets vertices of its own: those on the edges lie in a slice by now.
TEST(TetsCut, VerticesThatWereCutOffAreNotUsedAgain) {
  Scene scene = block({2, 2, 2}, 1);
  scene.tetrahedra = {{0, 1, 3, 7}, {0, 3, 2, 7}};
  Mesh mesh(scene);
  cut_all(mesh, {{{0, 1}, 0.6}, {{0, 3}, 0.6}, {{0, 7}, 0.6}});
  std::vector<Crossing> again;
  for (const Edge& edge : mesh.edges()) {
    if (edge[0] == 0 && edge[1] >= mesh.particles()) again.push_back({edge, 0.5});
  }
  ASSERT_EQ(again.size(), 3u);
  cut_all(mesh, again);
  cut_all(mesh, {{{0, 2}, 0.6}});
  Frame frame;
  couple(mesh, frame);
  frame.position.resize(static_cast<std::size_t>(mesh.size()));
  const std::vector<int32_t> piece = pieces(frame);
  for (const Crossing& crossing : again) EXPECT_NE(piece[0], piece[static_cast<std::size_t>(crossing.edge[1])]);
  EXPECT_NEAR(volume_at_rest(mesh), 2.0 / 6, kRounding);
}

// A cut passes no nearer to an end of an edge than a tenth of it.
TEST(TetsCut, StaysATenthAwayFromTheEndsOfEdges) {
  Scene scene = block({2, 2, 2}, 1);
  scene.tetrahedra = {{0, 1, 2, 4}};
  Mesh mesh(scene);
  cut_all(mesh, {{{0, 1}, 0.001}, {{0, 2}, 0.999}, {{0, 4}, 0.3}});
  std::set<double> lengths;
  for (int32_t i = 8; i < mesh.size(); ++i)
    lengths.insert(std::round(1e9 * mesh.rest()[static_cast<std::size_t>(i)].norm()) / 1e9);
  EXPECT_EQ(lengths, (std::set<double>{0.1, 0.3, 0.9}));
}

// Planes in all directions, one after the other: volumes add up, cells are not inverted, sides are apart, and faces
// that one cell alone has lie on the block's surface or on a cut.
TEST(TetsCut, KeepsVolumeAndConformsThroughPlanes) {
  Random random(3);
  double angle = 180;
  for (int trial = 0; trial < 40; ++trial) {
    Mesh mesh(block({4, 4, 4}, 1));
    for (int stroke = 0; stroke < 3; ++stroke) {
      const Patch patch = plane(Vec3(1.5, 1.5, 1.5) + vector(random, 1), vector(random, 1), 9);
      cut_all(mesh, crossings(mesh, mesh.rest(), patch, kThickness));
      EXPECT_NEAR(volume_at_rest(mesh), 27, 27 * kRounding);
      for (const double volume : mesh.volume()) EXPECT_GT(volume, 0);
      if (stroke > 0) continue;
      angle = std::min(angle, least_angle(mesh));
      // A plane parts what is on its two sides, and nothing else.
      Frame frame;
      couple(mesh, frame);
      frame.position.resize(static_cast<std::size_t>(mesh.size()));
      const std::vector<int32_t> piece = pieces(frame);
      const Vec3 normal = (patch[1] - patch[0]).cross(patch[2] - patch[0]);
      std::set<std::pair<bool, int32_t>> sides;
      for (int32_t i = 0; i < mesh.particles(); ++i)
        sides.insert({(mesh.rest()[static_cast<std::size_t>(i)] - patch[0]).dot(normal) >= 0,
                      piece[static_cast<std::size_t>(i)]});
      EXPECT_EQ(count_of(piece), static_cast<int32_t>(sides.size())) << "trial " << trial;
      EXPECT_LE(sides.size(), 2u) << "trial " << trial;
      for (const auto& face : open_faces(mesh)) {
        const bool is_cut = std::all_of(face.begin(), face.end(), [&](int32_t i) { return i >= mesh.particles(); });
        EXPECT_TRUE(is_cut || is_outside(mesh, face, 3)) << "trial " << trial;
      }
    }
  }
  std::printf("least angle between faces after one cut: %.2f degrees\n", angle);
  EXPECT_GT(angle, 0);
}

TEST(TetsCut, ASecondPassTakesNothingOff) {
  Mesh mesh(block({4, 4, 4}, 1));
  const Patch patch = plane({1.4, 1.5, 1.5}, {1, 0.2, 0.1}, 9), beside = plane({1.43, 1.5, 1.5}, {1, 0.2, 0.1}, 9);
  cut_all(mesh, crossings(mesh, mesh.rest(), patch, kThickness));
  const std::vector<Tetrahedron> cells = mesh.tetrahedra();
  for (const Patch& again : {patch, beside}) cut_all(mesh, crossings(mesh, mesh.rest(), again, kThickness));
  EXPECT_EQ(mesh.tetrahedra(), cells);
}

// Cells that were cut are cut again: nothing remembers which cells were neighbours.
TEST(TetsCut, CrossingCutsLeaveFourPieces) {
  Mesh mesh(block({4, 4, 3}, 1));
  cut_all(mesh, crossings(mesh, mesh.rest(), plane({1.45, 1, 1}, {1, 0, 0.02}, 9), kThickness));
  cut_all(mesh, crossings(mesh, mesh.rest(), plane({1, 1.55, 1}, {0.01, 1, 0}, 9), kThickness));
  Frame frame;
  couple(mesh, frame);
  frame.position.resize(static_cast<std::size_t>(mesh.size()));
  const std::vector<int32_t> piece = pieces(frame);
  // Crumbs along the line where cuts meet have no particle.
  EXPECT_EQ((std::set<int32_t>(piece.begin(), piece.begin() + mesh.particles()).size()), 4u);
}

// A blade that ends in a cell leaves this cell whole; one that goes on later separates it.
TEST(TetsCut, ABladeMayComeInFrames) {
  const auto cut_to = [](Mesh& mesh, double from, double to) {
    cut_all(mesh,
            crossings(mesh, mesh.rest(), {Vec3(1.4, from, -5), Vec3(1.4, to, -5), Vec3(1.4, to, 5), Vec3(1.4, from, 5)},
                      kThickness));
  };
  const auto count = [](const Mesh& mesh) {
    Frame frame;
    couple(mesh, frame);
    frame.position.resize(static_cast<std::size_t>(mesh.size()));
    return count_of(pieces(frame));
  };
  Mesh mesh(block({4, 4, 4}, 1));
  cut_to(mesh, -1, 1.7);
  EXPECT_GT(mesh.size(), 64);
  EXPECT_EQ(count(mesh), 1);
  cut_to(mesh, 1.5, 4);
  EXPECT_EQ(count(mesh), 2);
  EXPECT_NEAR(volume_at_rest(mesh), 27, 27 * kRounding);
}

TEST(TetsCut, ColoursDifferAtAVertex) {
  Mesh mesh(block({5, 5, 5}, 1));
  const auto check = [&](std::size_t most_edges, std::size_t most_cells) {
    const Sweep sweep = sweep_of(mesh);
    const auto differ = [](const auto& constraints, const std::vector<std::size_t>& starts) {
      for (std::size_t colour = 0; colour + 1 < starts.size(); ++colour) {
        std::set<int32_t> seen;
        for (std::size_t k = starts[colour]; k < starts[colour + 1]; ++k) {
          for (const int32_t i : constraints[k]) EXPECT_TRUE(seen.insert(i).second);
        }
      }
      EXPECT_EQ(starts.back(), constraints.size());
    };
    differ(sweep.edges, sweep.edge_starts);
    differ(sweep.cells, sweep.cell_starts);
    EXPECT_EQ(std::set(sweep.edges.begin(), sweep.edges.end()).size(), mesh.edges().size());
    std::printf("colours: %zu of edges, %zu of cells\n", sweep.edge_starts.size() - 1, sweep.cell_starts.size() - 1);
    // Greedy colours are at most one more than the constraints that one meets.
    EXPECT_LE(sweep.edge_starts.size() - 1, most_edges);
    EXPECT_LE(sweep.cell_starts.size() - 1, most_cells);
  };
  check(27, 93);  // 14 edges and 24 cells at a vertex
  cut_all(mesh, crossings(mesh, mesh.rest(), plane({2.1, 2, 2}, {1, 0.5, 0.2}, 9), kThickness));
  check(100, 200);
}

// --- Programs --------------------------------------------------------------------------------------------------------

struct Program {
  const char* name;
  Make make;
  double u;  // unit roundoff of its arithmetic
};
std::ostream& operator<<(std::ostream& out, const Program& program) { return out << program.name; }

#ifdef BASELINES_HAVE_CUDA
std::unique_ptr<Simulator> make_cuda(const Scene& scene, const Parameters& parameters) {
  return make_tets_cuda(scene, parameters);
}
#endif

class TetsProgram : public testing::TestWithParam<Program> {
 protected:
  void SetUp() override {
    if (GetParam().make == nullptr) GTEST_SKIP() << "this build has no CUDA";
#ifdef BASELINES_HAVE_CUDA
    if (std::string(GetParam().name) != "cuda") return;
    try {
      require_device();
    } catch (const std::runtime_error& error) {
      GTEST_SKIP() << error.what();
    }
#endif
  }
  static std::unique_ptr<Simulator> make(const Scene& scene, const char* parameters = "") {
    return GetParam().make(scene, tets_parameters(parameters));
  }
};

TEST_P(TetsProgram, FallsFreely) {
  Scene scene = block({3, 3, 3}, 0.01);
  scene.gravity = Vec3(1, -2, -9);
  const auto simulator = make(scene, "steps=10");
  simulator->advance(0.01);
  const Frame frame = simulator->frame(false);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) {
    expect_near(frame.velocity[i], 0.01 * scene.gravity, 1000 * GetParam().u, "velocity");
    // Symplectic Euler: dt² (1 + 2 + .. + 10) g.
    expect_near(frame.position[i], scene.rest[i] + 55e-6 * scene.gravity, 100 * GetParam().u * 0.05, "position");
  }
}

TEST_P(TetsProgram, AtRestItStays) {
  const auto simulator = make(block({3, 3, 3}, 0.0078125));  // places have no rounding
  simulator->advance(0.01);
  for (const Vec3& v : simulator->frame(false).velocity) EXPECT_LE(v.norm(), 1000 * GetParam().u * 0.01);
}

// Also where blades cut: mass, momentum and centre of mass are as if nothing had been cut.
TEST_P(TetsProgram, KeepsMassMomentumAndCentreThroughCuts) {
  Random random(4);
  for (int trial = 0; trial < 8; ++trial) {
    Scene scene = block({4, 4, 3}, 0.01);
    disturb(scene, random);
    scene.gravity.setZero();
    const auto simulator = make(scene);
    const Totals before = totals(simulator->frame(false));
    EXPECT_NEAR(before.mass, 48 * 1e-3, 1e-6);
    for (int frame = 1; frame < 8; ++frame) {
      simulator->advance(0.01);
      if (frame < 3) continue;
      // Part of the way in each frame, so that cells wait for the rest.
      const double from = 0.01 * (frame - 4), to = from + 0.0125;
      simulator->cut({{Vec3(0.014, from, -1), Vec3(0.016, to, -1), Vec3(0.016, to, 1), Vec3(0.014, from, 1)},
                      {Vec3(from, 0.017, -1), Vec3(to, 0.015, -1), Vec3(to, 0.015, 1), Vec3(from, 0.017, 1)}});
    }
    const Frame last = simulator->frame(true);
    const Totals after = totals(last);
    EXPECT_GT(last.position.size(), scene.rest.size());
    const double u = 2000 * GetParam().u;
    EXPECT_NEAR(after.mass, before.mass, u * before.mass);
    expect_near(after.momentum, before.momentum, u * before.mass * 0.1, "momentum");
    expect_near(after.moment, before.moment + 0.07 * before.momentum, u * before.mass * 0.1, "centre of mass");
  }
}

// To the bit: what is done to a piece is no matter of another one.
TEST_P(TetsProgram, PiecesDoNotFeelEachOther) {
  Random random(5);
  Scene scene = block({4, 3, 3}, 0.01);
  disturb(scene, random);
  Scene kicked = scene;
  const auto run = [&](const Scene& of, bool is_kicked) {
    auto simulator = make(of);
    simulator->advance(0.01);
    simulator->cut({plane({0.014, 0.01, 0.01}, {1, 0.1, 0.2}, 1)});
    Frame cut = simulator->frame(true);
    const std::vector<int32_t> piece = pieces(cut);
    EXPECT_EQ(count_of(piece), 2);
    if (is_kicked) {
      std::vector<Vec3> kick(of.rest.size(), Vec3::Zero());
      for (std::size_t i = 0; i < kick.size(); ++i) {
        if (piece[i] != 0) kick[i] = Vec3(1, 2, 3);
      }
      simulator->kick(kick);
    }
    for (int k = 0; k < 4; ++k) simulator->advance(0.01);
    return std::pair(piece, simulator->frame(false));
  };
  const auto [piece, without] = run(scene, false);
  const auto [again, with] = run(scene, true);
  ASSERT_EQ(piece, again);
  for (std::size_t i = 0; i < piece.size(); ++i) {
    if (piece[i] == 0) {
      EXPECT_EQ(with.position[i], without.position[i]) << "vertex " << i;
      EXPECT_EQ(with.velocity[i], without.velocity[i]) << "vertex " << i;
    } else {
      EXPECT_GT((with.position[i] - without.position[i]).norm(), 0.01) << "vertex " << i;
    }
  }
}

TEST_P(TetsProgram, HasTheSameBitsAgain) {
  Random random(6);
  Scene scene = block({4, 3, 3}, 0.01);
  disturb(scene, random);
  const auto run = [&] {
    auto simulator = make(scene);
    for (int k = 0; k < 3; ++k) {
      simulator->advance(0.01);
      simulator->cut({plane({0.014, 0.01, 0.008 + 0.001 * k}, {1, 0.3 * k, 0.2}, 1)});
    }
    return simulator->frame(true);
  };
  const Frame one = run(), other = run();
  EXPECT_EQ(one.position, other.position);
  EXPECT_EQ(one.velocity, other.velocity);
  EXPECT_EQ(one.members, other.members);
}

// The oracle of the kernels: after one frame of `steps` substeps from states of all kinds, and a cut.
TEST_P(TetsProgram, AgreesWithTheProgramInDoublePrecision) {
  Random random(7);
  for (int trial = 0; trial < 30; ++trial) {
    std::array<int, 3> size{};
    for (int& n : size) n = 2 + static_cast<int>(random() % 3);
    const double h = number(random, 0.003, 0.02);
    Scene scene = block(size, h);
    disturb(scene, random);
    for (std::size_t i = 0; i < scene.rest.size(); ++i) {
      // Floats, so that both begin at the same place.
      for (int axis = 0; axis < 3; ++axis) {
        scene.rest[i][axis] = static_cast<float>(scene.rest[i][axis]);
        scene.velocity[i][axis] = static_cast<float>(scene.velocity[i][axis]);
      }
      scene.held[i] = trial % 3 == 0 && scene.node[i][0] == 0;
    }
    const char* const parameters = trial % 2 == 0 ? "steps=1,iterations=3,damping=2" : "steps=4,poisson_ratio=0.3";
    const auto cpu = make_tets_cpu(scene, tets_parameters(parameters));
    const auto other = make(scene, parameters);
    for (int frame = 0; frame < 2; ++frame) {
      cpu->advance(0.002);
      other->advance(0.002);
      // Through all of it, or ending somewhere in it.
      const double reach = trial % 4 < 2 ? 1 : number(random, 0.5, 2) * h;
      const Patch patch = plane(h * Vec3(0.6, 0.7, 0.8) + vector(random, 0.1 * h), vector(random, 1), reach);
      cpu->cut({patch});
      other->cut({patch});
      const Frame right = cpu->frame(true), given = other->frame(true);
      ASSERT_EQ(right.members, given.members) << "trial " << trial;
      ASSERT_EQ(right.parent, given.parent) << "trial " << trial;
      for (std::size_t i = 0; i < right.position.size(); ++i) {
        EXPECT_LE((right.position[i] - given.position[i]).norm(), 1e-5 * h) << "trial " << trial << ", vertex " << i;
        EXPECT_NEAR(right.mass[i], given.mass[i], 1e-5 * scene.mass[0]);
      }
    }
  }
}

// Scenes at the limits: each ends with numbers.
TEST_P(TetsProgram, StaysFiniteInHardCases) {
  std::vector<std::pair<const char*, Scene>> scenes;
  scenes.emplace_back("nothing", Scene());
  Scene scene = block({2, 2, 2}, 0.01);
  scene.tetrahedra.clear();
  scenes.emplace_back("no cells", scene);
  scene = block({2, 2, 2}, 0.01);
  scene.tetrahedra.resize(1);
  scenes.emplace_back("one cell, and particles of none", scene);
  std::swap(scene.tetrahedra[0][1], scene.tetrahedra[0][2]);
  scenes.emplace_back("a cell whose corners are listed the other way", scene);
  scene.tetrahedra[0] = {0, 1, 2, 3};
  scenes.emplace_back("a flat cell", scene);
  scene.tetrahedra[0] = {0, 0, 0, 0};
  scenes.emplace_back("a cell of one corner", scene);
  scene = block({3, 3, 3}, 0.01);
  scene.held.assign(scene.held.size(), 1);
  scenes.emplace_back("all is held", scene);
  scene = block({3, 3, 3}, 0.01);
  for (Vec3& v : scene.velocity) v = Vec3(0, 0, 1e4);
  scene.velocity[13] = Vec3(0, 0, -1e4);  // through its neighbours: cells turn inside out
  scenes.emplace_back("a particle is shot", scene);
  for (auto& [name, each] : scenes) {
    each.gravity = Vec3(0, 0, -10);
    for (const double time : {1e-9, 0.01, 1e3}) {
      const auto simulator = make(each, "damping=1");
      for (int k = 0; k < 3; ++k) {
        simulator->advance(time);
        simulator->cut({plane({0.004, 0.004, 0.004}, {1, 2, 3}, 1), plane({0.004, 0.004, 0.004}, {1, -2, 0}, 1)});
      }
      const Frame frame = simulator->frame(true);
      for (std::size_t i = 0; i < frame.position.size(); ++i)
        EXPECT_TRUE(frame.position[i].allFinite() && frame.velocity[i].allFinite()) << name << ", frames of " << time;
    }
  }
}

// A scene is cut to crumbs: cells of cells of cells.
TEST_P(TetsProgram, SurvivesManyCuts) {
  Random random(8);
  Scene scene = block({3, 3, 3}, 0.01);
  disturb(scene, random);
  const auto simulator = make(scene);
  const double mass = totals(simulator->frame(false)).mass;
  for (int k = 0; k < 8; ++k) {
    simulator->advance(0.004);
    simulator->cut({plane(Vec3(0.01, 0.01, 0.01) + vector(random, 0.005), vector(random, 1), 1)});
  }
  const Frame frame = simulator->frame(true);
  EXPECT_GT(count_of(pieces(frame)), 8);
  EXPECT_NEAR(totals(frame).mass, mass, 1000 * GetParam().u * mass);
  for (const Vec3& x : frame.position) EXPECT_LT(x.norm(), 1);
}

INSTANTIATE_TEST_SUITE_P(Of, TetsProgram,
                         testing::Values(Program{"cpu", make_tets_cpu, 0x1p-53},
                                         Program{"host", make_tets_host, 0x1p-24},
#ifdef BASELINES_HAVE_CUDA
                                         Program{"cuda", make_cuda, 0x1p-24}
#else
                                         Program{"cuda", nullptr, 0x1p-24}
#endif
                                         ),
                         [](const auto& each) { return std::string(each.param.name); });

// Sweeps converge to one step, in whatever order particles are numbered. Only nearly so: a multiplier grows along the
// gradients that it meets on the way, and these turn. So what is left shrinks as the square of the motion.
TEST(TetsStep, ConvergesToOneAnswerInAnyOrder) {
  Random random(9);
  Scene scene = block({3, 3, 2}, 0.01);
  disturb(scene, random);
  std::vector<std::size_t> number(scene.rest.size());
  for (std::size_t i = 0; i < number.size(); ++i) number[i] = i;
  std::shuffle(number.begin(), number.end(), random);
  const auto run = [&](const Scene& of, const char* parameters) {
    const auto simulator = make_tets_cpu(of, tets_parameters(parameters));
    simulator->advance(0.01);
    return simulator->frame(false).position;
  };
  // The greatest distance, by the size of the motion.
  const auto apart = [&](double motion, const char* parameters) {
    Scene one = scene;
    for (Vec3& v : one.velocity) v *= motion;
    one.gravity *= motion;
    Scene other = one;
    for (std::size_t i = 0; i < number.size(); ++i) {
      other.rest[number[i]] = one.rest[i];
      other.velocity[number[i]] = one.velocity[i];
    }
    for (auto& cell : other.tetrahedra) {
      for (int32_t& corner : cell) corner = static_cast<int32_t>(number[static_cast<std::size_t>(corner)]);
    }
    const auto x = run(one, parameters), shuffled = run(other, parameters);
    double most = 0;
    for (std::size_t i = 0; i < number.size(); ++i) most = std::max(most, (x[i] - shuffled[number[i]]).norm());
    return most / motion;
  };
  const double once = apart(1e-3, "steps=1,iterations=1"), converged = apart(1e-3, "steps=1,iterations=2000"),
               faster = apart(1e-2, "steps=1,iterations=2000");
  std::printf("orders differ by %.2g after a sweep, by %.2g after 2,000, ten times faster by %.2g\n", once, converged,
              faster);
  EXPECT_LE(converged, 0.01 * once);
  EXPECT_NEAR(faster / converged, 10, 2);
}

TEST(TetsParameters, AreRefusedWithASentence) {
  for (const char* const wrong : {"steps=0", "steps=1.5", "poisson_ratio=0.5", "poisson_ratio=-0.1", "density=-1",
                                  "damping=-1", "youngs_modulus=-1", "iterations=0", "stepz=1", "steps=nan"}) {
    try {
      tets_parameters(wrong);
      ADD_FAILURE() << wrong;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("; give "), std::string::npos) << error.what();
    }
  }
  Scene scene = block({2, 2, 2}, 1);
  scene.tetrahedra[0][2] = 8;
  EXPECT_THROW(make_tets_cpu(scene, tets_parameters("")), std::invalid_argument);
}

TEST(TetsJudge, HoldsOverDrawnScenes) {
  const char* const other = std::getenv("CUTPROOF");
  const std::string program = other != nullptr ? other : CUTPROOF_PROGRAM;
  for (const char* const plugin : {PLUGINS "/tets_cpu.so", PLUGINS "/tets_host.so"}) {
    const std::string save = testing::TempDir();
    const int status = std::system(("'" + program + "' judge '" + plugin + "' dissect --cases 20 --seed 1 --shrink 0" +
                                    " --save '" + save + "' --quiet")
                                       .c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << plugin;
  }
}

}  // namespace
}  // namespace cutproof::baselines::tets
