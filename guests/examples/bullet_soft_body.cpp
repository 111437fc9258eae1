// bullet_soft_body KMT FILE: the kick test on Bullet's soft bodies. A sheet is cut in two, and simulated with and
// without a kick of one piece; `cutproof kick FILE` then says whether the other one felt it. KMT is Bullet's m_cfg.kMT,
// how strongly the body as a whole is drawn back to its shape.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <cstdio>
#include <cstdlib>

#include "model/io/array_file.h"

namespace {

constexpr int kFrames = 120;

struct Plane : btSoftBody::ImplicitFn {
  btScalar Eval(const btVector3& place) override { return place.x() - btScalar(0.07); }
};

struct Run {
  std::vector<int32_t> piece;    // [n]
  std::vector<float> positions;  // [kFrames x n x 3] m
};

// Nodes joined by links, by the smallest of them.
std::vector<int32_t> pieces_of(const btSoftBody& sheet) {
  std::vector<int32_t> piece;
  for (int i = 0; i < sheet.m_nodes.size(); ++i) piece.push_back(i);
  for (bool changed = true; changed;) {
    changed = false;
    for (int k = 0; k < sheet.m_links.size(); ++k) {
      int32_t& a = piece[sheet.m_links[k].m_n[0] - &sheet.m_nodes[0]];
      int32_t& b = piece[sheet.m_links[k].m_n[1] - &sheet.m_nodes[0]];
      changed = changed || a != b;
      a = b = std::min(a, b);
    }
  }
  return piece;
}

Run simulate(float kMT, float kick) {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, 0, 0});
  world.getWorldInfo().m_gravity.setZero();

  // A sheet of 2 m x 2 m and 1 kg.
  btSoftBody* const sheet = btSoftBodyHelpers::CreatePatch(world.getWorldInfo(), {-1, 0, -1}, {1, 0, -1}, {-1, 0, 1},
                                                           {1, 0, 1}, 13, 13, 0, true);
  sheet->setTotalMass(1);
  Plane plane;
  sheet->refine(&plane, 0.001f, true);
  sheet->m_cfg.kMT = kMT;
  sheet->setPose(false, true);  // the shape that kMT draws to; it has to follow the cut, which makes nodes
  world.addSoftBody(sheet);

  Run run;
  run.piece = pieces_of(*sheet);
  for (int frame = 0; frame < kFrames; ++frame) {
    for (int i = 0; frame == 10 && i < sheet->m_nodes.size(); ++i) {
      if (run.piece[i] == 0) sheet->addVelocity({0, kick, 0}, i);
    }
    world.stepSimulation(1 / 60.f, 0);
    for (int i = 0; i < sheet->m_nodes.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) run.positions.push_back(sheet->m_nodes[i].m_x[axis]);
    }
  }
  world.removeSoftBody(sheet);
  delete sheet;
  return run;
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) return std::fputs("usage: bullet_soft_body KMT FILE\n", stderr), 2;
  const float kMT = std::strtof(words[1], nullptr);
  const Run still = simulate(kMT, 0), kicked = simulate(kMT, 1), again = simulate(kMT, 0);
  const auto n = static_cast<int64_t>(still.piece.size());
  cutproof::io::write_array_file(words[2], {{cutproof::make_array("positions", {kFrames, n, 3}, still.positions),
                                             cutproof::make_array("kicked", {kFrames, n, 3}, kicked.positions),
                                             cutproof::make_array("again", {kFrames, n, 3}, again.positions),
                                             cutproof::make_array("piece", {n}, still.piece),
                                             cutproof::make_array<int32_t>("kicked_piece", {}, {0})},
                                            {}});
}
