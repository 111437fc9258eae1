// Bullet's soft bodies: a sheet that is cut in two.
//   bullet_soft_body kick KMT FILE        without and with a kick of one piece, for `cutproof kick FILE`. KMT is
//                                         m_cfg.kMT: how strongly the body as a whole is drawn back to its shape.
//   bullet_soft_body run COUPLING FOLDER  for `cutproof check FOLDER`. COUPLING is what nodes feel each other by: links
//                                         alone; links and the shape of kMT; or links and clusters, which are made
//                                         before the cut (clusters_before) or after it (clusters_after).
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>

#include "model/io/array_file.h"

namespace {

using cutproof::Arrays;
using cutproof::make_array;

constexpr int kFrames = 120, kCut = 5, kKicked = 10;
constexpr float kPlane = 0.07f;

struct Plane : btSoftBody::ImplicitFn {
  btScalar Eval(const btVector3& place) override { return place.x() - kPlane; }
};

struct World {
  World() : dispatcher(&configuration), world(&dispatcher, &broadphase, &solver, &configuration) {
    world.setGravity({0, 0, 0});
    world.getWorldInfo().m_gravity.setZero();
    // A sheet of 2 m x 2 m and 1 kg.
    sheet = btSoftBodyHelpers::CreatePatch(world.getWorldInfo(), {-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, 13, 13,
                                           0, true);
    sheet->setTotalMass(1);
    world.addSoftBody(sheet);
  }
  ~World() {
    world.removeSoftBody(sheet);
    delete sheet;
  }
  void cut() const {
    Plane plane;
    sheet->refine(&plane, 0.001f, true);
  }
  int32_t number(const btSoftBody::Node* node) const {
    const btSoftBody::Node* const first = &sheet->m_nodes[0];
    return node >= first && node < first + nodes() ? static_cast<int32_t>(node - first) : -1;
  }
  int32_t nodes() const { return sheet->m_nodes.size(); }
  // Nodes that feel each other because links join them: two for each link.
  std::vector<int32_t> links() const {
    std::vector<int32_t> ends;
    for (int k = 0; k < sheet->m_links.size(); ++k) {
      for (const btSoftBody::Node* const node : sheet->m_links[k].m_n) ends.push_back(number(node));
    }
    return ends;
  }

  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world;
  btSoftBody* sheet = nullptr;
};

void push_back(std::vector<float>& numbers, const btVector3& x) {
  numbers.insert(numbers.end(), {x.x(), x.y(), x.z()});
}

// --- The kick --------------------------------------------------------------------------------------------------------

struct Places {
  std::vector<int32_t> piece;    // [n]
  std::vector<float> positions;  // [kFrames x n x 3] m
};

// Nodes joined by links, by the smallest of them.
std::vector<int32_t> pieces_of(const World& world) {
  std::vector<int32_t> piece;
  for (int32_t i = 0; i < world.nodes(); ++i) piece.push_back(i);
  const std::vector<int32_t> ends = world.links();
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t k = 0; k < ends.size(); k += 2) {
      int32_t &a = piece[ends[k]], &b = piece[ends[k + 1]];
      changed = changed || a != b;
      a = b = std::min(a, b);
    }
  }
  return piece;
}

Places simulate_kick(float kMT, float kick) {
  World world;
  world.cut();
  world.sheet->m_cfg.kMT = kMT;
  world.sheet->setPose(false, true);  // the shape that kMT draws to; it has to follow the cut, which makes nodes
  Places places{pieces_of(world), {}};
  for (int frame = 0; frame < kFrames; ++frame) {
    for (int i = 0; frame == kKicked && i < world.nodes(); ++i) {
      if (places.piece[i] == 0) world.sheet->addVelocity({0, kick, 0}, i);
    }
    world.world.stepSimulation(1 / 60.f, 0);
    for (int i = 0; i < world.nodes(); ++i) push_back(places.positions, world.sheet->m_nodes[i].m_x);
  }
  return places;
}

void write_kick(float kMT, const char* file) {
  const Places still = simulate_kick(kMT, 0), kicked = simulate_kick(kMT, 1), again = simulate_kick(kMT, 0);
  const auto n = static_cast<int64_t>(still.piece.size());
  cutproof::io::write_array_file(
      file,
      {{make_array("positions", {kFrames, n, 3}, still.positions),
        make_array("kicked", {kFrames, n, 3}, kicked.positions), make_array("again", {kFrames, n, 3}, again.positions),
        make_array("piece", {n}, still.piece), make_array<int32_t>("kicked_piece", {}, {0})},
       {}});
}

// --- The run ---------------------------------------------------------------------------------------------------------

// Clusters of neighbours in space, each of which is drawn back to its shape.
void make_clusters(const World& world) {
  world.sheet->generateClusters(8);
  for (int k = 0; k < world.sheet->m_clusters.size(); ++k) world.sheet->m_clusters[k]->m_matching = 0.5f;
}

// What is valid for all frames of a segment.
Arrays segment_of(const World& world, bool by_shape, int32_t nodes_at_start) {
  std::vector<int32_t> members = world.links(), offsets;
  for (int32_t k = 0; k <= std::ssize(members); k += 2) offsets.push_back(k);
  const auto close = [&] { offsets.push_back(static_cast<int32_t>(members.size())); };
  if (by_shape) {
    for (int32_t i = 0; i < world.nodes(); ++i) members.push_back(i);
    close();
  }
  for (int k = 0; k < world.sheet->m_clusters.size(); ++k) {
    const auto& nodes = world.sheet->m_clusters[k]->m_nodes;
    for (int i = 0; i < nodes.size(); ++i) members.push_back(world.number(nodes[i]));
    close();
  }
  // A node that the cut has made lies on an edge: it comes from that end to which it still has a link.
  std::vector<int32_t> parent(world.nodes(), -1);
  for (int32_t k = 0; k < world.sheet->m_links.size(); ++k) {
    const int32_t old = std::min(members[2 * k], members[2 * k + 1]),
                  made = std::max(members[2 * k], members[2 * k + 1]);
    if (old < nodes_at_start && made >= nodes_at_start) parent[made] = old;
  }
  std::vector<float> mass;
  for (int i = 0; i < world.nodes(); ++i) mass.push_back(world.sheet->getMass(i));
  const auto n = int64_t{world.nodes()};
  return {make_array("groups_offsets", {std::ssize(offsets)}, offsets),
          make_array("groups_members", {std::ssize(members)}, members), make_array("mass", {n}, mass),
          make_array("parent", {n}, parent)};
}

void write_run(const std::string& coupling, const std::string& folder) {
  World world;
  const bool by_shape = coupling == "shape", before = coupling == "clusters_before";
  world.sheet->m_cfg.kMT = by_shape ? 0.2f : 0;
  if (by_shape) world.sheet->setPose(false, true);
  if (before) make_clusters(world);
  const int32_t nodes_at_start = world.nodes();
  for (int i = 0; i < nodes_at_start; ++i) {  // it is being pulled apart, and waves
    const btVector3 x = world.sheet->m_nodes[i].m_x;
    world.sheet->m_nodes[i].m_v = {0.5f * x.x(), 0.2f * x.z(), 0};
  }
  Arrays given = segment_of(world, by_shape, nodes_at_start);
  const std::vector<int32_t> edges = world.links();
  given.push_back(make_array("edges", {std::ssize(edges) / 2, 2}, edges));

  std::filesystem::create_directories(folder);
  std::vector<float> positions, velocities;
  std::vector<double> time;
  const auto write = [&](const char* name, std::vector<cutproof::io::NamedText> texts) {
    const auto k = std::ssize(time), n = std::ssize(positions) / 3 / k;
    given.push_back(make_array("positions", {k, n, 3}, positions));
    given.push_back(make_array("velocities", {k, n, 3}, velocities));
    given.push_back(make_array("time", {k}, time));
    cutproof::io::write_array_file(folder + "/" + name, {given, std::move(texts)});
    positions = velocities = {};
    time = {};
  };
  // Clusters that were made before the cut point into memory that is gone: the next step must not read them.
  for (int frame = 0; frame < (before ? kCut + 1 : kFrames); ++frame) {
    if (frame > 0) world.world.stepSimulation(1 / 60.f, 0);
    if (frame == kCut) {
      write("000000.npz", {{"promises", "free"}});
      world.cut();
      if (by_shape) world.sheet->setPose(false, true);
      if (coupling == "clusters_after") make_clusters(world);
      given = segment_of(world, by_shape, nodes_at_start);
    }
    for (int i = 0; i < world.nodes(); ++i) {
      push_back(positions, world.sheet->m_nodes[i].m_x);
      push_back(velocities, world.sheet->m_nodes[i].m_v);
    }
    time.push_back(frame / 60.0);
  }
  std::vector<float> blade(time.size() * 12, std::numeric_limits<float>::quiet_NaN());
  int corner = 0;
  for (const auto& [y, z] : {std::pair{-2.f, -2.f}, {2.f, -2.f}, {2.f, 2.f}, {-2.f, 2.f}}) {
    for (const float each : {kPlane, y, z}) blade[corner++] = each;
  }
  given.push_back(make_array("blade", {std::ssize(time), 1, 4, 3}, blade));
  write("000001.npz", {});
}

}  // namespace

int main(int count, char** words) {
  const std::string what = count == 4 ? words[1] : "", how = count == 4 ? words[2] : "";
  if (what == "kick") return write_kick(std::strtof(words[2], nullptr), words[3]), 0;
  for (const char* const known : {"links", "shape", "clusters_before", "clusters_after"}) {
    if (what == "run" && how == known) return write_run(how, words[3]), 0;
  }
  std::fputs(
      "usage: bullet_soft_body kick KMT FILE\n"
      "       bullet_soft_body run links|shape|clusters_before|clusters_after FOLDER\n",
      stderr);
  return 2;
}
